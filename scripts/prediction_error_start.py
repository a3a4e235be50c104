"""How a recursive prediction error method should start, and what gaps cost: the tables of the decision page.

Run: python scripts/prediction_error_start.py (a minute). Everything is simulated and seeded.
"""

import sys
from pathlib import Path

import numpy as np

import driftwise as dw

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from oracle.polynomial import System

SYSTEMS = {
    "ARMAX, noise .1": (dw.ARMAX, dict(na=2, nb=2, nc=2), "armax", 0.1),
    "ARMAX, noise 1": (dw.ARMAX, dict(na=2, nb=2, nc=2), "armax", 1.0),
    "ARMAX, zeros at .89": (dw.ARMAX, dict(na=2, nb=2, nc=2), "hard", 1.0),
    "OE, noise .1": (dw.OE, dict(nb=2, nf=2), "oe", 0.1),
    "OE, noise 1": (dw.OE, dict(nb=2, nf=2), "oe", 1.0),
    "BJ, noise .1": (dw.BJ, dict(nb=2, nc=1, nd=1, nf=2), "bj", 0.1),
    "BJ, noise 1": (dw.BJ, dict(nb=2, nc=1, nd=1, nf=2), "bj", 1.0),
}
PLANTS = {
    "armax": System(a=[-1.5, 0.7], b=[[1.0, 0.5]], nk=[1], c=[-1.0, 0.2], f=[[]]),
    "hard": System(a=[-1.5, 0.7], b=[[1.0, 0.5]], nk=[1], c=[-1.6, 0.8], f=[[]]),
    "oe": System(b=[[1.0, 0.5]], nk=[1], f=[[-1.5, 0.7]]),
    "bj": System(b=[[1.0, 0.5]], nk=[1], c=[0.5], d=[-0.8], f=[[-1.2, 0.5]]),
}


def start(name, samples, method="rpem", prior=None):
    """rmse over its bound (root mean squared normalised distance), and the share of runs beyond 3 of these."""
    kind, orders, plant, std = SYSTEMS[name]
    s = PLANTS[plant]
    y, u = s.records(200, samples, std, seed=1)
    est = kind(**orders, method=method).scaled_to(y[0], u[0])
    if prior is not None:
        P = 1e4 * est._theta_units()
        P[est.model.plain : est.model.plain + est.model.kept] = prior
        est = kind(**est.options | {"P0": P})
    states, steps = est.update_batch(est.start(200), y, u)
    error, info = est.mean(states) - s.theta, s.information(y[:10], u[:10], std)
    d = np.sqrt(np.einsum("si,ij,sj->s", error, info, error) / len(s.theta))
    late = slice(samples // 2, None)
    nis = np.mean(steps.innovation[:, late] ** 2 / steps.variance[:, late])
    return f"{np.sqrt(np.mean(d**2)):.2f} ({100 * np.mean(d > 3):.0f} %) {nis:.2f}"


def gaps(name, lost):
    """NIS of all samples and of those right after a gap, and the median squared error of theta over its bar."""
    kind, orders, plant, std = SYSTEMS[name]
    s = PLANTS[plant]
    y, u = s.records(100, 2000, std, seed=7)
    rng = np.random.default_rng(3)
    gap, hole = rng.random(y.shape) < lost[0], rng.random(u.shape) < lost[1]
    est = kind(**orders).scaled_to(y[0], u[0])
    states, steps = est.update_batch(est.start(100), np.where(gap, np.nan, y), np.where(hole, np.nan, u))
    z2 = (steps.innovation**2 / steps.variance)[:, 1000:]
    after = (np.roll(gap, 1, axis=1) & ~gap)[:, 1000:]
    P = np.array([est.sigma2(x) * np.diag(est._theta_covariance(x)) for x in states])
    chi2 = np.median((est.mean(states) - s.theta) ** 2 / P) / 0.4549
    first = f"{np.mean(z2[after]):.2f}" if lost[0] else "-"
    return f"{np.nanmean(z2):.2f} {first} {100 * np.mean(z2[np.isfinite(z2)] < 3.84):.1f} % {chi2:.1f}"


def main():
    print("rmse over the Cramer-Rao bound (runs beyond 3) NIS; 200 runs")
    print("| system | all 1e4 | c, d, f 1 | the default | default, 300 | default, 4000 | plr, 1000 |")
    for name in SYSTEMS:
        cells = [start(name, 1000, prior=p) for p in (1e4, 1.0, None)]
        cells += [start(name, 300), start(name, 4000), start(name, 1000, "plr")]
        print("|", name, "|", " | ".join(cells), "|", flush=True)
    print("gaps: NIS, NIS right after, inside 95 %, median squared error over bar; 100 runs of 2000")
    print("| system | 10 % of y | 30 % of y | 10 % of u |")
    for name in SYSTEMS:
        print("|", name, "|", " | ".join(gaps(name, lost) for lost in ((0.1, 0), (0.3, 0), (0, 0.1))), "|", flush=True)


if __name__ == "__main__":
    main()
