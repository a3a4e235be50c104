"""Damaged plots through `driftwise track`: files, pipes, live UDP and TCP, in processes that are bounded.

    python -m tests.hostile --tracks 20000 --files 0 --troubles 0 --disks 0 --caches 0 --requests 0

A process takes a hundred inputs, one command after the other, so that what one leaves behind may spoil the next.
"""

from __future__ import annotations

import gc
import json
import os
import resource
import select
import shutil
import signal
import socket
import sys
import tempfile
import threading
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from . import trial
from .cases import Case
from .plots import FORMATS, mutated
from .wires import STREAMS

EACH = 100  # inputs of a process
BOUND = 8 << 30  # bytes of data that it may hold
TIMERS = (signal.ITIMER_PROF, trial.SECONDS), (signal.ITIMER_REAL, trial.PATIENCE / 2)
LATER, READ = 0.002, 0.03  # s between two looks, and until what was taken is read
ENDED = threading.Event()  # that a command has
PIECES = 13, 200, 60_000  # bytes
WAYS = {"file": 0.5, "pipe": 0.2, "udp": 0.15, "tcp": 0.15}


def drawn(seed: int, number: int) -> tuple[str, Case]:
    """Return how input ``number`` of ``seed`` comes, and the command on it; the bytes stand in ``stdin``."""
    rng = np.random.default_rng([seed, 4, number])
    way = str(rng.choice(list(WAYS), p=list(WAYS.values())))
    name = str(rng.choice([*FORMATS, *STREAMS]))
    data = b"".join(STREAMS[name][0](k) for k in range(10)) if name in STREAMS else FORMATS[name](rng)
    times = int(rng.choice([0, 1, 3, 30]))
    data = mutated(data, rng, times)
    file = name if name in FORMATS else f"p.{name}"
    args = ["track", *{"file": [file], "pipe": ["-", "--follow"]}.get(way, ["--listen", way])]
    args += ["-q"] * (rng.random() < 0.5) + ["--site", "46.2,15.1,800"] * (rng.random() < 0.5)
    args += ["--single"] * (rng.random() < 0.2) + ["--smooth"] * (way == "file" and rng.random() < 0.2)
    args += ["--out", "tracks", "--format", "csv,kml,geojson"] * (rng.random() < 0.2)
    case = Case({file: data} if way == "file" else {}, args, f"{name} by {way}, altered {times} times", data)
    case.options = {"piece": int(rng.choice(PIECES))}
    return way, case


def tracks(seed: int, numbers: Iterable[int]) -> Iterator:
    """Yield (number, case, what is wrong, outcome) of damaged plots; a number draws the same ones always."""
    left = list(numbers)
    while left:
        for number, fields, wrong in _of_process(seed, left[:EACH]):
            left = left[1:]
            yield number, drawn(seed, number)[1], wrong, trial.Outcome(**fields)


def _of_process(seed: int, numbers: list[int]) -> Iterator:
    """Try inputs in one forked process; yield what came of each. One that ends the process is the last."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        _serve(seed, numbers, writing)
    os.close(writing)
    told, done = b"", 0
    while done < len(numbers):
        ready, _, _ = select.select([reading], [], [], trial.PATIENCE)
        piece = os.read(reading, 1 << 16) if ready else b""
        if not piece:
            break
        *lines, told = (told + piece).split(b"\n")
        for line in lines:
            fields, wrong = json.loads(line)
            yield numbers[done], fields, wrong
            done += 1
    if done < len(numbers):
        os.kill(child, signal.SIGKILL)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    os.close(reading)
    if done < len(numbers):
        fields = dict(args=drawn(seed, numbers[done])[1].args, code=code, out="", err="", cpu=0.0, compiled=0.0, peak=0)
        yield numbers[done], fields, [f"ended the process or did not end within {trial.PATIENCE:g} s: {code}"]


def _serve(seed: int, numbers: list[int], writing: int) -> None:
    """Try inputs in this process, tell what came of each, and end."""
    code = 70
    try:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_DATA, (BOUND, BOUND))
        for bell in (signal.SIGPROF, signal.SIGALRM):
            signal.signal(bell, _stop)
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # one that comes once a command has ended; who listens hears it
        streams = [tempfile.TemporaryFile() for _ in range(2)]
        for number, stream in enumerate(streams, 1):
            os.dup2(stream.fileno(), number)
        sys.stdout, sys.stderr = open(1, "w"), open(2, "w", errors="backslashreplace")
        for number in numbers:
            outcome = _tried(*drawn(seed, number), streams)
            wrong = [line for line in trial.faults(outcome, {}) if "-q" in outcome.args or "were printed" not in line]
            outcome.out, outcome.err = outcome.out[:2000], outcome.err[-2000:]
            os.write(writing, json.dumps([vars(outcome), wrong]).encode() + b"\n")
        code = 0
    finally:
        os._exit(code)


class Slow(BaseException):
    """An input took too long, of the processor's time or of the clock's."""


def _stop(number, frame):
    raise Slow


def _tried(way: str, case: Case, streams: list) -> trial.Outcome:
    """Run one command in this process."""
    ENDED.clear()
    folder = Path(tempfile.mkdtemp(prefix="hostile-"))
    sender, args = None, list(case.args)
    os.chdir(folder)
    for name, data in case.files.items():
        Path(name).write_bytes(data)
    for stream in streams:
        stream.seek(0)
        stream.truncate()
    if way == "pipe":
        given = tempfile.TemporaryFile()
        given.write(case.stdin or b"")
        given.seek(0)
        os.dup2(given.fileno(), 0)
        sys.stdin = open(0, closefd=False)
    elif way != "file":
        port, sender = SENDERS[way](case.stdin or b"", case.options["piece"])
        args[args.index(way)] = f"{way}://127.0.0.1:{port}"
    sys.argv, begun = ["driftwise", *args], time.process_time()
    for timer, seconds in TIMERS:
        signal.setitimer(timer, seconds)
    code = trial._code_of()
    ENDED.set()
    for timer, _ in TIMERS:
        signal.setitimer(timer, 0.0)
    cpu = time.process_time() - begun
    if sender is not None:
        sender.join(trial.PATIENCE)
    words = []
    for stream in streams:
        stream.seek(0)
        words.append(stream.read().decode("utf-8", "replace"))
    os.chdir("/")
    shutil.rmtree(folder, ignore_errors=True)
    gc.collect()
    return trial.Outcome(args, code, *words, cpu, 0.0, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10)


def _pieces(data: bytes, size: int) -> list[bytes]:
    return [data[k : k + size] for k in range(0, len(data), size)]


def _end() -> None:
    """Press Ctrl-C once somebody hears it and what was taken is read: a table that is being parsed then is lost.

    Once alone, however busy the machine: who is asked twice leaves at once.
    """
    time.sleep(READ)
    while signal.getsignal(signal.SIGINT) == signal.SIG_IGN and not ENDED.wait(LATER):
        pass
    if not ENDED.is_set():
        signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)


def by_tcp(data: bytes, size: int) -> tuple[int, threading.Thread]:
    """Serve bytes to the first who connects; once all is read and the connection let go, press Ctrl-C."""
    server = socket.create_server(("127.0.0.1", 0))

    def serve() -> None:
        with server, server.accept()[0] as there:
            there.settimeout(trial.PATIENCE)
            try:
                for piece in _pieces(data, size):
                    there.sendall(piece)
                there.shutdown(socket.SHUT_WR)
                there.recv(1)  # it lets go of the connection, in its loop or because it refused
            except OSError:
                pass
        _end()

    return server.getsockname()[1], _begun(serve)


def by_udp(data: bytes, size: int) -> tuple[int, threading.Thread]:
    """Send datagrams once somebody listens; once they are taken, press Ctrl-C."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]

    def send() -> None:
        begun = time.monotonic()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as way:
            way.connect(("127.0.0.1", port))
            while not _is_taken(way) and time.monotonic() < begun + trial.PATIENCE:
                time.sleep(LATER)
            for piece in _pieces(data, size):
                try:
                    way.send(piece)
                except OSError:  # who refused is there no more
                    return
        while _waiting(port):
            time.sleep(LATER)
        _end()

    return port, _begun(send)


def _is_taken(way: socket.socket) -> bool:
    """Say whether somebody takes datagrams: an empty line is sent, and no answer says that nobody is there."""
    try:
        way.send(b"\n")
        time.sleep(LATER)
        way.send(b"\n")
    except ConnectionRefusedError:
        return False
    return True


def _waiting(port: int) -> bool:
    """Say whether datagrams wait to be taken at a port."""
    where = f"0100007F:{port:04X}"
    rows = [line.split() for line in Path("/proc/net/udp").read_text().splitlines()[1:]]
    return any(row[1] == where and int(row[4].partition(":")[2], 16) > 0 for row in rows)


def _begun(target) -> threading.Thread:
    thread = threading.Thread(target=target, daemon=True)
    thread.start()
    return thread


SENDERS = {"udp": by_udp, "tcp": by_tcp}
