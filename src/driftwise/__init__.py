"""driftwise: state and parameters of a drifting linear stochastic system, sample by sample, with honest error bars."""

import importlib

__version__ = "0.1.0"

_HOME = {
    "Joint": "estimators.joint.estimator",
    "Step": "estimators.reading",
    "ContinuousJoint": "estimators.continuous.estimator",
    "ContinuousModel": "models.continuous",
    "simulate_continuous": "models.continuous",
    "JointMIMO": "estimators.mimo.estimator",
    "ARXMIMO": "estimators.several.estimator",
    "AdaptiveObserver": "estimators.observer.estimator",
    "AR": "estimators.recursive.estimator",
    "ARX": "estimators.recursive.estimator",
    "Regression": "estimators.recursive.estimator",
    "ARMA": "estimators.polynomial.estimator",
    "ARMAX": "estimators.polynomial.estimator",
    "OE": "estimators.polynomial.estimator",
    "BJ": "estimators.polynomial.estimator",
    "AdaptiveGain": "estimators.gain.estimator",
    "GainProbes": "detect.gain",
    "PullTest": "detect.gain",
    "OutputError": "models.noise",
    "EquationError": "models.noise",
    "NoisePolynomial": "models.noise",
    "UnknownPolynomial": "models.noise",
    "NoiseCovariance": "models.noise",
    "UnknownScale": "models.scale",
    "Never": "memory.drift",
    "Walk": "memory.drift",
    "Drift": "memory.transition",
    "Auto": "memory.auto",
    "Bank": "memory.bank",
    "Interacting": "memory.bank",
    "FuzzyDrift": "memory.fuzzy",
    "CovarianceMatching": "memory.matching",
    "AuxiliaryFilter": "memory.auxiliary",
    "Correlation": "memory.correlation",
    "LikelihoodDrift": "memory.likelihood",
    "VariationalBayes": "memory.variational",
    "UntilJump": "memory.drift",
    "Inflate": "memory.drift",
    "GainReset": "memory.restart",
    "LimitedGain": "memory.fading",
    "Weighted": "memory.fading",
    "VariableForgetting": "memory.fading",
    "DirectionalForgetting": "memory.directional",
    "Window": "memory.window",
    "RunLengths": "memory.run_lengths",
    "Hinkley": "detect.hinkley",
    "Score": "detect.score",
    "VarianceChange": "detect.variance",
    "GLR": "detect.glr",
    "ProbeBank": "detect.probes",
    "probe_bank": "detect.probes",
    "score_test": "detect.score_test",
    "Alarms": "detect.alarms",
    "Monitor": "detect.monitor",
    "Gate": "detect.gate",
    "design_restart": "detect.restart",
    "run_length": "detect.run_length",
    "threshold_for": "detect.run_length",
    "Status": "kernel.status",
    "InputError": "errors",
    "Trace": "workflow.trace",
    "SmoothedParameters": "workflow.smoothed_parameters",
    "Summary": "workflow.summary",
    "SummaryMIMO": "workflow.mimo_summary",
    "save_state": "workflow.snapshot",
    "load_state": "workflow.snapshot",
    "ljung_box": "workflow.whiteness",
    "nis": "workflow.whiteness",
    "OrderEvidence": "workflow.orders",
    "choose_order": "workflow.orders",
    "StructureEvidence": "workflow.structures",
    "choose_structure": "workflow.structures",
    "Plant": "models.plant",
    "Polynomial": "models.plant",
    "Sinusoid": "models.plant",
    "Model": "models.convert",
    "PolynomialModel": "models.polynomial",
    "ellipse": "models.ellipse",
    "simulate": "models.simulate",
    "Singer": "models.singer",
    "spectral_factor": "models.spectral",
    "reflect": "models.spectral",
    "wrong_noise_limit": "models.asymptotic",
    "cramer_rao": "models.information",
    "cramer_rao_of_record": "models.information",
    "identifiability": "workflow.identifiability",
    "simulate_mimo": "models.simulate_mimo",
    "check_estimator": "workflow.laws",
    "check_policy": "workflow.laws",
    "sample_data": "workflow.sample",
}

__all__ = list(_HOME)


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module 'driftwise' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"driftwise.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__():
    return sorted([*globals(), *__all__])
