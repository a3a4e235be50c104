"""How the past is forgotten: the time update of every estimator."""

from ..engine.lazy import lazily

_HOME = {
    "Drift": "transition",
    "MultipleModel": "bank",
    "IMM": "bank",
    "FuzzyDrift": "fuzzy",
    "CovarianceMatching": "matching",
    "AuxiliaryFilter": "auxiliary",
    "AutocovarianceLS": "correlation",
    "LikelihoodDrift": "likelihood",
    "VariationalBayes": "variational",
    "CovarianceInflation": "drift",
    "GainReset": "restart",
    "GainFloor": "fading",
    "VariableForgetting": "fading",
    "DirectionalForgetting": "directional",
    "Window": "window",
    "BayesianChangePoint": "run_lengths",
    "Constant": "drift",
    "ExponentialForgetting": "fading",
    "RandomWalk": "drift",
    "RestartOnChange": "drift",
    "AutoMemory": "auto",
}

__all__ = list(_HOME)
__getattr__, __dir__ = lazily(__name__, _HOME)
