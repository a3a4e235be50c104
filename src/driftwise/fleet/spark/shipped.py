"""An estimator on its way to the executors: settings as text where they are ours, and what must agree at both ends."""

from __future__ import annotations

import functools
import pickle
from typing import Any, NamedTuple

from ...engine.errors import InputError


class Shipped(NamedTuple):
    """An estimator as an executor gets it."""

    text: str  # `describe`d, or empty
    pickled: bytes  # where a policy is the user's own: by reference, so its module must be there too
    version: str  # of driftwise
    fingerprint: int  # of its recursions and of those policies


def ship(estimator) -> Shipped:
    """Return what goes to the executors.

    Raises
    ------
    InputError
        Where a policy was defined in a notebook: its compiled code is found by the name of its module.
    """
    from ...results.snapshot import describe, is_described
    from ...version import __version__
    from ..fleet import Fleet, check_learns

    Fleet(estimator)  # refuses what no fleet can hold, in its own words
    check_learns(estimator)
    is_ours = is_described(estimator)
    kinds = tuple(map(type, estimator.policies))
    homeless = [kind.__name__ for kind in kinds if kind.__module__ == "__main__"]
    if homeless:
        raise InputError(
            f"{', '.join(homeless)} is defined in __main__, where executors cannot find it: put it into a module "
            "of its own and hand that over, spark.addArtifact(path, pyfile=True) or spark-submit --py-files"
        )
    text, pickled = (describe(estimator), b"") if is_ours else ("", pickle.dumps(estimator))
    return Shipped(text, pickled, __version__, _fingerprint(kinds))


def _fingerprint(kinds) -> int:
    from ...engine import compile

    return compile.fingerprint(kinds)


@functools.cache
def unship(shipped: Shipped) -> Any:
    """Return the estimator, on an executor, once for each process.

    Raises
    ------
    InputError
        Where this machine has another driftwise, or other sources of a policy: its numbers would be others.
    """
    from ...results.snapshot import rebuild
    from ...version import __version__

    if shipped.version != __version__:
        raise InputError(
            f"the driver has driftwise {shipped.version}, this executor {__version__}: install one of them"
        )
    estimator = rebuild(shipped.text) if shipped.text else pickle.loads(shipped.pickled)
    if _fingerprint(tuple(map(type, estimator.policies))) != shipped.fingerprint:
        raise InputError(
            f"driver and executor both have driftwise {__version__}, of different sources: install one of them"
        )
    return estimator
