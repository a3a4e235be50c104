"""What the paper prints or concludes that does not hold, with the numbers; and what does."""

from __future__ import annotations

import numpy as np

from driftwise.detect.restart import design_restart, printed_criterion

from ..verdict import Section, Table, Verdict

SOURCE = "theory/perriot.md P13 / P1.4"
WRONG = [  # what the paper says, what holds, the check with the number
    (
        "section 6: re-initialisation keeps convergence with probability 1",
        "Not with a fixed threshold: false alarms never stop. A threshold that grows like ln n keeps it.",
        "a fixed threshold: alarms in a million samples without a jump",
    ),
    (
        "section 5: the examples show the interest of the method",
        "On these plates it is worse than doing nothing: jumps of a fifth of the noise are too small to restart for.",
        "plate 3 against plate 1: does re-initialisation pay here?",
    ),
    (
        "section 5: N0 = 6 for an increase, 15 for a decrease",
        "1 + G²/d² = 26.5 for a jump of .2: a gain of 1/6 adds an error as large as the jump.",
        "K-MSE of Hinkley, the paper's values but N0 = 26.5",
    ),
    (
        "section 4.5: T1 = G²/(2 Δμ²) [e^x − 1 + x]",
        "e^x − 1 − x. And it is the time of a Brownian motion: samples jump over the threshold.",
        "T1 of the Brownian motion (dmu .3, h 3, G 1), steps towards 0",
    ),
    (
        "section 4.5: R_D = Δ/|Δμ|",
        "The reflection at 0 shortens it.",
        "delay R_D (dmu 0.07, h 20) from 0",
    ),
    (
        "section 4.5: J = E_FA T/T1 + (E_jump + R_D) T/T0 is to be minimised",
        "R_D is a time among energies, and J has no minimum: it falls for ever towards h = N0 = 0.",
        "the criterion J as printed has no minimum",
    ),
    (
        "section 4.3: one S_n, less Δμ, for both tests",
        "The test for a decrease needs its own sum, plus Δμ; with one sum it fires on clean data.",
        "clean data: the test for a decrease (.07, 20)",
    ),
    (
        "section 5: ω⁻¹(n+1) = ω⁻¹(n) + ν ν'/(n + 1)",
        "The term − ω⁻¹(n)/(n + 1) is missing: as printed the gain falls like 1/(n ln n).",
        "Hampton's variance without its term − ω⁻¹(n)",
    ),
]


def section(others: list[Section]) -> Section:
    """Return what does not hold, with the numbers the other sections found."""
    minimum = _minimum()
    values = {verdict.name: verdict.value for part in others for verdict in [*part.verdicts, minimum]}
    rows = [[claim, truth, values[check]] for claim, truth, check in WRONG]
    return Section(
        "What the paper says that does not hold",
        [
            "Right as printed: the recursion (1)-(5), the equivalence of a limited step with weighted measurements "
            "(6)-(9), the diffusion (14), the energies after a restart; and, as it warns, that T1 is optimistic for "
            "the products of neighbouring residuals, that the decrease is missed and that the filter hardly adapts "
            "while its gain is too large.",
            "Smaller slips: (7) shifts an index; (12) holds at the true θ only, elsewhere the fluctuation of R "
            "is missing; the integral in the solution of (14) begins at s0, not at 0; ν means three things.",
        ],
        [Table("Printed or concluded, and what came out", ["the paper", "what holds", "found"], rows)],
        [],
        [minimum],
    )


def _minimum() -> Verdict:
    """Minimise the printed criterion and J* on the same grid, d = .2, T0 = 500."""
    axes = np.geomspace(5e-3, 200, 60), np.geomspace(1e-4, 400, 60)
    h, N0 = np.meshgrid(*axes, indexing="ij")
    J = np.vectorize(lambda h, N0: printed_criterion(h, N0, 0.2, 500))(h, N0)
    at = np.unravel_index(np.nanargmin(J), J.shape)
    fair = design_restart(0.2, 500)
    return Verdict(
        "the criterion J as printed has no minimum",
        f"on a grid its least value is {J[at]:.0f} at h = {h[at]:.3g}, N0 = {N0[at]:.3g}; J* has "
        f"{fair.criterion:.4f} at h = {fair.threshold:.2f}, N0 = {fair.restart:.1f}",
        "WRONG: an energy below 0, in the corner of the grid; J* > 0 at (10.0, 69.1), away from every bound",
        bool(J[at] < 0 and N0[at] == axes[1][0] and fair.criterion > 0 and not fair.at_bound),
        SOURCE,
    )
