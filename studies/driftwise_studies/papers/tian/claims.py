"""What the paper says that does not hold; the finding that shows it has the numbers."""

from __future__ import annotations

from ..verdict import Statement

TUNING = Statement(
    "section I, first property",
    "There are no observer gains and no other parameters to tune.",
    "The epsilon after which the formulas count is one, and it decides everything; so are the list of the "
    "disturbance's modes and the size at which each is worth estimating. Where a deviation is stated, epsilon follows "
    "from it.",
)
OTHER_NOISE = Statement(
    "section I, third property",
    "The estimate is robust to measurement noise, be it white or of another nature.",
    "Nothing protects it: noise of the same variance that is not white triples the error of the current.",
)
GENERAL = Statement(
    "section II, hypothesis (2)",
    "The approach is for a general class of linear systems with structured disturbances.",
    "C D = C A D = .. = 0 excludes the most natural disturbance of a motor, a load torque. Nothing in the formulas "
    "shows that it fails: x3 is wrong by p/K1.",
)
FACTOR = Statement(
    "section III, (5)",
    "1/(-t)^N multiplies M, and F is taken off.",
    "1/(-t)^N multiplies M - F.",
)
INDICES = Statement(
    "section III, theorem 1",
    "The constants are k_q, and r with the indices h and μ.",
    "k depends on μ and j, and r on j, h and q: with one k_q for all j, alpha is wrong from μ = 2 on.",
)
POLES = Statement(
    "section III, (14)",
    "Without loss of generality Q1 is a sum of simple fractions.",
    "Not for the paper's own motor: the constant disturbance doubles its pole at 0. A filter in state space needs no "
    "such condition.",
)
LIMIT = Statement(
    "section III, (18)",
    "The derivatives of u go up to h = m + μ - n - 1.",
    "Up to h = m + μ - n. The direct term b_m u is lost otherwise, which the paper's own (28) has.",
)
WHITE = Statement(
    "section IV.B, figure 2",
    "After epsilon = 0.15 s the estimator is little sensitive to white noise.",
    "The angle is, the current is not: the disturbance at 50 rad/s moves the angle by a thousandth of the noise, and "
    "who removes it without knowing its size pays for it in the current.",
)
DISTURBANCE = Statement(
    "section IV.B, figure 4",
    "The unknown disturbance can be obtained from the relation of input and output.",
    "Without noise only, as the figure is drawn. With the noise of figure 3 it is buried.",
)
