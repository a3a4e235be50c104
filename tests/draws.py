"""How much is drawn: a part in `make test`, as much as a statistic asks for in `make test-all`."""

import pytest


def slow(*values, **options):
    """Return a parameter that is tried in `make test-all` alone."""
    return pytest.param(*values, marks=pytest.mark.slow, **options)


def draws(name, few, many):
    """Try a test with ``few`` of what it draws, and with ``many`` where time does not matter."""
    return pytest.mark.parametrize(name, [pytest.param(few, id="few"), slow(many, id="many")])
