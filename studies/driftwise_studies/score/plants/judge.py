"""Judge `GreyBox` on plants that nobody chose.

Run: python -m driftwise_studies.score.plants.judge                 the choosing records (seed 0), to work on
     python -m driftwise_studies.score.plants.judge --judge         those of the last commit; into docs/judged.md
Options: --records 100 --processes 1 --worst 8 --plant NAME
"""

from __future__ import annotations

import argparse
import sys
import time

from driftwise.engine.errors import InputError

from ..worlds import judged
from .field import Total, by_plant, worst
from .measured import play
from .physics import PLANTS

ANSWERS = (  # what an answer depends on
    "src/driftwise/estimators/grey_box", "src/driftwise/models/plants", "src/driftwise/memory",
    "studies/driftwise_studies/score/plants",
)  # fmt: skip
GOALS = (  # words, how to read a `Total`, least, most
    ("share whose log posterior is within 2 of the batch fit's", lambda t: t.converged, 0.98, 1.0),
    ("parameter error over the Cramer-Rao bound, where that is below 10 %", lambda t: t.error, 0.0, 1.1),
    ("share that the 95 % bars hold", lambda t: t.held, 0.92, 0.97),
    ("share of the tellable jumps found, named and dated", lambda t: t.dated, 0.95, 1.0),
    ("the same, and no other parameter told", lambda t: t.alone, 0.95, 1.0),
    ("false jumps a record", lambda t: t.false, 0.0, 0.02),
)


def verdicts(total: Total) -> list[str]:
    """Return each goal in words, with the number and whether it is met."""
    made = []
    for words, read, least, most in GOALS:
        value = float(read(total))
        said = "met" if least <= value <= most else "**missed**"
        made.append(f"* {said}: {words}: {value:.3f} ({least:g} to {most:g})")
    return made


def main(arguments=None) -> None:
    """Run, print, and write down what was judged."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--judge", action="store_true", help="with the seed of the last commit that changed an answer")
    parser.add_argument("--records", type=int, default=100, help="of each plant")
    parser.add_argument("--processes", type=int, default=1, help="0: all cores")
    parser.add_argument("--worst", type=int, default=8, help="how many records to name")
    parser.add_argument("--plant", choices=list(PLANTS), action="append", help="only these")
    asked = parser.parse_args(arguments)
    if asked.judge and asked.plant:
        raise InputError("all plants are judged, or none")
    commit, seed = judged.seed(ANSWERS) if asked.judge else ("", judged.CHOOSING)
    title = f"## {commit[:8]}: physical parameters in {asked.records} records of each plant"
    if asked.judge:
        judged.refuse_twice(title)
    began = time.time()
    found = play(seed, asked.plant or PLANTS, asked.records, asked.processes or None)
    said, table = verdicts(Total(found)), by_plant(found)
    print(f"seed {seed}, {asked.records} records of each plant, {time.time() - began:.0f} s\n")
    print(table, "\n".join(said), "", worst(found, asked.worst), sep="\n")
    if asked.judge:
        words = f"Seed {seed} = 0x{commit[:8]}; [what is counted](plants.md)."
        print("written:", judged.append([title, "", words, "", *said, "", table]), file=sys.stderr)


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        sys.exit(str(error))
