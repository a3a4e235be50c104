"""What a wrong prior on the disturbance costs: nothing, the state, or the truth of its deviation."""

from __future__ import annotations

import numpy as np

from ..verdict import Scaled, Section, Table, Verdict
from .comparison import near
from .listed import THIS
from .motor import K1, RATE, SIGMA, J, Scenario, constant, cosine, motor, records
from .watchers import Sliding, window

SIZES = (1.0, 50.0, 500.0)  # q2
PRIORS = (0.0, 2.0, 50.0, 500.0, np.inf)
LISTED = {  # x3 RMSE (A) at q2 = 1, 50, 500, and the deviation claimed
    0.0: "0.090 3.47 34.7 0.058",
    2.0: "0.090 3.46 34.6 0.20",
    50.0: "2.37 2.94 17.3 3.45",
    500.0: "4.65 4.65 4.67 4.83",
    np.inf: "4.70 4.70 4.70 4.85",
}
SECONDS = 1.0
SINCE = 2 * RATE


def section(seeds: int) -> Section:
    """The table of T = 1 s, and its three consequences."""
    scaled = Scaled(seeds, 200)
    found, errors = table(scaled.records(100, 20))
    rows = [["∞ (the paper)" if np.isinf(p) else f"{p:g}", *(f"{v:.3g}" for v in found[p])] for p in PRIORS]
    head = ["prior deviation of the cosine", *(f"x3 RMSE, true q2 = {q:g}" for q in SIZES), "claimed deviation"]
    return Section(
        "A prior on the disturbance",
        [
            "A window asks for a prior deviation of each disturbance: infinite removes it whatever its size (the "
            "paper), 0 ignores it. There is no default, for a prior that is too tight makes the published deviation "
            "wrong, silently. Errors are those of the noise alone and of each disturbance alone, added: the window is "
            "linear."
        ],
        [Table(f"Window of 1 s, current in A, {scaled.records(100, 20)} records, from 2 s on", head, rows)],
        verdicts=[_listed(found, errors), _nothing(found), _same(found), _lies(found), _break_even()],
    )


def table(seeds: int):
    """Return x3 RMSE at each size, with the claimed deviation (4,), and standard errors (4,), for each prior."""
    kinds = {size: records(Scenario(q2=size), range(1)) for size in SIZES}
    r = records(seeds=seeds)
    pure = r.y - r.x[:, 0]
    found, errors = {}, {}
    for prior in PRIORS:
        est = window(SECONDS, constant(), cosine(prior_std=prior))
        run = Sliding(est)
        noise = run(pure, 0 * r.u)[:, SINCE:, 2]
        values, wide = [], []
        for one in kinds.values():
            bias = run(one.x[None, :, 0], one.u)[0, SINCE:, 2] - one.x[SINCE:, 2]
            each = np.mean((noise + bias) ** 2, axis=1)
            rmse = np.sqrt(each.mean())
            values.append(rmse)
            wide.append(each.std() / np.sqrt(seeds) / (2 * rmse))
        found[prior] = np.array([*values, est.design.std[2]])
        errors[prior] = np.array([*wide, 0.0])
    return found, errors


def _listed(found, errors):
    fits = [fit for p in PRIORS for fit in near(found[p], errors[p], LISTED[p])]
    return Verdict(
        "the table of priors",
        f"{sum(fits)} of {len(fits)} as listed",
        f"{len(fits)} of {len(fits)} to a unit of the last digit and four standard errors",
        all(fits),
        THIS,
    )


def _nothing(found):
    zero, two = found[0.0][0], found[2.0][0]
    return Verdict(
        "the paper's cosine: a soft prior buys nothing over leaving it out",
        f"x3 RMSE {two:.4f} A with prior 2, {zero:.4f} A left out",
        "equal within 5 %",
        bool(abs(two / zero - 1) < 0.05),
        THIS,
    )


def _same(found):
    spread = {p: found[p][:3].max() / found[p][:3].min() for p in PRIORS}
    return Verdict(
        "only without a prior does the error not depend on the disturbance's size",
        f"largest over smallest error: {spread[np.inf]:.4f} without a prior, "
        + ", ".join(f"{spread[p]:.3g} with {p:g}" for p in PRIORS[1:-1]),
        "below 1.001 without a prior, above 5 with 2 and 50: right for a disturbance that is large or of unknown size",
        bool(spread[np.inf] < 1.001 and spread[2.0] > 5 and spread[50.0] > 5),
        THIS,
    )


def _lies(found):
    over = found[2.0][1:3] / found[2.0][3]
    return Verdict(
        "a prior 25 or 250 times too tight: actual error over claimed deviation",
        f"{over[0]:.0f} and {over[1]:.0f} times",
        "17 and 170 times (within a tenth)",
        bool(np.all(np.abs(over / [17.3, 173] - 1) < 0.1)),
        THIS,
    )


def _break_even():
    """From what window length on removing the cosine pays, and when a test sees it."""
    coefficients = np.poly(np.linalg.eigvals(motor().plant.A))
    size = {q: q / abs(np.polyval(coefficients, 50j)) for q in SIZES}  # in y, rad
    even = 2 / RATE * SIGMA**2 / size[1.0] ** 2
    seen = {q: RATE * SECONDS * a**2 / (2 * SIGMA**2) for q, a in size.items()}
    at_most = J / K1 * 50.0**2 * size[1.0]
    return Verdict(
        "when removing the cosine pays, and when it can be seen",
        f"windows from {even:.0f} s on (left out it costs {at_most:.3f} A at most); noncentrality of the test for the "
        f"line in 1 s: {seen[50.0]:.1f} at q2 = 50, {seen[500.0]:.0f} at 500",
        "2434 s, .098 A; 1.0 (invisible), 103 (certain); with |A(iw)| taken as w^3 2340 s, 1.1 and 107",
        bool(abs(even / 2434 - 1) < 0.01 and all(near([seen[50.0], seen[500.0]], np.zeros(2), "1.0 103"))),
        THIS,
    )
