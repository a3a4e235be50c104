"""Print the tables of docs/smoothing.md and draw its figure: what smoothing gains where parameters drift or jump.

Run: python scripts/smoothing.py [records] (200 by default: three minutes).
"""

import sys
import time
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import numpy as np
from driftwise_studies.papers.abid.systems import system

import driftwise as dw

FIGURE = Path(__file__).parent.parent / "docs" / "figures" / "smoothing.png"
CASES = {
    "a": "nearly white, relaxing to zero (Phi told)",
    "b": "sines",
    "c": "random walks of unequal speed",
    "d": "constant but for two jumps",
    "e": "constant",
    "g": "random walks, fast for a third of the record",
}


def smoothed(name, made, i, **options):
    """Return one record in hindsight."""
    if name in "cg":
        return dw.Regression(4).smooth(made.y[i], made.psi[i], **options)
    memory = dw.memory.Drift(made.phi, nvr=1e-3) if name == "a" else dw.Constant()
    return dw.ARX(2, 2, at_rest=True, memory=memory).smooth(made.y[i], made.u[i], **options)


def rmse(errors):
    return np.sqrt(np.mean(np.square(errors)))


def table(records, hyper):
    print(f'\nhyper="{hyper}"')
    print("| case | parameters | filtered | smoothed | gain | 95 % bars hold | integrated | jumps a record | ms |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name, words in CASES.items():
        made, columns, began = system(name, records), [], time.process_time()
        for i in range(records):
            found, theta = smoothed(name, made, i, hyper=hyper), made.theta[i]
            error = found.parameters - theta
            holds = np.abs(error) < 1.96 * found.parameters_std
            is_integrated = found.drift == "integrated"
            columns.append(((found.filtered - theta)[50:], error[50:], holds[50:], is_integrated, len(found.jumps)))
        spent = 1e3 * (time.process_time() - began) / records
        filtered, error, holds, is_integrated, jumps = (np.array(column) for column in zip(*columns, strict=True))
        gain = 100 * (1 - rmse(error) / rmse(filtered))
        print(
            f"| {name} | {words} | {rmse(filtered):.4f} | {rmse(error):.4f} | {gain:.0f} % | {holds.mean():.2f} "
            f"| {100 * is_integrated.mean():.0f} % | {jumps.mean():.2f} | {spent:.0f} |"
        )


def jumps(records):
    """What interventions are worth, and how well jumps are dated."""
    made, with_jumps, without, off = system("d", records), [], [], []
    for i in range(records):
        found = smoothed("d", made, i, drift="walk")
        with_jumps.append((found.parameters - made.theta[i])[50:])
        without.append((smoothed("d", made, i, drift="walk", jumps=None).parameters - made.theta[i])[50:])
        off += [min((abs(jump.sample - k) for jump in found.jumps), default=np.inf) for k in made.jumps]
    off = np.array(off)
    exact, near = 100 * np.mean(off == 0), 100 * np.mean(off <= 3)
    print(f"\nd: smoothed error {rmse(without):.4f} without interventions, {rmse(with_jumps):.4f} with;")
    print(f"   jumps dated to the sample {exact:.0f} %, within 3 samples {near:.0f} %")


def speed(records=50):
    """One maximum-likelihood fit of a random walk, and `tune`."""
    made = system("c", records)
    smoothed("c", made, 0)
    began = time.process_time()
    for i in range(records):
        dw.Regression(4).tune(made.y[i], made.psi[i])
    print(f"\ntune: {1e3 * (time.process_time() - began) / records:.0f} ms for 600 samples and 4 parameters")


def words():
    print()
    for name in "abcd":
        print(f"{name}: {smoothed(name, system(name, 1), 0).words}\n")


def draw():
    """Draw a record of case d with the truth."""
    made = system("d", 1)
    axes = smoothed("d", made, 0).plot(labels={"time": "sample"})
    for i, ax in enumerate(axes):
        ax.plot(made.theta[0][:, i], color="black", lw=0.9, ls="--", label="truth")
    axes[0].legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=3, frameon=False, fontsize=9)
    FIGURE.parent.mkdir(exist_ok=True)
    axes[0].figure.savefig(FIGURE, dpi=110)


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    draw()
    for hyper in ("ml", "average"):
        table(count, hyper)
    jumps(count)
    speed()
    words()
