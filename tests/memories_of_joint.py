"""Every memory once, as the laws try them on the joint filters: short ones, so that an example sees them act."""

import driftwise as dw
from driftwise import memory as m

MEMORIES = {
    "gain floor": m.GainFloor(20),
    "exponential": m.ExponentialForgetting(0.95),
    "variable": m.VariableForgetting(30),
    "directional": m.DirectionalForgetting(0.95),
    "drift": m.Drift(phi=0.99, q=1e-4),
    "drift of a ratio": m.Drift(nvr=1e-3),
    "fuzzy": m.FuzzyDrift(as_published=True),
    "matching": m.CovarianceMatching(),
    "Myers-Tapley": m.CovarianceMatching("myers-tapley"),
    "auxiliary": m.AuxiliaryFilter(),
    "autocovariance": m.AutocovarianceLS(3),
    "likelihood": m.LikelihoodDrift(),
    "likelihood, shared": m.LikelihoodDrift(shared=True, phi=0.999),
    "variational": m.VariationalBayes(),
    "variational, both": m.VariationalBayes("both"),
    "bank": m.MultipleModel((0.0, 1e-4, 1e-2)),
    "interacting": m.IMM((0.0, 1e-2)),
    "auto": dw.AutoMemory(),
    "auto, no outliers": dw.AutoMemory("jumps"),
    "run lengths": m.BayesianChangePoint(0.3, 50, 5),
    "window": m.Window(20),
    "gain reset": dw.RestartOnChange(response=m.GainReset(5), settle=10),
    "the one that jumped": dw.RestartOnChange(response=m.CovarianceInflation(0.5, only_named=True), settle=10),
}
