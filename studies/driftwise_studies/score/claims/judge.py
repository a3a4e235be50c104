"""Audit what `driftwise run FILE` claims, on files whose truth is known.

Run: python -m driftwise_studies.score.claims.judge                 the files to choose by (seed 0)
     python -m driftwise_studies.score.claims.judge --judge         those of the last commit; into docs/judged.md
Options: --files 60 --processes 1 --worst 4
"""

from __future__ import annotations

import argparse
import sys
import time

from driftwise.engine.errors import InputError

from ..worlds import judged
from .audit import falsehoods, play, table

ANSWERS = "src/driftwise", "studies/driftwise_studies/score/claims"  # what an answer, or a file, depends on


def main(arguments=None) -> None:
    """Run, print, and write down what was judged."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--judge", action="store_true", help="with the seed of the last commit that changed an answer")
    parser.add_argument("--files", type=int, default=60)
    parser.add_argument("--first", type=int, default=0, help="number of the first file")
    parser.add_argument("--processes", type=int, default=1, help="0: all cores")
    parser.add_argument("--worst", type=int, default=4, help="false claims of each kind to show")
    asked = parser.parse_args(arguments)
    commit, seed = judged.seed(ANSWERS) if asked.judge else ("", judged.CHOOSING)
    title = f"## {commit[:8]}: claims on {asked.files} files"
    if asked.judge:
        judged.refuse_twice(title)
    began = time.time()
    lines = play(seed, range(asked.first, asked.first + asked.files), asked.processes)
    found = table(lines)
    print(f"seed {seed}, {asked.files} files, {time.time() - began:.0f} s\n\n{found}\n{falsehoods(lines, asked.worst)}")
    if asked.judge:
        said = f"Seed {seed} = 0x{commit[:8]}; [what is counted](claims.md)."
        print("written:", judged.append([title, "", said, "", found.rstrip()]), file=sys.stderr)


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        sys.exit(str(error))
