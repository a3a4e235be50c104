"""Does `identify` find the right structure? Random models of each family, by seed: the table of docs/identify.md.

    python scripts/identify_families.py [draws [first seed [longest delay [loops]]]]

A draw is a plant of order 1 to 3, its input (random binary or coloured), a signal-to-noise ratio of 1 to 100 and 500 to
5000 samples. "as good": the right structure, or one whose error on 3000 samples to come is at most 2 % above that of
the right structure estimated from the same record. "error": mean square over the variance of the noise, there. An
ARMAX(n,n,n,1) is right as Joint(n), too. With a longest delay the input acts up to so many samples later, and y has a
level of its own. With loops (1), a controller steers every other input by the output (a share of .3 to 1 of the inverse
gain, beside the excitation), and it is counted how often `validate` names the feedback, and how often where none is.
"""

from __future__ import annotations

import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter

from driftwise.analysis.candidates import Candidate
from driftwise.analysis.forecast_summary import ForecastSummary
from driftwise.analysis.forecast_verdicts import LEVEL
from driftwise.analysis.identifier import Identifier
from driftwise.analysis.residual_tests import echoed, feedback
from driftwise.analysis.validation_verdicts import SURE

FAMILIES = ("AR", "ARX", "ARMAX", "OE")
TO_COME, SETTLE = 3000, 100
LOW, HIGH = 0.92, 0.97  # what 95 % bands may hold


class Draw(NamedTuple):
    """A record of T samples and what follows, and what it comes from."""

    y: np.ndarray
    u: np.ndarray | None
    samples: int
    noise_std: float
    true: Candidate
    fed_back: float = 0.0  # share of the input's variance that comes of the noise, by a controller
    noise: np.ndarray | None = None  # of y, beside its level and what the input does
    rho: float = 0.0  # of the excitation, from sample to sample


class Outcome(NamedTuple):
    """What came of a draw: errors are mean squares over the noise variance."""

    family: str
    true: str
    true_too: str  # the same by another filter: Joint(n) is an ARMAX(n,n,n,1)
    chosen: str
    samples: int
    loss: float
    true_loss: float
    coverage: float
    fed_back: float = 0.0
    is_named: bool = False  # whether feedback into the input is

    @property
    def is_right(self) -> bool:
        return self.chosen in (self.true, self.true_too)

    @property
    def is_as_good(self) -> bool:
        return self.is_right or self.loss <= 1.02 * self.true_loss


def polynomial(rng, n: int, largest: float) -> np.ndarray:
    """Return a monic polynomial whose roots lie within a circle."""
    roots: list[complex] = []
    while len(roots) < n:
        if n - len(roots) >= 2 and rng.random() < 0.5:
            size, angle = rng.uniform(0.5, largest), rng.uniform(0.1, 3.0)
            roots += [size * np.exp(1j * angle), size * np.exp(-1j * angle)]
        else:
            roots.append(rng.uniform(-largest, largest))
    return np.real(np.poly(roots))


def loop(A, B, gain: float, reference, v, most: float = np.inf) -> tuple[np.ndarray, np.ndarray] | None:
    """Return inputs and the response to them, steered by y = response + v; None where it grows beyond ``most``."""
    u, x = reference.copy(), np.zeros(len(v))
    for t in range(1, len(v)):
        u[t] -= gain * (x[t - 1] + v[t - 1])
        past = slice(max(t - len(B) + 1, 0), t + 1)
        x[t] = B[: t + 1] @ u[past][::-1] - A[1 : t + 1] @ x[max(t - len(A) + 1, 0) : t][::-1]
        if not abs(x[t]) < most:
            return None
    return u, x


def closed(A, B, reference, v, rng) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the same with the share of the input's variance that comes of the noise: what can be seen of a loop.

    One that grows gets half the gain.
    """
    gain = rng.uniform(0.3, 1.0) * A.sum() / B.sum()
    most = 50 * (np.abs(lfilter(B, A, reference)).max() + np.abs(v).max())
    while (found := loop(A, B, gain, reference, v, most)) is None:
        gain /= 2
    heard = loop(A, B, gain, 0 * reference, v)
    return *found, float(np.var(heard[0]) / np.var(found[0]))


def draw(family: str, rng, longest: int = 0, is_closed: bool = False) -> Draw:
    """Return a random plant of a family, and its record."""
    n, samples = int(rng.integers(1, 4)), int(np.exp(rng.uniform(np.log(500), np.log(5000))))
    size = samples + TO_COME
    A, C = polynomial(rng, n, 0.95), polynomial(rng, n, 0.9)
    nk = int(rng.integers(1, 3)) if family == "ARX" else 1
    nk = int(rng.integers(1, longest + 1)) if longest else nk
    B = np.concatenate([np.zeros(nk), rng.standard_normal(n)])
    binary, rho = rng.choice([-1.0, 1.0], size), float(rng.uniform(0, 0.9))
    coloured = lfilter([1], [1, -rho], rng.standard_normal(size))
    u, rho = (binary, 0.0) if rng.random() < 0.5 else (coloured, rho)
    e = rng.standard_normal(size)
    noise = {"AR": ([1], A), "ARX": ([1], A), "OE": ([1], [1])}.get(family, (C, A))
    x, v = lfilter(B, A, u), lfilter(*noise, e)
    std = 1.0 if family == "AR" else float(x.std() / v.std() / np.sqrt(10 ** rng.uniform(0, 2)))
    orders: dict[str, Any] = {
        "AR": dict(na=n), "ARX": dict(na=n, nb=(n,), nk=(nk,)), "ARMAX": dict(na=n, nb=(n,), nc=n, nk=(nk,)),
        "OE": dict(nb=(n,), nf=(n,), nk=(nk,)),
    }[family]  # fmt: skip
    is_closed &= family != "AR"
    u, x, fed_back = closed(A, B, u, std * v, rng) if is_closed else (u, x, 0.0)
    y = v if family == "AR" else x + std * v
    y = y + rng.uniform(-20, 20) * y.std() if longest else y
    true = Candidate(family, orders, int(family != "AR"), 1.0)
    return Draw(y, None if family == "AR" else u, samples, std, true, fed_back, std * v, rho)


def names_feedback(d: Draw) -> bool:
    """Say whether `validate` names the feedback into the input of a draw."""
    y, u = d.y[: d.samples], d.u[: d.samples]
    (back,) = feedback(y, u[:, None], LEVEL, [True])
    return bool(back.largest > back.limit or echoed(y, u) > SURE)


def outcome(seed: int, longest: int = 0, loops: int = 0) -> Outcome:
    """Return what `identify` makes of the draw of a seed."""
    family = FAMILIES[seed % len(FAMILIES)]
    d = draw(family, np.random.default_rng(seed), longest, bool(loops) and seed // len(FAMILIES) % 2 == 1)
    T = d.samples

    def part(a, b=None):
        return d.y[a:b], None if d.u is None else d.u[a:b]

    level = d.y[:T].mean() if longest else 0.0

    def about(a, b=None):
        y, u = part(a, b)
        return y - level, u

    def loss(candidate: Candidate) -> float:
        est = candidate.estimator().scaled_to(*about(0, T))
        state = est.scan(*about(0, T), keep="innovations").state
        e = est.scan(*about(T), state=state, keep="innovations").innovation
        return float(np.mean(e**2) / d.noise_std**2)

    identifier = Identifier(0 if d.u is None else 1)
    forecast = ForecastSummary(SETTLE).add(identifier.add(*part(0, T)))
    chosen = identifier.chosen.candidate
    too = f"Joint({d.true.orders['nc']})" if family == "ARMAX" else d.true.name
    is_named = False
    if loops and d.u is not None:
        is_named = names_feedback(d)
    return Outcome(
        family, d.true.name, too, chosen.name, T, loss(chosen), loss(d.true), forecast.coverage, d.fed_back, is_named
    )  # fmt: skip


def row(name: str, some: list[Outcome]) -> str:
    """Return a row of the table."""
    good = np.mean([o.is_as_good for o in some])
    held = [o.coverage for o in some]
    cells = [
        f"{len(some)}",
        f"{np.mean([o.is_right for o in some]):.2f}",
        f"{good:.3f}",
        f"{np.mean([o.loss for o in some]):.3f}",
        f"{np.mean([o.true_loss for o in some]):.3f}",
        f"{100 * np.mean(held):.1f}",
        f"{np.mean([LOW <= h <= HIGH for h in held]):.2f}",
    ]
    return f"| {name} | {' | '.join(cells)} |"


def named(found: list[Outcome]) -> None:
    """Print how often feedback is named: where there is much of it, or a little, and where there is none."""
    driven = [o for o in found if o.family != "AR"]
    for what, low, high in (("no feedback", 0.0, 0.0), ("1 % of the input or less", 1e-12, 0.01), ("more", 0.01, 2.0)):
        some = [o for o in driven if low <= o.fed_back <= high]
        print(f"feedback, {what}: named in {sum(o.is_named for o in some)} of {len(some)} draws")


def main(draws: int = 500, first: int = 0, longest: int = 0, loops: int = 0) -> None:
    with ProcessPoolExecutor(2) as pool:
        found = list(pool.map(outcome, range(first, first + draws), [longest] * draws, [loops] * draws, chunksize=5))
    print("| family | draws | right | as good | error | of the right one | in 95 % band, % | within 92-97 % |")
    print("|---|---|---|---|---|---|---|---|")
    for family in FAMILIES:
        print(row(family, [o for o in found if o.family == family]))
    for name, a, b in (("T < 1000", 0, 1000), ("1000-2500", 1000, 2501), ("T > 2500", 2501, 10**9)):
        print(row(name, [o for o in found if a <= o.samples < b]))
    if loops:
        print(row("closed loop", [o for o in found if o.fed_back]))
    print(row("all", found))
    if loops:
        named(found)
    kinds = Counter(o.chosen.split("(")[0] for o in found)
    print("chosen:", ", ".join(f"{kind} {count}" for kind, count in kinds.most_common()))
    for o in found:
        if not o.is_as_good:
            print(f"missed: {o.true} taken for {o.chosen}, {o.samples} samples, {o.loss:.3f} against {o.true_loss:.3f}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
