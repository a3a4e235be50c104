"""What several test files use."""

import os
import sys

# Workers fill the cores: more threads inside a small matrix product only wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest

from driftwise.edge import cli


def pytest_collection_modifyitems(items):
    """Run the examples of the documentation late: what they compile, other tests have compiled by then."""
    items.sort(key=lambda item: "test_q" if item.path.name == "test_docs.py" else item.path.name)


@pytest.fixture
def call(monkeypatch, capsys):
    """Run the command line in this process and return (exit code, standard output, standard error)."""

    def run(*args):
        monkeypatch.setattr(sys, "argv", ["driftwise", *map(str, args)])
        try:
            cli.main()
            code = 0
        except SystemExit as done:
            code = done.code or 0
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run
