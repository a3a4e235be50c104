"""Section 3.2, tests 5 and 6: noise-free systems, where only the arithmetic decides what is left of the answer."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

import driftwise as dw

from . import pictures, printed
from .verdict import Picture, Section, Statement, Table, Verdict, numbers, short

PAPER = "Salut 1979, section 3.2"
OURS = "this package's derivation, docs/decisions/ud.md"
STABLE = ["0.24", "-1.18", "1.9"]
UNSTABLE = ["0.24", "-1.19", "0.484"]
SEEN = {5: (5, 10, 999), 6: (5, 300, 999)}


class Method(NamedTuple):
    """One way to compute the same estimate: ``kind`` is "UD" (the engine) or a number type for the printed (20)."""

    name: str
    kind: Any
    R: float
    P0: float
    floor: float = 0.0


EXACT = Method("U D U', R = 0", "UD", 0.0, 1e2)
METHODS = [
    EXACT,
    Method("U D U', R = 1e-20", "UD", 1e-20, 1e2),
    Method("U D U', R = 1e-20, round-off floor 1e-15", "UD", 1e-20, 1e2, 1e-15),
    Method("U D U', R = 1, P0 = 1e12", "UD", 1.0, 1e12),
    Method("U D U', R = 1, P0 = 1e12, floor 1e-12", "UD", 1.0, 1e12, 1e-12),
    Method("(20) as printed, R = 0", np.float64, 0.0, 1e2),
    Method("(20) as printed, R = 1e-12", np.float64, 1e-12, 1e2),
    Method("(20) as printed, R = 1, P0 = 1e6", np.float64, 1.0, 1e6),
    Method("(20) in 24 bits, R = 1e-8, P0 = 1e2", np.float32, 1e-8, 1e2),
    Method("(20) in 24 bits, R = 1, P0 = 1e6", np.float32, 1.0, 1e6),
]


def outputs(listed, samples=1000):
    """Return y of x+ = E x + a y, x(0) = (-5, 2, 10), in exact fractions, rounded once."""
    a, x, y = [Fraction(v) for v in listed], [Fraction(-5), Fraction(2), Fraction(10)], []
    for _ in range(samples):
        y.append(float(x[-1]))
        x = [shifted + entry * x[-1] for shifted, entry in zip([Fraction(0), *x[:-1]], a)]
    return np.array(y)


def estimates(method: Method, y, brackets="K T K'"):
    """Return the estimates (T, 3) after each sample, the paper's sign, and the last covariance."""
    with np.errstate(all="ignore"):
        if method.kind == "UD":
            est = dw.Joint(3, noise=dw.models.EquationError(method.R), P0=method.P0, floor=method.floor)
            trace = est.scan(y, keep="means")
            return -trace.parameters[:, ::-1], est.covariance(trace.state)
        number = method.kind
        means, covariances, _ = printed.run(
            3,
            y.astype(number),
            number(method.R),
            np.zeros(6, number),
            np.eye(6, dtype=number) * number(method.P0),
            brackets=brackets,
        )
        return -np.array(means, float)[:, 3:], np.asarray(covariances[-1], float)


def section(seeds: int) -> Section:
    """Run tests 5 and 6 in every arithmetic of the table; nothing here is random."""
    y = {5: outputs(STABLE), 6: outputs(UNSTABLE)}
    truth = {5: np.array(STABLE, float), 6: np.array(UNSTABLE, float)}
    runs = {(test, method): estimates(method, y[test]) for test in y for method in METHODS}
    errors = {key: np.abs(a - truth[key[0]]).max(axis=1) for key, (a, _) in runs.items()}
    coarse = {
        test: np.array(
            [np.abs(estimates(METHODS[8], y[test], way)[0] - truth[test]).max(axis=1) for way in printed.BRACKETS]
        )
        for test in y
    }
    rows = [[method.name, *(short(errors[test, method][k]) for test in y for k in SEEN[test])] for method in METHODS]
    head = ["largest error of a after sample", *(f"test {test}: {k}" for test in y for k in SEEN[test])]
    return Section(
        "Tests 5 and 6: a deterministic system, and what the arithmetic does to it",
        [
            "x(0) = (−5, 2, 10), no noise. In exact arithmetic six samples determine everything: afterwards the "
            "estimate is exact and its covariance zero. What is left over is round-off, and a prior of finite width.",
            "Test 5's data are ill-conditioned (the errors of the three entries lie on one line); test 6 grows like "
            "1.064^t, so its samples carry a round-off of 1e12 at the end.",
        ],
        [Table("The same data, the same formula, different arithmetic", head, rows)],
        [
            Picture(
                "arithmetic",
                "Error of the estimate after each sample. Factors with R = 0 reach the answer after six samples and "
                "stay; the printed recursion in 24 bits amplifies its round-off, as the paper saw on its computer.",
                lambda: pictures.arithmetic(errors, METHODS, coarse),
            )
        ],
        [*_exact(runs, errors, truth), *_paper(runs, coarse[5], y, truth)],
    )


def _exact(runs, errors, truth):
    (a, P), found = runs[5, EXACT], []
    still = bool(np.all(a[5:] == a[5]))
    found.append(
        Verdict(
            "test 5, U D U', R = 0: exact after six samples, for ever",
            f"{short(errors[5, EXACT][5:].max())}, D {'= 0' if not P.any() else 'not 0'}, bit-identical to 999: "
            f"{'yes' if still else 'no'}",
            "≤ 1e-10, D exactly 0, bit-identical",
            bool(errors[5, EXACT][5:].max() <= 1e-10 and still and not P.any()),
            PAPER,
        )
    )
    worst = max(errors[6, EXACT][k] for k in (5, 999))
    found.append(
        Verdict(
            "test 6 (unstable), U D U', R = 0",
            short(worst),
            "≤ 1e-14 after samples 5 and 999",
            bool(worst <= 1e-14),
            PAPER,
        )
    )
    loses = errors[5, METHODS[5]][5] / errors[5, EXACT][5]
    found.append(
        Verdict(
            "the printed (20), R = 0, in the same float64",
            f"error {short(errors[5, METHODS[5]][5])} after sample 5: {short(loses)} times that of the factors",
            "loses three digits or more",
            bool(loses > 1e3),
            PAPER,
        )
    )
    lowest = np.linalg.eigvalsh(runs[6, METHODS[5]][1])[0]
    found.append(
        Verdict(
            "the printed (20) on test 6 loses its covariance",
            f"smallest eigenvalue of P {short(lowest)}",
            "negative, and huge",
            bool(lowest < -1.0),
            PAPER,
        )
    )
    bare, floored = errors[6, METHODS[1]][999], errors[6, METHODS[2]][999]
    found.append(
        Verdict(
            "test 6, R = 1e-20: the floor under R holds a growing signal",
            f"{short(bare)} without, {short(floored)} with it",
            "> .1 without, ≤ 1e-12 with it",
            bool(bare > 0.1 and floored <= 1e-12),
            OURS,
        )
    )
    return found


def _paper(runs, single, y, truth):
    ridge = Method("R / P0 = 9e-6", np.float64, 9e-6, 1.0)
    ten = estimates(ridge, y[5][:11])[0][10]
    coarse = runs[5, METHODS[9]][0][10]
    allowed = [method for method in METHODS if method.R / method.P0 <= 1e-4]
    at_ten = np.array([runs[6, method][0][10] for method in allowed])
    priors = np.array([estimates(Method("", np.float64, R, 1.0), y[6][:11])[0][10] for R in np.logspace(-8, 2, 61)])
    printed6 = np.array([0.225, -1.19, 0.484])
    closest = priors[np.abs(priors - printed6).max(axis=1).argmin()]
    return [
        Verdict(
            "test 5: the paper's (.19, −1.01, 1.77) after sample 10",
            f"prior of finite width (R/P0 = 9e-6): ({numbers(ten, 4)}); 24 bits, R = 1, P0 = 1e6: ({numbers(coarse)})",
            "all printed digits from a finite prior; 24-bit arithmetic comes near",
            bool(np.all(np.round(ten, 2) == [0.19, -1.01, 1.77])),
            PAPER,
        ),
        Verdict(
            "test 5: “after that time the algorithm amplifies round-off”",
            "24 bits, R = 1e-8, four ways to bracket the same (20): error "
            f"{single[:, 10].min():.2f}–{single[:, 10].max():.2f} after sample 10, later up to "
            f"{numbers(single[:, 11:].max(axis=1), 2)}",
            "the answer depends on the brackets, the worst grows at least threefold",
            bool(single[:, 11:].max() > 3 * single[:, 10].min()),
            PAPER,
        ),
        Verdict(
            "test 6: nothing gives a_0 = .225 with the other two exact",
            f"every arithmetic is within {short(np.abs(at_ten - truth[6]).max())} of .24 at sample 10; the closest "
            f"any prior comes is ({numbers(closest)})",
            "within 1e-3 of .24; no prior comes closer than .003 to the paper's three numbers",
            bool(np.abs(at_ten - truth[6]).max() < 1e-3 and np.abs(closest - printed6).max() > 0.003),
            PAPER,
            Statement(
                "section 3.2, test 6",
                "The estimate after sample 10 is (.225, −1.19, .484).",
                "a_0 is .24 in every arithmetic; no prior gives .225 with the other two exact. Probably a misprint.",
            ),
        ),
    ]
