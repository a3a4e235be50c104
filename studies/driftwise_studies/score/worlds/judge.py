"""Judge the default memory on three hundred systems that nobody chose.

Run: python -m driftwise_studies.score.worlds.judge                 the choosing systems (seed 0), to work on
     python -m driftwise_studies.score.worlds.judge --judge         the judging ones, once a commit; into docs/judged.md
Options: --systems 300 --records 30 --processes 1 --worst 20 --memory 'AutoMemory()'
"""

from __future__ import annotations

import argparse
import sys
import time

from driftwise.engine.errors import InputError

from ...papers.abid import entrants as known_names
from ...papers.abid import ranking as known_systems
from . import judged
from .entrants import AUTO, ENTRANTS
from .field import by_size, by_trouble, play, total, worst


def eight(seeds: int = 200) -> tuple[float, float]:
    """Return mean and worst ratio of the default memory on the eight systems it was made with."""
    line = known_systems.line(seeds, known_names.AUTO, known_names.LEARNT)
    return line.mean, line.worst


def main(arguments=None) -> None:
    """Run, print, and write down what was judged."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--judge", action="store_true", help="with the seed of the last commit that moved a constant")
    parser.add_argument("--page", action="store_true", help="put the choosing systems' tables into docs/worlds.md")
    parser.add_argument("--systems", type=int, default=300)
    parser.add_argument("--records", type=int, default=30)
    parser.add_argument("--processes", type=int, default=1, help="0: all cores")
    parser.add_argument("--worst", type=int, default=20, help="how many systems to name")
    parser.add_argument(
        "--memory", default=AUTO, choices=list(ENTRANTS), metavar="NAME", help="another one, of the ranking"
    )
    asked = parser.parse_args(arguments)
    name = AUTO if asked.judge else asked.memory
    commit, seed = judged.seed() if asked.judge else ("", judged.CHOOSING)
    if asked.judge:
        judged.refuse_twice(judged.title(commit, asked.systems, asked.records))
    began = time.time()
    lines = play(seed, range(asked.systems), asked.records, [name], asked.processes or None)
    tables = by_trouble(lines, name), by_size(lines, name), worst(lines, name, asked.worst)
    said = f"`{name}`: seed {seed}, {asked.systems} systems, {asked.records} records"
    print(f"{said}, {time.time() - began:.0f} s\n")
    print(*tables, sep="\n")
    known = eight() if name == AUTO else None
    verdicts = judged.verdicts(total(lines, name), known)
    print(*(f"{'met' if good else 'MISSED':6} {words}" for words, good in verdicts), sep="\n")
    if asked.page and not asked.judge:
        judged.write("choosing", "\n".join((said + ".\n", *tables)))
    if asked.judge:
        parts = judged.judgement(commit, seed, asked.records, lines, name, known)
        print("written:", judged.append(parts), file=sys.stderr)


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        sys.exit(str(error))
