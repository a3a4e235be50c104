"""What the paper prints or concludes that does not hold; the finding that shows it has the numbers."""

from __future__ import annotations

from ..verdict import Statement

ONE_SUM = Statement(
    "section 4.3",
    "One sum S_n, less Δμ, serves the test for an increase and the test for a decrease.",
    "The test for a decrease needs a sum of its own, plus Δμ; with one sum it fires on clean data.",
)
CRITERION = Statement(
    "section 4.5",
    "The threshold and N0 are those that minimise J = E_FA T/T1 + (E_jump + R_D) T/T0.",
    "R_D is a time added to an energy; and J has no minimum, even with T1 put right: it falls for ever as the "
    "threshold and N0 go to 0.",
)
RUN_LENGTH = Statement(
    "section 4.5",
    "Mean time between false alarms T1 = G²/(2 Δμ²) [e^x − 1 + x], x = 2 Δμ h/G².",
    "The last sign is wrong: e^x − 1 − x. And it is the time of a Brownian motion; a sum of Gaussian samples "
    "jumps over the threshold and lasts as if h were 1.165 G higher.",
)
DELAY = Statement(
    "section 4.5",
    "Mean delay of an alarm R_D = h/|Δμ|.",
    "h/|Δμ| − G²/(2 Δμ²) (1 − e^−x): a sum that never falls below its start is sooner at the threshold than its drift.",
)
VARIANCE = Statement(
    "section 5",
    "Hampton's variance: ω⁻¹(n+1) = ω⁻¹(n) + ν ν'/(n + 1).",
    "The term − ω⁻¹(n)/(n + 1) is missing: as printed the gain of the algorithm falls like 1/(n ln n).",
)
WORTH = Statement(
    "section 6",
    "The examples (the three plates) show the interest of re-initialising the gain.",
    "On these plates it is worse than doing nothing: a jump of a fifth of the noise is too small to restart for, and "
    "the paper's N0 = 6 and 15 are too small for such a jump (1 + G²/d² = 26.5).",
)
CONVERGENCE = Statement(
    "section 6",
    "Re-initialisation keeps convergence with probability 1.",
    "Not with a fixed threshold: false alarms never stop, and each lifts the gain again. A threshold that grows like "
    "ln n keeps it.",
)
