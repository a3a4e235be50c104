"""Compile one file in a process that goes on when its parent ends: ``finish.py WORKSHOP NAME PENDING LINE..``.

It needs nothing but Python's standard library, and is a script as well as a module. Of such processes one at a time
compiles, whoever asked: programs that begin side by side, each with loops of its own, would fill the machine.
"""

import hashlib
import os
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

SECONDS = 600  # no loop takes a minute


def named(path: Path, name: str) -> Path:
    """Return what a finished object is called: its name ends with a digest of its bytes."""
    return path.with_name(f"{name}.{hashlib.sha256(path.read_bytes()).hexdigest()[:16]}.so")


def put(made: Path, name: str) -> Path:
    """Give an object that was made in a folder of its own its name in the folder above, at once or not at all."""
    final = made.parent.parent / named(made, name).name
    if final.is_dir():  # it has the name of one of ours and is none
        shutil.rmtree(final, ignore_errors=True)
    os.replace(made, final)
    return final


def give_way() -> None:
    """Leave the cores to whoever waits for an answer: Linux shares them among sessions first, in each by niceness."""
    if hasattr(os, "nice"):
        os.nice(10)
    with suppress(OSError):  # no Linux, or one that shares among processes alone
        Path("/proc/self/autogroup").write_text("10")


def wait_for_turn(place: Path) -> None:
    """Wait until no other process compiles for a folder; the turn ends as this process does, however it does."""
    with suppress(ImportError, OSError):  # Windows and some file systems have no such locks: go on at once
        import fcntl

        fcntl.flock(os.open(place, os.O_RDONLY), fcntl.LOCK_EX)


def main(workshop: str, name: str, pending: str, *line: str) -> int:
    """Compile, name, and take away the workshop, and the mark that says that somebody is at it."""
    made, place, quiet, code = Path(line[-1]), Path(workshop).parent, subprocess.DEVNULL, 1
    try:
        give_way()
        wait_for_turn(place)
        if next(place.glob(f"{name}.*.so"), None):  # made meanwhile
            return 0
        code = subprocess.run(line, stdout=quiet, stderr=quiet, timeout=SECONDS, check=False).returncode
        if code == 0 and made.exists():
            put(made, name)
    except (OSError, subprocess.TimeoutExpired):
        code = 1
    finally:
        shutil.rmtree(workshop, ignore_errors=True)
        Path(pending).unlink(missing_ok=True)
    return code


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
