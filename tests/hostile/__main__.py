"""A hostile day: `python -m tests.hostile` tries drawn files, and commands something happens to, and says what broke.

The seed is that of the last commit, where none is given: nobody who wrote the code has seen its cases.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections import Counter

import numpy as np

from . import day, tracked

KINDS = {
    "files": (day.files, 200, "drawn files and options"),
    "troubles": (day.happenings, 40, "signals, streams and calls that fail"),
    "disks": (day.disks, 6, "disks that are full"),
    "caches": (day.caches, 4, "damaged caches"),
    "requests": (day.requests, 500, "requests to a live service"),
    "tracks": (tracked.tracks, 200, "damaged plots in files, pipes and live sockets"),
}
OFTEN = 1000  # cases between two words of how far it is


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.hostile", description=__doc__)
    parser.add_argument("--seed", type=lambda text: int(text, 16), help="hexadecimal; of the last commit if omitted")
    for kind, (_, count, about) in KINDS.items():
        parser.add_argument(f"--{kind}", type=int, default=count, help=f"how many {about}; {count} if omitted")
    parser.add_argument("--only", help="one of them, whose words are printed: files:7, troubles:3")
    asked = parser.parse_args()
    seed = asked.seed if asked.seed is not None else _of_commit()
    print(f"seed {seed:x}")
    numbers = {kind: range(getattr(asked, kind)) for kind in KINDS}
    if asked.only:
        kind, _, number = asked.only.partition(":")
        numbers = {kind: range(int(number), int(number) + 1)}
    day.load()
    tried = broken = 0
    codes: Counter[int] = Counter()
    for kind, which in numbers.items():
        for number, case, wrong, outcome in KINDS[kind][0](seed, which):
            tried, broken, codes[outcome.code] = tried + 1, broken + bool(wrong), codes[outcome.code] + 1
            if wrong or asked.only:
                print(f"\n{kind}:{number} {case.told}\n  driftwise {' '.join(map(repr, case.args))[:400]}")
                print("".join(f"  ! {line[:400]}\n" for line in wrong), end="", flush=True)
            if asked.only:
                print(outcome.out, outcome.err, f"exit code {outcome.code}, {outcome.cpu:.2f} s of CPU", sep="\n")
            if tried % OFTEN == 0:
                print(f"{tried} tried, {broken} broke a promise", file=sys.stderr, flush=True)
    print(f"{broken} of {tried} broke a promise; codes {dict(sorted(codes.items()))}")
    return int(broken > 0)


def _of_commit() -> int:
    done = subprocess.run(["git", "rev-parse", "HEAD"], capture_output=True, text=True, check=True)
    return int(done.stdout[:12], 16)


if __name__ == "__main__":
    np.seterr(all="ignore")
    sys.exit(main())
