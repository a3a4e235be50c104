"""What a recursive estimator makes of missing outputs: parameters, error bars, bands. Prints the tables of the docs.

python scripts/gaps.py [--runs 100]
"""

import argparse

import numpy as np

import driftwise as dw

PLANTS = {
    "poles .8, .5": np.poly([0.8, 0.5])[1:],
    "poles .95, .9": np.poly([0.95, 0.9])[1:],
    "poles .9 +- .3i": np.poly([0.9 + 0.3j, 0.9 - 0.3j])[1:].real,
}
B, NOISE, T = np.array([1.0, 0.5]), 0.5, 1000
PATTERNS = {"10 % lost": 0.1, "30 % lost": 0.3, "20 of each 60 lost": None}


def record(a, seed: int):
    """Input, output and which outputs are kept by each pattern."""
    rng = np.random.default_rng(seed)
    u, e, y = np.sign(rng.standard_normal(T)), NOISE * rng.standard_normal(T), np.zeros(T)
    for t in range(2, T):
        y[t] = -a @ y[t - 2 : t][::-1] + B @ u[t - 2 : t][::-1] + e[t]
    cut = np.arange(T) % 60 >= 40
    return u, y, {name: cut if share is None else rng.random(T) < share for name, share in PATTERNS.items()}


def judged(a, pattern: str, missing: str, runs: int):
    """RMSE of theta, NEES over its 4 entries, share inside the 95 % band within gaps and after them, states lost."""
    truth, errors, nees, inside, after, lost = np.append(a, B), [], [], [], [], 0
    for seed in range(runs):
        u, y, cuts = record(a, seed)
        is_lost = cuts[pattern]
        est = dw.ARX(2, 2, missing=missing).scaled_to(y, u)
        trace = est.scan(np.where(is_lost, np.nan, y), u)
        error = trace.parameters[-1] - truth
        errors.append(error @ error / 4)
        P = est.sigma2(trace.state) * est.covariance(trace.state)
        nees.append(error @ np.linalg.solve(P, error) / 4)
        held = np.abs(y - trace.prediction) < 1.96 * np.sqrt(trace.variance)
        inside.append(held[200:][is_lost[200:]].mean())
        first = ~is_lost[200:] & (is_lost[199:-1] | is_lost[198:-2])
        after.append(held[200:][first].mean())
        lost += np.count_nonzero(trace.status & dw.Status.LOST)
    return np.sqrt(np.mean(errors)), np.mean(nees), np.mean(inside), np.mean(after), lost


def independent(a, samples: int = 20) -> float:
    """By what the deviation would be too long so many samples into a gap, were errors of lags independent."""
    true = np.zeros((2, 2))
    wrong, F = np.zeros(2), np.array([-a, [1.0, 0.0]])
    for _ in range(samples):
        true = F @ true @ F.T + np.diag([1.0, 0.0])
        wrong = np.array([a**2 @ wrong + 1.0, wrong[0]])
    return float(np.sqrt(wrong[0] / true[0, 0]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=100)
    runs = parser.parse_args().runs
    print("| plant | outputs | missing= | RMSE | NEES | in the band within gaps | just after | lost |")
    print("|---|---|---|---|---|---|---|---|")
    for plant, a in PLANTS.items():
        for pattern in PATTERNS:
            for missing in ("predict", "skip", "hold"):
                rmse, nees, inside, after, lost = judged(a, pattern, missing, runs)
                print(
                    f"| {plant} | {pattern} | {missing} | {rmse:.4f} | {nees:.2f} | {100 * inside:.1f} % | "
                    f"{100 * after:.1f} % | {lost} |"
                )
    print("\n| plant | deviation 20 samples into a gap, were lags independent |\n|---|---|")
    for plant, a in PLANTS.items():
        print(f"| {plant} | {independent(a):.3g} times too long |")


if __name__ == "__main__":
    main()
