"""Every model with every memory: small examples of both, what the table of refusals says of a pair, and what is so."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from ..detect.variance import VarianceCUSUM
from ..engine.errors import InputError
from ..estimators.adaptive_gain.estimator import AdaptiveGain
from ..estimators.adaptive_observer.estimator import AdaptiveObserver
from ..estimators.armax.estimator import ARMA, ARMAX, BJ, OE
from ..estimators.arx.estimator import AR, ARX
from ..estimators.arx.regression import Regression
from ..estimators.arx_mimo.estimator import ARXMIMO
from ..estimators.common.refusals import why_not
from ..estimators.continuous.estimator import ContinuousJoint
from ..estimators.joint.estimator import Joint
from ..estimators.joint_mimo.estimator import JointMIMO
from ..memory.auto import AutoMemory
from ..memory.autocovariance_ls import AutocovarianceLS
from ..memory.auxiliary_filter import AuxiliaryFilter
from ..memory.bayesian_change_point import BayesianChangePoint
from ..memory.constant import Constant
from ..memory.covariance_matching import CovarianceMatching
from ..memory.directional_forgetting import DirectionalForgetting
from ..memory.drift import Drift
from ..memory.exponential_forgetting import ExponentialForgetting
from ..memory.fuzzy_drift import FuzzyDrift
from ..memory.gain_floor import GainFloor
from ..memory.imm import IMM
from ..memory.likelihood_drift import LikelihoodDrift
from ..memory.multiple_model import MultipleModel
from ..memory.random_walk import RandomWalk
from ..memory.restart_on_change import RestartOnChange
from ..memory.variable_forgetting import VariableForgetting
from ..memory.variational_bayes import VariationalBayes
from ..memory.window import Window
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
    "AdaptiveGain": lambda memory: AdaptiveGain(0.9, memory=memory),
}

MEMORIES: dict[str, Any] = {
    type(memory).__name__: memory
    for memory in (
        Constant(),
        GainFloor(20),
        ExponentialForgetting(0.95),
        VariableForgetting(20),
        DirectionalForgetting(0.95),
        RandomWalk(1e-4),
        Drift(nvr=1e-3),
        Window(10),
        RestartOnChange(VarianceCUSUM(threshold=1.0), settle=10),
        BayesianChangePoint(0.3, 50, 4),
        AutoMemory(),
        MultipleModel(),
        IMM(),
        LikelihoodDrift(),
        FuzzyDrift(),
        CovarianceMatching(),
        AuxiliaryFilter(),
        AutocovarianceLS(3),
        VariationalBayes(),
    )
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
