"""Every model with every memory: small examples of both, what the table of refusals says of a pair, and what is so."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from ..engine.errors import InputError
from ..estimators.adaptive_gain.estimator import AdaptiveGain
from ..estimators.adaptive_observer.estimator import AdaptiveObserver
from ..estimators.armax.estimator import ARMA, ARMAX, BJ, OE
from ..estimators.arx.estimator import AR, ARX
from ..estimators.arx.regression import Regression
from ..estimators.arx_mimo.estimator import ARXMIMO
from ..estimators.common.refusals import why_not
from ..estimators.continuous.estimator import ContinuousJoint
from ..estimators.grey_box.estimator import GreyBox
from ..estimators.joint.estimator import Joint
from ..estimators.joint_mimo.estimator import JointMIMO
from ..memory.questions import MEMORIES as ANSWERING
from ..memory.registry import public
from .laws import example

YES = "yes"

MODELS: dict[str, Callable[[Any], Any]] = {
    "AR": lambda memory: AR(2, memory=memory),
    "ARX": lambda memory: ARX(1, 1, memory=memory),
    "Regression": lambda memory: Regression(2, memory=memory),
    "ARMA": lambda memory: ARMA(1, 1, memory=memory),
    "ARMAX": lambda memory: ARMAX(1, 1, 1, memory=memory),
    "OE": lambda memory: OE(1, 1, memory=memory),
    "BJ": lambda memory: BJ(1, 1, 1, 1, memory=memory),
    "AdaptiveObserver": lambda memory: AdaptiveObserver(1, 0.3, 1, memory=memory),
    "ARXMIMO": lambda memory: ARXMIMO(2, 1, na=1, nb=1, memory=memory),
    "Joint": lambda memory: Joint(1, 1, memory=memory),
    "JointMIMO": lambda memory: JointMIMO((1, 1), 1, memory=memory),
    "ContinuousJoint": lambda memory: ContinuousJoint(1, 1, memory=memory),
    "GreyBox": lambda memory: GreyBox("tank", start=None, memory=memory),
    "AdaptiveGain": lambda memory: AdaptiveGain(0.9, memory=memory),
}

MEMORIES: dict[str, Any] = {
    name: entry.kind(**entry.example)
    for name, entry in public().items()
    if entry.kind in ANSWERING and entry.kind.__module__.startswith("driftwise.")
}


def pairs() -> Iterator[tuple[str, str]]:
    """Yield all pairs (model, memory) by their names."""
    for model in MODELS:
        for memory in MEMORIES:
            yield model, memory


def said(model: str, memory: str) -> str:
    """Return what the table of refusals says of a pair: "yes", or a sentence."""
    return why_not(model, MEMORIES[memory]) or YES


def tried(model: str, memory: str, samples: int = 40) -> str:
    """Return what comes of a pair, made and run over a short record: "yes", or the error at the door."""
    try:
        estimator = MODELS[model](MEMORIES[memory])
    except InputError as refused:
        return str(refused)
    estimator.scan(*example(estimator, samples))
    return YES
