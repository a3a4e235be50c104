"""Compile one file in a process that goes on when its parent ends: ``finish.py SOURCE MADE NAME PENDING LINE..``.

It needs nothing but Python's standard library, and is a script as well as a module.
"""

import hashlib
import os
import subprocess
import sys
from pathlib import Path


def named(path: Path, name: str) -> Path:
    """Return what a finished object is called: its name ends with a digest of its bytes."""
    return path.with_name(f"{name}.{hashlib.sha256(path.read_bytes()).hexdigest()[:16]}.so")


def put(made: Path, name: str) -> Path:
    """Give a finished object its name, at once or not at all."""
    final = named(made, name)
    os.replace(made, final)
    return final


def main(source: str, made: str, name: str, pending: str, *line: str) -> int:
    """Compile, name, and take away the source, and the mark that says that somebody is at it."""
    done = subprocess.run(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    if done.returncode == 0 and os.path.exists(made):
        put(Path(made), name)
    for path in (source, made, pending):
        Path(path).unlink(missing_ok=True)
    return done.returncode


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
