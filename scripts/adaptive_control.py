"""Print the tables of docs/control.md and draw its figure: a plant jumps in the loop, a fixed controller and others.

python scripts/adaptive_control.py [RUNS] [FIGURE.png]
"""

import sys

import control
import numpy as np

import driftwise as dw
from driftwise.adapters.control import create_adaptive_controller
from driftwise.adapters.regulator import Lagged, cautious_gain

BEFORE = np.array([-1.6, 0.63, 0.1, 0.08])  # a1, a2, b1, b2: poles .9 and .7
JUMPS = {
    "gain times 6": BEFORE * [1, 1, 6, 6],
    "pole .9 to 1.2": np.array([-1.9, 0.84, 0.1, 0.08]),
    "actuator reversed": BEFORE * [1, 1, -1, -1],
}
SAMPLES, AT, NOISE, DITHER, LIMITS = 1000, 500, 0.05, 0.1, (-10.0, 10.0)
WINDOWS = {
    "first 100": (0, 100),
    "before": (200, 500),
    "50 after": (500, 550),
    "next 50": (550, 600),
    "then": (600, 1000),
}
EXACT = np.zeros((4, 4))


def plant(after, before=BEFORE):
    """Return y(t) = -a1 y(t-1) - a2 y(t-2) + b1 u(t-1) + b2 u(t-2) + e(t), whose parameters jump."""

    def step(t, x, inputs, params):
        a1, a2, b1, b2 = after if t + 1 >= AT else before
        u, e = inputs
        return np.array([-a1 * x[0] - a2 * x[1] + b1 * u + b2 * x[2] + e, x[0], u])

    return control.nlsys(
        step, lambda t, x, u, params: x[:1], inputs=["u", "e"], outputs=["y"], states=3, dt=1, name="plant"
    )


def tuner(memory=None, **options):
    """Return a self-tuning controller of the plant's structure."""
    est = dw.ARX(2, 2, memory=dw.AutoMemory() if memory is None else memory)
    return create_adaptive_controller(est, limits=LIMITS, name="controller", **options)


def fixed(theta):
    """Return the regulator of known parameters."""
    return tuner(dw.Constant(), every=0, gain=cautious_gain(Lagged(2, 2, 1), theta, EXACT))


WAYS = {
    "fixed: knows the plant before": lambda: fixed(BEFORE),
    "adaptive: `AutoMemory()`": tuner,
    "adaptive: `AutoMemory()`, caution=0": lambda: tuner(caution=0.0),
    "adaptive: `AutoMemory()`, caution=1": lambda: tuner(caution=1.0),
    "adaptive: `ExponentialForgetting(0.98)`": lambda: tuner(dw.ExponentialForgetting(0.98)),
    "adaptive: `Constant()`": lambda: tuner(dw.Constant()),
}


def simulate(controller, system, seed, later=DITHER, is_moving=True, noise=NOISE):
    """Return r, y, u and the estimate of b1 in closed loop, with a dither that is ``later`` after 50 samples."""
    rng, t = np.random.default_rng(seed), np.arange(SAMPLES)
    r = np.where(t // 50 % 2, 1.0, -1.0) if is_moving else np.ones(SAMPLES)
    e, v = noise * rng.standard_normal(SAMPLES), np.where(t < 50, DITHER, later) * rng.choice([-1.0, 1.0], SAMPLES)
    loop = control.interconnect(
        [system, controller], inputs=["r", "e", "v"], outputs=["y", "u", "b1"], check_unused=False
    )
    return r, *control.input_output_response(loop, t, [r, e, v]).outputs


def errors(r, y):
    """Return the root mean square of r - y in each window."""
    return [np.sqrt(np.mean((r - y)[a:b] ** 2)) for a, b in WINDOWS.values()]


def line(*cells, found):
    """Print one line of a table: median and worst run of each window."""
    pairs = [f"{m:.2f} ({w:.2f})" for m, w in zip(np.median(found, axis=0), np.max(found, axis=0))]
    print(f"| {' | '.join([*cells, *pairs])} |", flush=True)


def head(*cells):
    """Print the head of a table."""
    print(f"\n| {' | '.join(cells)} | {' | '.join(WINDOWS)} |\n" + "|---" * (len(cells) + len(WINDOWS)) + "|")


def tables(runs):
    """Print the tables."""
    for jump, after in JUMPS.items():
        head(jump)
        for name, controller in WAYS.items():
            line(name, found=[errors(*simulate(controller(), plant(after), seed)[:2]) for seed in range(runs)])
        known = [errors(*simulate(fixed(after), plant(after, after), seed)[:2]) for seed in range(runs)]
        line("fixed: knows the plant after, all along", found=known)

    head("noise of 0.3, jump", "caution")
    for jump in ("gain times 6", "actuator reversed"):
        for caution in (0.0, 0.1, 1.0):
            system = plant(JUMPS[jump])
            found = [errors(*simulate(tuner(caution=caution), system, seed, noise=0.3)[:2]) for seed in range(runs)]
            line(jump, f"{caution:g}", found=found)

    head("constant set point, dither", "error of b1 before the jump")
    for dither in (0.0, 0.02, 0.1, 0.5):
        runs_of = [simulate(tuner(), plant(JUMPS["gain times 6"]), s, dither, False) for s in range(runs)]
        off = np.sqrt(np.mean([(b1[AT - 300 : AT] - BEFORE[2]) ** 2 for *_, b1 in runs_of]))
        line(f"{dither:g}", f"{off:.4f}", found=[errors(r, y) for r, y, *_ in runs_of])


def figure(path):
    """Draw the output, the input and the estimate across a jump."""
    import matplotlib.pyplot as plt

    after = JUMPS["gain times 6"]
    fig, axes = plt.subplots(3, 1, figsize=(9, 7), sharex=True, layout="constrained")
    cut = slice(400, 700)
    for name, controller, colour in (("fixed", fixed(BEFORE), "#D55E00"), ("adaptive", tuner(), "#0072B2")):
        r, y, u, b1 = simulate(controller, plant(after), seed=0)
        for ax, column in zip(axes, (y, u, b1 if name == "adaptive" else None)):
            if column is not None:
                ax.plot(np.arange(SAMPLES)[cut], column[cut], color=colour, lw=1.2, label=name)
    axes[0].plot(np.arange(SAMPLES)[cut], r[cut], color="black", lw=0.8, ls="--", label="set point")
    axes[2].plot(np.arange(SAMPLES)[cut], np.where(np.arange(SAMPLES) < AT, 0.1, 0.6)[cut], "k--", lw=0.8, label="true")
    for ax, label in zip(axes, ("y", "u", "b1")):
        ax.set_ylabel(label)
        ax.axvline(AT, color="grey", lw=0.8)
        ax.legend(loc="upper left", ncols=3, frameon=False)
    axes[-1].set_xlabel("sample; the plant's gain jumps at 500")
    fig.savefig(path, dpi=110)


if __name__ == "__main__":
    tables(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
    if len(sys.argv) > 2:
        figure(sys.argv[2])
