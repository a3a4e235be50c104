"""What the paper says that does not hold; the finding that shows it has the numbers."""

from __future__ import annotations

from ..verdict import Statement

GAIN = Statement(
    "section 3, (9) and (11)",
    "The gain of θ(k+1) = Φ θ(k) + L ε is L = P ψ/(σ² + ψ' P ψ), and P(k) of (12) is the covariance of θ.",
    "L = Φ P ψ/(σ² + ψ' P ψ). Without Φ the estimate is another filter's than the covariance: innovations are "
    "correlated and P is too small. Where Φ = I nothing shows.",
)
LIKELIHOOD = Statement(
    "section 4, (14)",
    "Maximum likelihood: the largest F = −½ Σ ε²/E[ε²].",
    "F = −½ Σ (log E[ε²] + ε²/E[ε²]). Without the logarithm the largest F is at Q = ∞.",
)
INCREMENT = Statement(
    "section 5",
    "The step of each parameter's estimate tells how large its own q must be.",
    "The step is K ε: over its own standard deviation it is the same number for all parameters, |ε|/√S. The rule knows "
    "two innovations, and each parameter's sensitivity, nothing else.",
)
EXCITES = Statement(
    "section 6, input",
    "The square wave continually excites the system in the whole region of its working domain.",
    "Over a whole period of 20 it excites order 10; but a tracker's memory is shorter, and windows of 5 samples hardly "
    "excite four parameters.",
)
SEPARATES = Statement(
    "section 6, example",
    "The example tests how a method finds the unknown Q, σ² being known.",
    "|u| = 2 at every sample: three of the five regressors of (13) are proportional to one another. The record cannot "
    "tell q4 from σ², and only q3 can be estimated at all: a1, a2 and b2 are nearly white.",
)
HEADLINE = Statement(
    "section 6, figures 3 and 4",
    "The quality of the estimation with the fuzzy method is better than with the auxiliary filter; this proves the "
    "efficiency of ad hoc methods with regard to covariance matching.",
    "It depends on the misprinted gain, on the size of Q, and on how the competitor is tuned: with the right gain, "
    "both tuned on the example, the auxiliary filter wins in most records.",
)
BARS = Statement(
    "section 6, conclusion",
    "The fuzzy Q gives as good a quality as the known Q.",
    "Predictions are nearly as good, the covariance is not: bars are far too short.",
)
