"""Model x memory: one recursion for each kind of model."""

from ..engine.lazy import lazily

_HOME = {
    "Step": "base",
    "algebraic_identification": "algebraic_start.algebraic",
    "AlgebraicStart": "algebraic_start.start",
    "AdaptiveObserver": "adaptive_observer.estimator",
    "SmoothedParameters": "smoothing.smoothed_parameters",
    "sensor_calibration": "model_average.sensor",
    "symbolic_coefficients": "algebraic_observer.symbolic",
    "AR": "arx.estimator",
    "ARX": "arx.estimator",
    "ARMA": "armax.estimator",
    "ARMAX": "armax.estimator",
    "OE": "armax.estimator",
    "BJ": "armax.estimator",
    "Regression": "arx.regression",
    "SeasonalARX": "seasonal.estimator",
    "ARXMIMO": "arx_mimo.estimator",
    "Joint": "joint.estimator",
    "JointMIMO": "joint_mimo.estimator",
    "ContinuousJoint": "continuous.estimator",
    "AdaptiveGain": "adaptive_gain.estimator",
    "WindowObserver": "window_observer.estimator",
    "AlgebraicObserver": "algebraic_observer.estimator",
    "Manoeuvre": "manoeuvre.estimator",
    "ModelAverage": "model_average.estimator",
    "AverageTrace": "model_average.trace",
    "TrackEstimator": "track.estimator",
    "StateSpace": "state_space.estimator",
    "OutOfOrder": "out_of_order.estimator",
    "GreyBox": "grey_box.estimator",
}

__all__ = list(_HOME)
__getattr__, __dir__ = lazily(__name__, _HOME)
