"""Print the tables of docs/motor.md and draw its figure: velocity, acceleration and load of a real motor, on-line.

Run: python scripts/motor.py (two minutes; DRIFTWISE_DATA names the folder of recordings).

The record: EMPS, a carriage on a ball screw, 24.8 s at 1 kHz (Janot, Gautier, Brunot, 2019).
"""

import time
from pathlib import Path
from typing import Any

import numpy as np
from driftwise_studies.score import records
from driftwise_studies.score.tasks import carriage
from driftwise_studies.score.tasks.carriage import (
    DT,
    FV,
    GAIN,
    LEARN,
    ROUNDED,
    M,
    Truth,
    beginnings,
    chain,
    encoder,
    observer,
    read_chain,
    read_out,
    reference,
    score,
    settle,
)

ROOT = Path(__file__).parent.parent
FIGURE = ROOT / "docs" / "figures" / "motor.png"


def read():
    """Return voltage and position of the record, or None where it is not there."""
    where = records.folder()
    return carriage.read(where) if (where / carriage.FILE).exists() else None


def kalman(y, u, walk, noise_std, P0):
    """Return the same from a plain Kalman filter: twenty lines, and the same tuning."""
    system = observer(noise_std, walk=walk).plant
    (F, G, _), Q, H = system.discretise(DT), system.noise(DT), system.H[0]
    z, P, found = np.zeros(3), np.array(P0, float), np.empty((len(y), 3))
    for t in range(len(y)):
        if t:
            z = F @ z + G[:, 0] * u[t - 1]
            P = F @ P @ F.T + Q
        K = P @ H / (H @ P @ H + noise_std**2)
        z = z + K * (y[t] - H @ z)
        P = P - np.outer(K, H @ P)
        P = (P + P.T) / 2
        found[t] = z
    v, load = found[:, 1], found[:, 2]
    return Truth(v, (GAIN * u - FV * v - load) / M, load)


DIFFUSE = np.diag([1.0, 1e2, 1e8])  # m^2, (m/s)^2, N^2: large, and still small enough for a plain filter


def tuned(y, u, noise_std, learn=LEARN):
    """Return the observers that the first part of the record tunes: a walk, a walk and the noise, a window."""
    growing = observer(noise_std)
    return {
        "walk": growing.tune(y[:learn], u[:learn]),
        "walk and noise": growing.tune(y[:learn], u[:learn], noise=True),
        "window": observer(None, 0.03).tune(y[:learn], u[:learn]),
    }


# --- the tables --------------------------------------------------------------------------------------------


def compare(u, position, truth, step, found):
    """Print the errors of everyone at one resolution."""
    y, noise_std = encoder(position, step)
    walk = float(found["walk"].tuned.walk[0])
    rows: list[tuple[str, Truth]] = []
    for degree in (2, 3):
        best = chain(None, degree, 0.03).tune(y[:LEARN])
        rows.append(
            (f"polynomial window, degree {degree}, length tuned: {1e3 * best.window:.0f} ms", read_chain(best.scan(y)))
        )
    fixed = read_chain(chain(noise_std, 3, 0.011).scan(y))
    rows.insert(0, ("polynomial window, degree 3, 11 ms", fixed))
    window = found["window"]
    rows.append(
        (f"motor window, constant load, length tuned: {1e3 * window.window:.0f} ms", read_out(window.scan(y, u)))
    )
    for name in ("walk", "walk and noise"):
        est = found[name]
        told = f"{est.tuned.walk[0]:.3g} N/sqrt(s)" + (
            f", noise {1e6 * est.noise_std[0]:.3g} um" if " " in name else ""
        )
        rows.append((f"growing window, {name} tuned: {told}", read_out(est.scan(y, u))))
    rows.append(("plain Kalman filter, the same walk, wide P0", kalman(y, u, walk, noise_std, DIFFUSE)))
    rows.append(("plain Kalman filter, walk ten times larger", kalman(y, u, 10 * walk, noise_std, DIFFUSE)))
    print(f"\n{'as recorded' if not step else f'rounded to {1e6 * step:.0f} um'}")
    print("| observer | v mm/s | a m/s2 | load N | after 10 s: v | a | load |")
    print("|---|---|---|---|---|---|---|")
    for name, one in rows:
        numbers = [*score(one, truth), *score(one, truth, LEARN)]
        cells = [
            "-" if np.isnan(x) else f"{x:{form}}" for x, form in zip(numbers, (".3f", ".4f", ".2f") * 2, strict=True)
        ]
        print(f"| {name} | {' | '.join(cells)} |")


def how_much_record(u, position, truth):
    """Print how the tuning depends on the part of the record that it sees."""
    y, noise_std = encoder(position, ROUNDED)
    print("\n| tuned on the first | walk N/sqrt(s) | v mm/s | a m/s2 | load N | window ms | v | a | load |")
    print("|---|---|---|---|---|---|---|---|---|")
    for learn in (2500, 5000, LEARN, len(y)):
        walk = observer(noise_std).tune(y[:learn], u[:learn])
        window = observer(None, 0.03).tune(y[:learn], u[:learn])
        v, a, load = score(read_out(walk.scan(y, u)), truth)
        v2, a2, load2 = score(read_out(window.scan(y, u)), truth)
        print(
            f"| {learn * DT:.1f} s | {walk.tuned.walk[0]:.1f} | {v:.3f} | {a:.4f} | {load:.2f} "
            f"| {1e3 * window.window:.0f} | {v2:.3f} | {a2:.4f} | {load2:.2f} |"
        )


def start_up(u, position, truth, step, found, starts=100):
    """Return {name: milliseconds, (starts,)} from a cold start in mid-motion until the velocity is right to 2 mm/s."""
    y, noise_std = encoder(position, step)
    walk = float(found["walk"].tuned.walk[0])
    times: dict[str, list[float]] = {}
    for k in beginnings(truth, starts):
        part, volts, v = y[k : k + 400], u[k : k + 400], truth.velocity[k : k + 400]
        seen = {
            "growing window, walk tuned, no P0": found["walk"].scan(part, volts).of("velocity")[0],
            f"motor window, {1e3 * found['window'].window:.0f} ms": found["window"].scan(part, volts).of("velocity")[0],
            "plain Kalman filter, wide P0": kalman(part, volts, walk, noise_std, DIFFUSE).velocity,
            "plain Kalman filter, P0 = 1 as in most libraries": kalman(
                part, volts, walk, noise_std, np.eye(3)
            ).velocity,
        }
        for name, velocity in seen.items():
            times.setdefault(name, []).append(1e3 * DT * settle(np.where(np.isnan(velocity), np.inf, velocity) - v))
    return {name: np.array(values) for name, values in times.items()}


def bars(u, position, truth, step, found):
    """Print what the innovations and the bars of the tuned observers are worth."""
    y, _ = encoder(position, step)
    for name, est in found.items():
        trace = est.scan(y, u)
        e, T = trace.innovation[LEARN:], trace.variance[LEARN:]
        holds = [
            np.mean((np.abs(trace.of(n)[0] - t) < 1.96 * trace.of(n)[1])[LEARN:-500])
            for n, t in zip(("velocity", "acceleration", "load"), truth, strict=True)
        ]
        print(
            f"{name}: NIS {np.mean(e**2 / T):.2f}; 95 % bars hold for velocity {holds[0]:.2f}, "
            f"acceleration {holds[1]:.2f}, load {holds[2]:.2f}"
        )


def speed(u, position, found):
    """Print microseconds a sample."""
    y, noise_std = encoder(position, ROUNDED)
    print()
    for name, run in (
        ("growing window", lambda: found["walk"].scan(y, u)),
        ("motor window", lambda: found["window"].scan(y, u)),
        ("plain Kalman filter", lambda: kalman(y, u, 20.0, noise_std, DIFFUSE)),
    ):
        run()
        began = time.process_time()
        run()
        print(f"{name}: {1e6 * (time.process_time() - began) / len(y):.1f} us a sample")


def draw(u, position, truth, found):
    """Draw velocity error and load around some reversals, and a cold start."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    y, noise_std = encoder(position, ROUNDED)
    t, part = np.arange(len(y)) * DT, slice(14_000, 20_000)
    trace = found["walk"].scan(y, u)
    difference = np.r_[np.full(10, np.nan), (y[10:] - y[:-10]) / (10 * DT)]
    figure, axes = plt.subplots(3, 1, figsize=(9, 8.2), layout="constrained")
    axes[0].plot(
        t[part], 1e3 * (difference - truth.velocity)[part], color="0.75", lw=0.6, label="difference over 10 ms"
    )
    axes[0].plot(t[part], 1e3 * (trace.of("velocity")[0] - truth.velocity)[part], color="C0", lw=0.8, label="observer")
    axes[0].set(ylabel="velocity error, mm/s", ylim=(-8, 8), xlabel="s")
    load, std = trace.of("load")
    axes[1].fill_between(t[part], (load - 1.96 * std)[part], (load + 1.96 * std)[part], color="C0", alpha=0.25, lw=0)
    axes[1].plot(t[part], load[part], color="C0", lw=0.9, label="observer, 95 %")
    axes[1].plot(t[part], truth.load[part], color="black", lw=0.9, ls="--", label="in hindsight")
    axes[1].set(ylabel="load, N", xlabel="s")
    begin = 12_000 + int(np.argmax(np.abs(truth.velocity[12_000:16_000])))
    ahead = slice(begin, begin + 80)
    ms = np.arange(80)
    walk = float(found["walk"].tuned.walk[0])
    cold = found["walk"].scan(y[ahead], u[ahead])
    default = kalman(y[ahead], u[ahead], walk, noise_std, np.eye(3)).velocity
    v, std = cold.of("velocity")
    axes[2].fill_between(ms, 1e3 * (v - 1.96 * std), 1e3 * (v + 1.96 * std), color="C0", alpha=0.25, lw=0)
    axes[2].plot(ms, 1e3 * v, color="C0", label="observer, started in mid-motion")
    axes[2].plot(ms, 1e3 * default, color="C1", lw=0.9, label="plain Kalman filter, P0 = 1")
    axes[2].plot(ms, 1e3 * truth.velocity[ahead], color="black", lw=0.9, ls="--", label="in hindsight")
    middle = 1e3 * truth.velocity[begin]
    axes[2].set(ylabel="velocity, mm/s", xlabel="ms after the start", ylim=(middle - 30, middle + 30))
    for ax in axes:
        ax.legend(frameon=False, ncols=3, fontsize=9, loc="lower right", bbox_to_anchor=(1, 0.97))
        ax.spines[["top", "right"]].set_visible(False)
    FIGURE.parent.mkdir(exist_ok=True)
    figure.savefig(FIGURE, dpi=110)


def main():
    record = read()
    if record is None:
        raise SystemExit("emps_train.csv is not there: set DRIFTWISE_DATA to the folder of recordings")
    u, position = record
    truth = reference(u, position)
    size = [np.sqrt(np.mean(x**2)) for x in truth]
    print(f"reference, rms: v {1e3 * size[0]:.1f} mm/s, a {size[1]:.3f} m/s2, load {size[2]:.1f} N")
    for step in (0.0, ROUNDED):
        y, noise_std = encoder(position, step)
        found: dict[str, Any] = tuned(y, u, noise_std)
        compare(u, position, truth, step, found)
        for est in found.values():
            print(est.tuned.words)
        bars(u, position, truth, step, found)
        print("\n| cold start in mid-motion, 100 times | median ms | 95 % | never |")
        print("|---|---|---|---|")
        for name, ms in start_up(u, position, truth, step, found).items():
            ranks = np.sort(ms)
            print(f"| {name} | {ranks[49]:.0f} | {ranks[94]:.0f} | {np.isinf(ms).sum()} |")
    how_much_record(u, position, truth)
    speed(u, position, found)
    draw(u, position, truth, found)


if __name__ == "__main__":
    main()
