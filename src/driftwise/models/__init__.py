"""What the system is: equations, noise, plants, simulation, models out of estimates."""

from ..engine.lazy import lazily

_HOME = {
    "OutputError": "noise",
    "EquationError": "noise",
    "NoisePolynomial": "noise",
    "UnknownPolynomial": "noise",
    "NoiseCovariance": "noise",
    "InverseGamma": "scale",
    "Disturbance": "disturbance",
    "Polynomial": "plant",
    "Sinusoid": "plant",
    "Model": "convert",
    "PolynomialModel": "polynomial",
    "ContinuousModel": "continuous",
    "simulate_continuous": "continuous",
    "simulate_mimo": "simulation",
    "Singer": "singer",
    "confidence_ellipse": "ellipse",
    "spectral_factor": "spectral",
    "minimum_phase": "spectral",
    "asymptotic_bias": "asymptotic",
    "cramer_rao": "information",
    "cramer_rao_of_record": "information",
    "Plant": "plant",
    "simulate": "simulation",
}

__all__ = list(_HOME)
__getattr__, __dir__ = lazily(__name__, _HOME)
