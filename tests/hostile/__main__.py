"""A hostile day: `python -m tests.hostile` tries drawn files, and commands something happens to, and says what broke.

The seed is that of the last commit, where none is given: nobody who wrote the code has seen its cases.
"""

from __future__ import annotations

import argparse
import subprocess
import sys

import numpy as np


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.hostile", description=__doc__)
    parser.add_argument("--seed", type=lambda text: int(text, 16), help="hexadecimal; of the last commit if omitted")
    parser.add_argument("--files", type=int, default=200, help="drawn files and options")
    parser.add_argument("--troubles", type=int, default=50, help="signals, disks, calls that fail")
    parser.add_argument("--only", help="one of them, whose words are printed: file:7, trouble:3")
    asked = parser.parse_args()
    seed = asked.seed if asked.seed is not None else _of_commit()
    print(f"seed {seed:x}")
    from . import day

    kinds = {"file": (day.files, range(asked.files)), "trouble": (day.troubles, range(asked.troubles))}
    if asked.only:
        kind, _, number = asked.only.partition(":")
        kinds = {kind: (kinds[kind][0], range(int(number), int(number) + 1))}
    found = tried = 0
    codes: dict[int, int] = {}
    for take, numbers in kinds.values():
        for kind, number, case, wrong, outcome in take(seed, numbers):
            tried, codes[outcome.code] = tried + 1, codes.get(outcome.code, 0) + 1
            if wrong or asked.only:
                found += bool(wrong)
                print(f"\n{kind} {number}: {case.told}\n  driftwise {' '.join(map(repr, case.args))[:400]}")
                print("".join(f"  ! {line[:400]}\n" for line in wrong), end="", flush=True)
            if asked.only:
                print(
                    outcome.out, outcome.err, f"exit code {outcome.code}, {outcome.cpu:.2f} s, {outcome.peak >> 20} MB"
                )
    print(f"{found} of {tried} broke a promise; exit codes {dict(sorted(codes.items()))}")
    return int(found > 0)


def _of_commit() -> int:
    done = subprocess.run(["git", "rev-parse", "HEAD"], capture_output=True, text=True, check=True)
    return int(done.stdout[:12], 16)


if __name__ == "__main__":
    np.seterr(all="ignore")
    sys.exit(main())
