"""State and parameters of a drifting linear stochastic system, sample by sample, with honest error bars.

What people type most is here; the rest is where it belongs: `driftwise.memory`, `.detect`, `.models`, `.estimators`,
`.results`, `.analysis`, `.fleet`, `.tracking`.
"""

from .engine.lazy import lazily
from .version import __version__ as __version__

_HOME = {
    "AR": "estimators.arx.estimator",
    "ARX": "estimators.arx.estimator",
    "ARMA": "estimators.armax.estimator",
    "ARMAX": "estimators.armax.estimator",
    "OE": "estimators.armax.estimator",
    "BJ": "estimators.armax.estimator",
    "Regression": "estimators.arx.regression",
    "ARXMIMO": "estimators.arx_mimo.estimator",
    "Joint": "estimators.joint.estimator",
    "JointMIMO": "estimators.joint_mimo.estimator",
    "ContinuousJoint": "estimators.continuous.estimator",
    "AdaptiveGain": "estimators.adaptive_gain.estimator",
    "WindowObserver": "estimators.window_observer.estimator",
    "AlgebraicObserver": "estimators.algebraic_observer.estimator",
    "ModelAverage": "estimators.model_average.estimator",
    "TrackEstimator": "estimators.track.estimator",
    "StateSpace": "estimators.state_space.estimator",
    "GreyBox": "estimators.grey_box.estimator",
    "Constant": "memory.constant",
    "ExponentialForgetting": "memory.exponential_forgetting",
    "RandomWalk": "memory.random_walk",
    "RestartOnChange": "memory.restart_on_change",
    "AutoMemory": "memory.auto",
    "PageHinkley": "detect.hinkley",
    "InnovationGate": "detect.gate",
    "Plant": "models.plant",
    "simulate": "models.simulation",
    "identify": "analysis.identify",
    "compare": "analysis.comparison",
    "Fleet": "fleet.fleet",
    "track": "tracking.tracker",
    "Trace": "results.trace",
    "Status": "engine.status",
    "InputError": "engine.errors",
    "save_state": "results.snapshot",
    "load_state": "results.snapshot",
    "check_estimator": "analysis.laws",
    "check_policy": "analysis.laws",
    "sample_data": "analysis.sample",
}
_ROOMS = ("memory", "detect", "models", "estimators", "results", "analysis", "fleet", "tracking")

__all__ = list(_HOME)
__getattr__, __dir__ = lazily(__name__, _HOME, _ROOMS)
