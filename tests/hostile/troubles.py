"""What happens to a command that works: signals, a reader that goes, full disks, calls that fail, damaged caches."""

from __future__ import annotations

import builtins
import errno
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path

from . import plots, tables
from .cases import OLD, Case
from .trial import CODES

ENDED = CODES | {130, 143, -signal.SIGINT, -signal.SIGTERM, -signal.SIGKILL}
ERRORS = (errno.ENOSPC, errno.EIO, errno.EDQUOT, errno.EROFS, errno.EACCES)


def a_command(rng, rows: int = 300) -> Case:
    """Return a command that works, and writes over files that are there."""
    files = {f"out{ending}": data for ending, data in OLD.items() if ending != ".csv"}
    targets = ["--report", "out.html", "--json", "out.json"]
    draw = int(rng.integers(4))
    if draw == 0:
        return Case({**files, "p.csv": plots.table(rng, 200)}, ["track", "p.csv", *targets, "--out", "tracks"], "track")
    files["t.csv"] = tables.plain(rng, rows).to_bytes()
    if draw == 1:
        return Case(files, ["compare", "t.csv", "arx:1,1,1", "last", "-o", "y", "-i", "u", *targets], "compare")
    more = ["-o", "y", "-i", "u", "--save", "out.parquet"] if draw == 2 else []
    return Case(files, ["run", "t.csv", *more, *targets], "run")


TROUBLES: list[Callable] = []


def trouble(function):
    """Add a function (case, rng) to what is drawn from."""
    TROUBLES.append(function)
    return function


@trouble
def a_signal(case, rng):
    number = [signal.SIGINT, signal.SIGTERM, signal.SIGKILL][int(rng.integers(3))]
    fresh = bool(rng.random() < 0.3) and number != signal.SIGINT  # which Python itself may hear, while it starts
    case.options = {"ended_by": number, "after": float(rng.uniform(0, 3.0 if fresh else 1.2)), "is_fresh": fresh}
    case.codes = ENDED
    return f"{number.name} after {case.options['after']:.2f} s"


@trouble
def a_reader_that_goes(case, rng):
    def prepare():
        there, here = os.pipe()
        os.close(there)
        os.dup2(here, 1)
        sys.stdout = open(1, "w")  # as Python does that finds a pipe there

    case.options = {"prepare": prepare, "is_fresh": bool(rng.random() < 0.5)}
    case.codes, case.is_silent = CODES | {-signal.SIGPIPE, 128 + signal.SIGPIPE}, True
    return "nobody reads what is printed"


@trouble
def a_full_terminal(case, rng):
    case.options = {
        "prepare": lambda: os.dup2(os.open("/dev/full", os.O_WRONLY), 1),
        "is_fresh": bool(rng.random() < 0.5),
    }
    return "standard output is full"


@trouble
def a_closed_stream(case, rng):
    number = int(rng.integers(2))
    case.options = {"prepare": lambda: os.close(number), "is_fresh": True}
    return f"file {number} is closed"


@trouble
def a_full_disk(case, rng):
    size = int(rng.choice([0, 100, 4096, 20_000, 200_000]))

    def prepare():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    case.options, case.codes = {"prepare": prepare}, CODES | {120}  # what it says goes there, too
    return f"a disk that is full after {size} bytes"


@trouble
def a_call_that_fails(case, rng):
    at, number = int(rng.integers(1, 5)), ERRORS[int(rng.integers(len(ERRORS)))]
    name = ["replace", "fsync", "open"][int(rng.integers(3))]

    def prepare():
        left, true = [at], builtins.open if name == "open" else getattr(os, name)

        def fails(*args, **options):
            writes = name != "open" or "w" in str((*args, *options.values())[1:2])
            left[0] -= writes
            if writes and left[0] == 0:
                raise OSError(number, os.strerror(number), args[0] if name == "open" else None)
            return true(*args, **options)

        setattr(builtins if name == "open" else os, name, fails)

    case.options = {"prepare": prepare}
    return f"{name} {at} answers {errno.errorcode[number]}"


@trouble
def few_files(case, rng):
    most = int(rng.integers(6, 40))
    case.options = {"prepare": lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))}
    return f"{most} files may be open"


@trouble
def a_folder_that_is_gone(case, rng):
    case.options = {"prepare": lambda: shutil.rmtree(os.getcwd())}
    return "the folder is deleted"


def drawn(rng) -> Case:
    """Return a command and what happens to it."""
    case = a_command(rng)
    told = TROUBLES[int(rng.integers(len(TROUBLES)))](case, rng)
    case.told = f"{case.told}: {told}"
    return case


@contextmanager
def small_disk(size: int):
    """Yield a folder on a disk of so many bytes; None where this user may not make one."""
    folder = Path(tempfile.mkdtemp(prefix="disk-"))
    try:
        done = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder], capture_output=True)
        is_made = done.returncode == 0
    except OSError:
        is_made = False
    try:
        yield folder if is_made else None
    finally:
        if is_made:
            subprocess.run(["umount", "-l", folder], check=False)
        folder.rmdir()


def spoil(cache: Path, rng) -> str:
    """Damage every file of a cache in one way; return which."""
    how = ["cut", "flipped", "empty", "text", "a folder", "another's", "unreadable"][int(rng.integers(7))]
    files = sorted(path for path in cache.rglob("*") if path.is_file())
    first = files[0].read_bytes() if files else b""
    for path in files:
        data = bytearray(path.read_bytes())
        if how == "cut":
            path.write_bytes(data[: int(rng.integers(len(data) + 1))])
        elif how == "flipped":
            for at in rng.integers(0, max(1, len(data)), 200 if data else 0):
                data[at] ^= 255
            path.write_bytes(data)
        elif how in ("empty", "text", "another's"):
            path.write_bytes({"empty": b"", "text": b"not a library\n" * 99, "another's": first}[how])
        elif how == "a folder":
            path.unlink()
            path.mkdir()
        else:
            path.chmod(0)
    return how
