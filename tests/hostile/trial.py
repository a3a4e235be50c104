"""One command tried in a process of its own: what it answered, what it took, and what of that is a fault."""

from __future__ import annotations

import json
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from dataclasses import dataclass
from pathlib import Path

from .outputs import is_whole

CODES = {0, 1, 2, 3}  # documented: done, data of no use, a wrong command, a question
SECONDS = 5.0  # of CPU that an answer about a small file may take
COMPILED = 30.0  # the same, where loops had to be compiled for it first
PATIENCE = 120.0  # s of the clock: machines are shared
MEMORY = 512 << 20  # bytes
SILENT = "refused without a word"
WORDS = 12_000  # characters that may be said of one table: sentences and tables, or the texts of its JSON
ENTRIES = 100  # of a list in its JSON: claims, models and changes, never one for every sample


@dataclass
class Outcome:
    """What one command came to: exit code (less than 0: the signal that ended it), words, and what it took."""

    args: list[str]
    code: int
    out: str
    err: str
    cpu: float  # s
    compiled: float  # s of CPU of what it started, which are compilers
    peak: int  # bytes
    is_hung: bool = False


def attempt(
    args, folder: Path, stdin: bytes | None = None, ended_by=None, after: float = 0.0, prepare=None, is_fresh=False
) -> Outcome:
    """Run the command line in a forked process, in ``folder``; a signal may come after so many seconds.

    prepare : called in that process before the command, to spoil something in it
    is_fresh : whether Python itself starts anew, as it does for a user: seconds, where a fork takes milliseconds
    """
    args = [str(arg) for arg in args]
    streams = [tempfile.TemporaryFile() for _ in range(3)]
    streams[0].write(stdin or b"")
    streams[0].seek(0)
    child = os.fork()
    if child == 0:
        _become(args, folder, streams, prepare, is_fresh)
    begun, is_sent, is_hung = time.perf_counter(), ended_by is None, False
    while os.waitid(os.P_PID, child, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
        passed = time.perf_counter() - begun
        if not is_sent and passed >= after:
            os.kill(child, ended_by)
            is_sent = True
        if passed > PATIENCE:
            os.kill(child, signal.SIGKILL)
            is_hung = True
        time.sleep(0.005)
    compiled = _of_children(child)
    _, status, used = os.wait4(child, 0)
    words = []
    for stream in streams[1:]:
        stream.seek(0)
        words.append(stream.read().decode("utf-8", "replace"))
    code, cpu = os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime
    return Outcome(args, code, *words, cpu, compiled, used.ru_maxrss << 10, is_hung)


def _of_children(process: int) -> float:
    """Return the seconds of CPU that ended children of a process took, where the system says."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[13]) + int(fields[14])) / os.sysconf("SC_CLK_TCK")


def _become(args: list[str], folder: Path, streams: list, prepare, is_fresh: bool) -> None:
    """Run the command line as this process, and end it."""
    code = 70
    try:
        os.chdir(folder)
        for number, stream in enumerate(streams):
            os.dup2(stream.fileno(), number)
        sys.stdin, sys.stdout, sys.stderr = open(0), open(1, "w"), open(2, "w", errors="backslashreplace")
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        sys.argv = ["driftwise", *args]
        if prepare is not None:
            prepare()
        if is_fresh:
            os.execv(sys.executable, [sys.executable, "-m", "driftwise", *args])
        code = _code_of()
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


def _code_of() -> int:
    from driftwise.cli import entry

    try:
        entry.main()
        code = 0
    except SystemExit as done:
        code = done.code if isinstance(done.code, int) else int(done.code is not None)
    except BaseException:
        traceback.print_exc()
        code = 70
    for stream in filter(None, (sys.stdout, sys.stderr)):
        try:
            stream.flush()
        except OSError:
            code = 120  # as Python ends
    return code


def _told(text: str) -> tuple[int, int]:
    """Return how many characters a text says, and the entries of its longest list; of JSON its own texts, as often."""
    try:
        left, said, longest = [json.loads(text)], 0, 0
    except ValueError:
        return len(text), 0
    while left:
        value = left.pop()
        if isinstance(value, dict):
            left += [*value, *value.values()]
        elif isinstance(value, list):
            longest = max(longest, len(value))
            left += value
        elif isinstance(value, str):
            said += len(value)
    return said, longest


def faults(outcome: Outcome, written: dict[Path, bytes | None], codes=CODES, seconds: float = SECONDS) -> list[str]:
    """Return what is wrong with an outcome; ``written``: places it might write to, and what was there before."""
    found = []
    if outcome.is_hung:
        found.append(f"did not end within {PATIENCE:g} s")
    elif outcome.code not in codes:
        found.append(f"exit code {outcome.code}")
    for what, text in (("standard output", outcome.out), ("standard error", outcome.err)):
        for word in ("Traceback (most recent call last)", "Exception ignored in", "RuntimeWarning", "\x1b]", "\x07"):
            if word in text:
                found.append(f"{word!r} on {what}: {text.strip().splitlines()[-1][:200]}")
                break
    said, longest = _told(outcome.out)
    if said + len(outcome.err) > WORDS:
        found.append(f"{said + len(outcome.err)} characters were printed")
    if longest > ENTRIES:
        found.append(f"a list of {longest} entries was printed")
    if outcome.code in (1, 2) and not outcome.err.strip():
        found.append(SILENT)
    if outcome.cpu > (max(seconds, COMPILED) if outcome.compiled > 0.05 else seconds):
        found.append(f"took {outcome.cpu:.1f} s of CPU")
    if outcome.peak > MEMORY:
        found.append(f"took {outcome.peak >> 20} MB")
    for path, before in written.items():
        now = path.read_bytes() if os.path.isfile(path) else None  # whose name may be too long for any
        if now != before and not is_whole(path):
            found.append(f"{path.name} is neither whole nor as it was")
        if outcome.code == 2 and now != before:
            found.append(f"{path.name} was written although the command was refused")
        left = [p.name for p in path.parent.glob(f".{path.name}.*") if -outcome.code != signal.SIGKILL]
        found += [f"{name} was left behind" for name in left]
    return found
