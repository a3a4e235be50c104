"""Judge the default memory on three hundred systems that nobody chose.

Run: python -m driftwise_studies.score.worlds.judge                 the choosing systems (seed 0), to work on
     python -m driftwise_studies.score.worlds.judge --judge         the judging ones, once a commit; into docs/judged.md
Options: --systems 300 --records 30 --processes 1 --worst 20 --memory 'AutoMemory()'
"""

from __future__ import annotations

import argparse
import sys
import time

import driftwise as dw

from . import judged
from .field import by_size, by_trouble, play, total, worst

CHOOSING = 0
AUTO = "AutoMemory()"


def automatic(system):
    """Return the default memory."""
    return dw.AutoMemory()


def main(arguments=None) -> None:
    """Run, print, and write down what was judged."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--judge", action="store_true", help="with the seed of the last commit that moved a constant")
    parser.add_argument("--systems", type=int, default=300)
    parser.add_argument("--records", type=int, default=30)
    parser.add_argument("--processes", type=int, default=1, help="0: all cores")
    parser.add_argument("--worst", type=int, default=20, help="how many systems to name")
    asked = parser.parse_args(arguments)
    commit, seed = judged.seed() if asked.judge else ("", CHOOSING)
    if asked.judge:
        judged.refuse_twice(commit, asked.systems, asked.records)
    began = time.time()
    lines = play(seed, range(asked.systems), asked.records, {AUTO: automatic}, asked.processes or None)
    tables = by_trouble(lines, AUTO), by_size(lines, AUTO), worst(lines, AUTO, asked.worst)
    print(
        f"seed {seed}, {asked.systems} systems, {asked.records} records, {time.time() - began:.0f} s\n",
        *tables,
        sep="\n",
    )
    verdicts = judged.verdicts(total(lines, AUTO))
    print(*(f"{'met' if good else 'MISSED':6} {words}" for words, good in verdicts), sep="\n")
    if asked.judge:
        print("written:", judged.append(commit, seed, asked.systems, asked.records, lines, AUTO), file=sys.stderr)


if __name__ == "__main__":
    main()
