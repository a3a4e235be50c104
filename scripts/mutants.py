"""Change one line of the package at a time, and see the test fail that says it guards it: an audit of the tests.

python scripts/mutants.py                     # every mutant of scripts/mutants.txt; exit code 1 where one lives
python scripts/mutants.py --only gaps         # those with that word in their name or file
python scripts/mutants.py --check             # only: is every line still there once, and every test?
python scripts/mutants.py --tests tests/memory --only forgetting   # other tests: who else notices?

The package is copied, and changed there: the working tree stays as it is. First all tests named are run unchanged.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parent.parent
LIST = ROOT / "scripts" / "mutants.txt"
PATIENCE = 300.0  # seconds: a mutant that hangs its test is noticed, too


class Mutant(NamedTuple):
    """A line of a file (of one function, where it is there more than once), what it becomes, and who must notice."""

    name: str
    file: str
    function: str
    old: str
    new: str
    test: str

    def apply(self, source: str) -> str:
        """Return the source with the line changed, which must be there once."""
        first, last = 0, len(source)
        if self.function:
            found = re.search(rf"^def {self.function}\(.*?(?=^\S)", source + "\nend", re.S | re.M)
            if found is None:
                raise LookupError(f"{self.name}: {self.file} has no function {self.function}")
            first, last = found.start(), min(found.end(), last)
        lines = re.findall(rf"^ *{re.escape(self.old)}(?=\n)", source[first:last], re.M)
        if len(lines) != 1:
            raise LookupError(f"{self.name}: {self.file} has this line {len(lines)} times: {self.old}")
        at = source.index(lines[0] + "\n", first)
        changed = lines[0].replace(self.old, self.new)
        return source[:at] + changed + source[at + len(lines[0]) :]

    @property
    def has_test(self) -> bool:
        """Whether the test is there."""
        file, _, name = self.test.partition("::")
        path = ROOT / file
        return path.exists() and (not name or f"def {name.split('[')[0]}(" in path.read_text(encoding="utf-8"))


def read(path: Path = LIST) -> list[Mutant]:
    """Return the mutants of a list: name, file and function, the line, what it becomes, the test; then a blank line."""
    found = []
    for block in re.split(r"\n\s*\n", path.read_text(encoding="utf-8").strip()):
        lines = block.splitlines()
        if lines[0].startswith("#"):
            continue
        name, place, old, new, test = lines
        file, _, function = place.partition("::")
        if old[:2] != "- " or new[:2] != "+ ":
            raise ValueError(f"{name}: a line after '- ' and one after '+ ', got {old!r} and {new!r}")
        found.append(Mutant(name, "src/driftwise/" + file, function, old[2:].strip(), new[2:].strip(), test))
    return found


def wrong(mutants: list[Mutant]) -> list[str]:
    """Return what no longer fits the tree."""
    found = []
    for one in mutants:
        try:
            one.apply((ROOT / one.file).read_text(encoding="utf-8"))
        except (LookupError, OSError) as error:
            found.append(str(error))
        if not one.has_test:
            found.append(f"{one.name}: there is no {one.test}")
    return found


def fails(tests: list[str], copy: Path, patience: float | None = PATIENCE) -> tuple[bool, str]:
    """Run tests against the copy; return whether one fails, and the last line that pytest prints."""
    paths = [copy / "src", ROOT / "studies"]
    env = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, paths)), "DRIFTWISE_CACHE": str(copy / "cache")}
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    try:
        done = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, timeout=patience)
    except subprocess.TimeoutExpired:
        return True, f"nothing after {patience:.0f} s"
    if done.returncode not in (0, 1):  # 2: not even collected, which an import that dies looks like, too
        return done.returncode == 2, done.stdout.strip().splitlines()[-1]
    lines = done.stdout.strip().splitlines()
    return done.returncode == 1, next((line for line in lines if line.startswith("FAILED ")), lines[-1])


def main() -> int:
    """Apply every mutant, print who was noticed, and return 1 where one was not."""
    take = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    take.add_argument("--only", default="", metavar="WORD")
    take.add_argument("--check", action="store_true")
    take.add_argument("--tests", nargs="+", metavar="TEST")
    options = take.parse_args()
    mutants = [one for one in read() if options.only in f"{one.name} {one.file}"]
    if found := wrong(mutants):
        print(*found, sep="\n")
        return 1
    if options.check:
        print(f"{len(mutants)} mutants, each line there once, every test there")
        return 0
    alive = []
    with tempfile.TemporaryDirectory(
        prefix="mutants", ignore_cleanup_errors=True
    ) as folder:  # a compiler may still write
        copy = Path(folder)
        shutil.copytree(ROOT / "src", copy / "src", ignore=shutil.ignore_patterns("__pycache__"))
        tests = options.tests or sorted({one.test for one in mutants})
        fail, last = fails(tests, copy, None)
        print(f"unchanged: {last}", flush=True)
        if fail:
            return 1
        for one in mutants:
            path, began = copy / one.file, time.perf_counter()
            source = path.read_text(encoding="utf-8")
            path.write_text(one.apply(source), encoding="utf-8")
            killed, last = fails(options.tests or [one.test], copy)
            path.write_text(source, encoding="utf-8")
            for stale in path.parent.glob(f"__pycache__/{path.stem}.*.pyc"):
                stale.unlink()
            print(
                f"{'killed' if killed else 'LIVES '} {time.perf_counter() - began:4.0f} s  {one.name}: {last}",
                flush=True,
            )
            alive += [] if killed else [one.name]
    print(f"{len(mutants) - len(alive)} of {len(mutants)} killed" + (f"; alive: {'; '.join(alive)}" if alive else ""))
    return bool(alive)


if __name__ == "__main__":
    sys.exit(main())
