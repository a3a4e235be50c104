"""Smoothing judged on scenes that nobody chose: one object, one sensor.

Run: python -m driftwise_studies.score.motions.smoothing             the choosing scenes (seed 0), to work on
     python -m driftwise_studies.score.motions.smoothing --judge     those of the last commit; into docs/judged.md
Options: --scenes 300 --lag 10 (fixed lag instead of the whole record)
"""

from __future__ import annotations

import argparse
import sys
import time
from typing import NamedTuple

import numpy as np

from driftwise.engine.errors import InputError
from driftwise.engine.status import Status
from driftwise.estimators.track.estimator import TrackEstimator
from driftwise.models.quantities import NORMAL_95

from ..worlds import judged
from .drawing import draw
from .scene import KINDS
from .simulation import simulate

ANSWERS = "src/driftwise/estimators/track", "studies/driftwise_studies/score/motions"
FIRST = 10  # plots before the filter is compared: it has not seen enough
RATIO, LEAST, MOST = 0.7, 0.92, 0.97
HEAD = (
    "", "scenes", "position, of filtering", "velocity, of filtering", "bands of the position", "of the velocity",
    "those of filtering", "wild plots", "set aside, of them", "set aside wrongly, of 1000",
)  # fmt: skip


class Smoothed(NamedTuple):
    """One scene."""

    kind: str
    position: float  # RMSE over the filter's
    velocity: float
    held: tuple[int, int]  # coordinates of the position in their 95 % band, of how many
    velocity_held: tuple[int, int]
    filter_held: tuple[int, int]
    wild: int
    found: int
    wrong: int
    plots: int


def run(seed: int, number: int, lag: int | None) -> Smoothed | None:
    """Return what smoothing made of a scene; None where it has several objects or sensors."""
    scene = draw(seed, number)
    if scene.objects > 1 or len(scene.sensors) > 1 or scene.plots <= 2 * FIRST:
        return None
    seen = simulate(scene)
    keep = np.concatenate([[True], np.diff(seen.plots.time) > 0])
    plots = seen.plots[keep]
    truth, moving, wild = seen.truth[keep], seen.velocity[keep], seen.wild[keep]
    given = plots.time, plots.position, plots.covariance if scene.stated else None
    estimator = TrackEstimator(scene.kind.told)
    filtered, trace = estimator.scan(*given), estimator.smooth(*given, lag=lag)

    def held(value, sd, true):
        inside = np.abs(value - true) <= NORMAL_95 * sd
        return int(inside.sum()), inside.size

    def error(value, true):
        return float(np.sqrt(np.mean((value - true)[FIRST:] ** 2)))

    def ratio(name, true):
        smoothed, before = error(getattr(trace, name), true), error(getattr(filtered, name), true)
        return 1.0 if smoothed == before else smoothed / before if before > 0.0 else np.inf  # both 0 at rest in a cell

    told = (trace.status & int(Status.OUTLIER)) != 0
    return Smoothed(
        scene.name, ratio("position", truth), ratio("velocity", moving),
        held(trace.position, trace.position_sd, truth), held(trace.velocity, trace.velocity_sd, moving),
        held(filtered.position[FIRST:], filtered.position_sd[FIRST:], truth[FIRST:]),
        int(wild.sum()), int((wild & told).sum()), int((told & ~wild).sum()), len(plots),
    )  # fmt: skip


def cells(found: list[Smoothed]) -> list[str]:
    """Return the numbers of some scenes."""

    def share(name):
        return f"{sum(getattr(f, name)[0] for f in found) / sum(getattr(f, name)[1] for f in found):.3f}"

    def middle(name):
        return f"{np.median([getattr(f, name) for f in found]):.2f}"

    wild, plots = sum(f.wild for f in found), sum(f.plots for f in found)
    return [
        str(len(found)), middle("position"), middle("velocity"), share("held"), share("velocity_held"),
        share("filter_held"), str(wild), f"{sum(f.found for f in found) / max(wild, 1):.2f}",
        f"{1000 * sum(f.wrong for f in found) / plots:.1f}",
    ]  # fmt: skip


def table(found: list[Smoothed]) -> str:
    """Return a row for each class; errors are medians of ratios, bands pool the plots."""
    rows = [("all", found)] + [(k, [f for f in found if f.kind == k]) for k in KINDS]
    lines = [HEAD, ("---",) * len(HEAD), *((name, *cells(some)) for name, some in rows if some)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def uncertainty(found: list[Smoothed]) -> float:
    """Return the standard deviation of the share of bands that hold, by how much it differs between tracks."""
    inside, size = np.array([f.held for f in found], float).T
    return float(np.sqrt(np.sum((inside - inside.sum() / size.sum() * size) ** 2)) / size.sum())


def verdicts(found: list[Smoothed]) -> list[str]:
    """Return each goal in words, with the number and whether it is met."""
    flights = [f for f in found if f.kind == "flight"]
    made = []
    for words, some in (("flights", flights), ("all classes", found)):
        _, ratio, _, held, *_ = cells(some)
        made.append(f"* {'met' if float(ratio) <= RATIO else '**missed**'}: {words}: error of the position over "
                    f"filtering {ratio} ({RATIO})")  # fmt: skip
        said = "met" if LEAST <= float(held) <= MOST else "**missed**"
        made.append(f"* {said}: {words}: bands of the position hold {held} +- {uncertainty(some):.3f} "
                    f"({LEAST} to {MOST})")  # fmt: skip
    return made


def main(arguments=None) -> None:
    """Run, print, and write down what was judged."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--judge", action="store_true", help="with the seed of the last commit that changed an answer")
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--lag", type=int, help="plots that are waited for; all when omitted")
    asked = parser.parse_args(arguments)
    commit, seed = judged.seed(ANSWERS) if asked.judge else ("", judged.CHOOSING)
    title = f"## {commit[:8]}: smoothed tracks in {asked.scenes} scenes{f', lag {asked.lag}' if asked.lag else ''}"
    if asked.judge:
        judged.refuse_twice(title)
    began = time.time()
    found = [one for number in range(asked.scenes) if (one := run(seed, number, asked.lag))]
    said, rows = verdicts(found), table(found)
    print(f"seed {seed}, {asked.scenes} scenes, {time.time() - began:.0f} s\n\n{rows}\n" + "\n".join(said))
    if asked.judge:
        words = f"Seed {seed} = 0x{commit[:8]}; [what is drawn](motions.md), one object and one sensor."
        print("written:", judged.append([title, "", words, "", *said, "", rows]), file=sys.stderr)


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        sys.exit(str(error))
