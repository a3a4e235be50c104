"""Which memories an estimator does not take, and why: one sentence a pair, for the error, the docs and the matrix.

A pair that is not here is taken. Refusals that hang on a setting (a walk matched to jumps, say) are their estimator's.
"""

from __future__ import annotations

from ...engine.errors import InputError, refuse_class

_LEVEL = (
    "it takes innovations larger than expected for drift, and here what to expect is the mean of their own squares, "
    "which the noise moves at once and a wrong gain only to second order"
)

OF_PARAMETERS = (
    "the memories of StateSpace are Constant(), ExponentialForgetting(lam), by which the state's own past fades, and "
    "LikelihoodDrift(), which learns how large Q is: the others are about parameters, and how the state moves is what "
    "F and Q say. A noise level that changes is scale=InverseGamma(..) with scale_samples; tune(y) learns from a record"
)

REFUSED: dict[str, dict[str, str]] = {  # by estimator and by the name of the memory
    "AdaptiveGain": {
        **dict.fromkeys(("FuzzyDrift", "CovarianceMatching", "AuxiliaryFilter", "VariationalBayes"), _LEVEL),
        "RestartOnChange": (
            "what watches for jumps has an option of its own here: detector=.., and restart=.. says what an alarm does"
        ),
    },
}


def why_not(estimator: str, memory) -> str:
    """Return why estimators of this name do not take a memory of the package, a sentence; "" where they do."""
    kind = type(memory)
    return REFUSED.get(estimator, {}).get(kind.__name__, "") if kind.__module__.startswith("driftwise.") else ""


def check_taken(estimator: str, memory) -> None:
    """Raise InputError, with the sentence, where estimators of this name do not take a memory."""
    refuse_class("memory", memory)
    if reason := why_not(estimator, memory):
        raise InputError(f"{estimator} does not take {type(memory).__name__}: {reason}; got {memory!r}")
