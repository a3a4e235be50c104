"""How the past is forgotten: the time update of every estimator."""

from ..engine.lazy import lazily

_HOME = {
    "Constant": "constant",
    "RandomWalk": "random_walk",
    "RestartOnChange": "restart_on_change",
    "CovarianceInflation": "restart_on_change",
    "GainReset": "restart_on_change",
    "AutoMemory": "auto",
    "GainFloor": "gain_floor",
    "ExponentialForgetting": "exponential_forgetting",
    "VariableForgetting": "variable_forgetting",
    "DirectionalForgetting": "directional_forgetting",
    "Window": "window",
    "BayesianChangePoint": "bayesian_change_point",
    "Drift": "drift",
    "LikelihoodDrift": "likelihood_drift",
    "FuzzyDrift": "fuzzy_drift",
    "CovarianceMatching": "covariance_matching",
    "AuxiliaryFilter": "auxiliary_filter",
    "AutocovarianceLS": "autocovariance_ls",
    "VariationalBayes": "variational_bayes",
    "MultipleModel": "multiple_model",
    "IMM": "imm",
    # for a memory of one's own
    "register": "registry",
    "begin": "questions",
    "mixture": "questions",
    "adapt": "questions",
    "count": "questions",
    "found_jump": "questions",
    "outlier_probability": "questions",
    "additive_share": "questions",
    "doubted_output": "questions",
    "on_alarm": "questions",
    "time_update": "questions",
    "resolve": "questions",
    "least_squares": "questions",
    "View": "questions",
    "Setting": "settings",
    "PerParameter": ".engine.dispatch",
    "Vector": ".engine.dispatch",
    "kernel": ".engine.dispatch",
}

__all__ = list(_HOME)
__getattr__, __dir__ = lazily(__name__, _HOME)
