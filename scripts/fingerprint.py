"""Hash the numbers of every model and memory, and keep the words of reports: proof that a change moved none of them.

    python scripts/fingerprint.py --out before.json        # on the tree before
    python scripts/fingerprint.py --against before.json    # on the tree after: prints what moved, exit code 1 if any

Numbers are the float64 bytes of states, traces and columns (NaN is one NaN, the sign of zero counts); a configuration
is a line of `NUMBERS` or `WORDS` in `fingerprints/`. Loops run uncompiled, unless ``--compiled``: no waiting. The
numbers are then the same but for the last bits of exp and log: compare like with like, on one machine. Words are
compared after `NAMES`: a class may be renamed, what is said of it may not change by accident.
"""

from __future__ import annotations

import argparse
import fnmatch
import json
import os
import sys
import time
import warnings
from pathlib import Path

from fingerprints.compare import difference, take
from fingerprints.numbers import NUMBERS
from fingerprints.words import WORDS


def run_uncompiled() -> None:
    """Let every loop that is asked for be the Python function that would have been compiled."""
    os.environ["DRIFTWISE_ENGINE"] = "python"


def main() -> None:
    """Take the fingerprint of the tree that is imported; write it, or say what moved."""
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("--out", metavar="FILE", help="write the fingerprint")
    arguments.add_argument("--against", metavar="FILE", help="compare with this one; exit code 1 where anything moved")
    arguments.add_argument("--only", metavar="PATTERN", default="*", help="such as 'arx/*' or '*auto*'")
    arguments.add_argument("--compiled", action="store_true", help="with compiled loops")
    arguments.add_argument("--slow", action="store_true", help="print what takes more than a second")
    asked = arguments.parse_args()
    if not asked.compiled:
        run_uncompiled()
    else:  # what runs as plain Python proves nothing of compiled loops
        warnings.filterwarnings("error", "(?s).*plain Python", RuntimeWarning)
    names = [n for n in [*NUMBERS, *(f"words/{name}" for name in WORDS)] if fnmatch.fnmatch(n, asked.only)]
    found, begun = {}, time.process_time()
    for name in names:
        start = time.process_time()
        found[name] = take(name)
        if asked.slow and time.process_time() - start > 1:
            print(f"{name}: {time.process_time() - start:.1f} s")
    taken = time.process_time() - begun
    failed = [f"{name} {what}" for name, what in found.items() if what.startswith("failed: ")]
    moved, known = [], {}
    if asked.out:
        Path(asked.out).write_text(json.dumps(found, indent=0, sort_keys=True, ensure_ascii=False) + "\n")
    if asked.against:
        known = json.loads(Path(asked.against).read_text())
        moved = [lines for name in names if name in known and (lines := difference(name, known[name], found[name]))]
        moved += [[f"{name}: gone"] for name in known if name not in found and fnmatch.fnmatch(name, asked.only)]
    new = sum(name not in known for name in names) if asked.against else 0
    for lines in moved or [[line] for line in failed]:
        print("\n".join(lines))
    print(f"{len(names)} configurations, {len(moved)} moved, {len(failed)} failed, {new} new, {taken:.0f} s")
    sys.exit(1 if moved or failed else 0)


if __name__ == "__main__":
    main()
