"""Judge the tracker on scenes that nobody chose.

Run: python -m driftwise_studies.score.motions.judge                 the choosing scenes (seed 0), to work on
     python -m driftwise_studies.score.motions.judge --judge         those of the last commit; into docs/judged.md
Options: --scenes 600 --processes 1 --worst 8 --crowds 100
"""

from __future__ import annotations

import argparse
import sys
import time

from driftwise.engine.errors import InputError

from ..worlds import judged
from . import crowd
from .bound import by_plots, in_widened
from .field import SCANS, SHARES, SOON, Total, by_kind, by_rate, by_trouble, told_by, worst
from .measured import play

ANSWERS = (  # what a track, or a scene, depends on
    "src/driftwise/estimators/track", "src/driftwise/tracking/tracker.py", "src/driftwise/tracking/targets.py",
    "src/driftwise/tracking/lives.py", "src/driftwise/tracking/keyless.py", "src/driftwise/tracking/association.py",
    "src/driftwise/tracking/existence.py", "src/driftwise/tracking/clutter.py", "src/driftwise/tracking/stillness.py",
    "src/driftwise/tracking/inbox.py", "src/driftwise/tracking/scans.py", "studies/driftwise_studies/score/motions",
)  # fmt: skip
GOALS = (  # words, how to read a `Total`, least, most
    ("share of tracks of 30 plots and more whose NIS is not above 3", lambda t: t.sober, 0.95, 1.0),
    ("share of tracks of 30 plots and more whose NIS is in .5 to 1.5", lambda t: t.good, 0.95, 1.0),
    ("the same of the mean squared normal score", lambda t: t.calibrated, 0.95, 1.0),
    ("share of bands of the position that hold", lambda t: t.held("position"), 0.92, 0.97),
    ("share of bands of the velocity that hold", lambda t: t.held("velocity"), 0.92, 0.97),
    ("the same within manoeuvres", lambda t: t.held("turning"), 0.88, 1.0),
    ("tracks that diverged, of 1000", lambda t: t.lost, 0.0, 1.0),
    ("share of objects that are one track", lambda t: t.whole, 0.95, 1.0),
    ("false onsets of 1000 quiet plots", lambda t: t.false_rate, 0.0, 1.0),
    ("share told of the manoeuvres that could be", lambda t: t.told, 0.7, 1.0),
    (f"the same of those at {SCANS[0]:g} to {SCANS[1]:g} s within {SOON:g} s", lambda t: t.soon, 0.35, 1.0),
    ("plots refused over those truly wild", lambda t: t.refused / max(t.wild, 1), 0.0, 1.5),
)


def verdicts(total: Total) -> list[str]:
    """Return each goal in words, with the number and whether it is met."""
    made = []
    for words, read, least, most in GOALS:
        value = float(read(total))
        said = "met" if least <= value <= most else "**missed**"
        made.append(f"* {said}: {words}: {value:.3f} ({least:g} to {most:g})")
    return made


def by_when(who: str, total: Total) -> str:
    """Return in words by when which share of all manoeuvres is told, where plots are a few seconds apart."""
    within, *by = told_by(total.seconds)
    shares = ", ".join(f"{100 * share:g} % by {cell} s" for share, cell in zip(SHARES, by))
    where = f"of all {len(total.seconds)} manoeuvres at {SCANS[0]:g} to {SCANS[1]:g} s"
    return f"* {who}: {where} {within} are told within {SOON:g} s; {shares}"


def main(arguments=None) -> None:
    """Run, print, and write down what was judged."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--judge", action="store_true", help="with the seed of the last commit that changed an answer")
    parser.add_argument("--scenes", type=int, default=600)
    parser.add_argument("--processes", type=int, default=1, help="0: all cores")
    parser.add_argument("--worst", type=int, default=8, help="how many tracks to name")
    parser.add_argument("--crowds", type=int, default=100, help="scenes of newcomers and clutter")
    asked = parser.parse_args(arguments)
    commit, seed = judged.seed(ANSWERS) if asked.judge else ("", judged.CHOOSING)
    title = f"## {commit[:8]}: tracks in {asked.scenes} scenes"
    if asked.judge:
        judged.refuse_twice(title)
    began = time.time()
    found, knowing = (play(seed, range(asked.scenes), asked.processes or None, stated) for stated in (False, True))
    crowds = (crowd.play(seed, asked.crowds), crowd.play(seed, asked.crowds, patchy=True))
    tables = by_trouble(found), by_kind(found), by_rate(found), by_plots(found, knowing), *crowds
    said = verdicts(Total(found))
    said.append(
        f"* of the same tracks, {in_widened(found):.3f} have a NIS in .8 to 1.5, widened by the 99 % of chance "
        f"of their own number of plots; who is told the variance of every plot {in_widened(knowing):.3f}"
    )
    told = Total(knowing)
    said.append(
        f"* who is told the variance of every plot has {told.sober:.3f} of the first, {told.good:.3f} of the second; "
        "see by plots"
    )
    said += [by_when("ours", Total(found)), by_when("who is told the variance", told)]
    print(f"seed {seed}, {asked.scenes} scenes, {time.time() - began:.0f} s\n")
    print(*tables, "\n".join(said), "", worst(found, asked.worst), sep="\n")
    if asked.judge:
        words = f"Seed {seed} = 0x{commit[:8]}; [what is counted](motions.md)."
        parts = [title, "", words, "", *said, "", *(one.rstrip() + "\n" for one in tables)]
        print("written:", judged.append(parts), file=sys.stderr)


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        sys.exit(str(error))
