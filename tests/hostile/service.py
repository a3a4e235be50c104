"""What no client of a live service should send: bytes of requests, drawn, and a service that they are sent to."""

from __future__ import annotations

import json
import re
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .plots import mutated
from .trial import MEMORY, Outcome

SECONDS = 10.0  # of the clock, until a request is answered or refused: machines are shared
LATE = 0.05  # s that the second part of a request waits for an answer to the first
ANSWERS = {100, 200, 204, 400, 401, 403, 404, 405, 406, 408, 411, 413, 414, 415, 421, 422, 429, 431, 503}
LARGEST = 1 << 20  # bytes of an answer
WORDS = 4000  # bytes of an answer that refuses: its head, and no more than a line

CELLS = [
    "1.5", "-0", "1e308", "1e400", "NaN", "Infinity", "null", "true", '"3.5"', '"nan"', '"inf"', '"x"',
    "1" + "0" * 400, "[]", "[1,2]", "[[1]]", "{}", '{"value":1}', '"\\ud800"', '"\\u0000"', "1e-320", "0x10",
    "1_000", "", "-", '"1e999"',
]  # fmt: skip
TIMES = [
    "1767225600", "-1e300", "1e300", "0", "null", '"9999-12-31T23:59:59"', '"0001-01-01"', '"2024-02-30"', "[1,2]",
    '""',
]  # fmt: skip
KEYS = [
    '"pump"', '"\\u202epmup"', '"<script>pwn()</script>"', '"=1+1"', '"../../etc/passwd"', '"a/b"',
    '"' + "k" * 5000 + '"', "7", "1.5", "null", '""', '" "', '"\\ud800"', '"\\n\\u001b[31m"', "true", "[]",
    "9" * 5000, '"key%00"',
]  # fmt: skip
LINES = [
    "pump v=1 1767225600000000000", "pump,tag v=1i", "pump, v=", "pump v=1 x", "pump v=1e999", 'pump "v=1',
    "pump v=t", 'pump,a="b c" v=1,w="x"', "\\ v=1", "pump v=\\", ",,, =,=", "pump v=1 1e999", "# no", "pump\tv=1",
    'p v="' * 50, "pump v=9" + "9" * 5000, "pump " + ",".join(f"f{i}={i}" for i in range(3000)),
]  # fmt: skip
PATHS = [
    "/", "/api/series", "/api/series/pump", "/api/series/pump/history", "/api/series/%2e%2e%2f%2e%2e",
    "/api/series/", "/api/series/%ff", "/api/series/%00/history", "/static/../../../etc/passwd",
    "/static/%2e%2e/%2e%2e/etc/passwd", "/static/uPlot.js%00.css", "/api/events",
    "/api/events/99999999999999999999999/acknowledge", "/api/recent", "/stream", "/api/events/-1/acknowledge",
    "/metrics", "/health", "/openapi.json", "/sign-in", "/samples", "//", "/\\", "*", "http://elsewhere/api/series",
    "/" + "a" * 9000, "/api/series/" + "%41" * 3000,
]  # fmt: skip
QUERIES = [
    "", "?start=nan", "?start=1e308&end=-1e308", "?points=-1e308", "?points=1e308", "?points=", "?since=1e300",
    "?limit=inf", "?since=-5&limit=1e9", "?key=pump", "?key=%00", "?" + "key=a&" * 2000, "?key", "?=&=",
    "?start=0x10", "?limit=9e99",
]  # fmt: skip
HEADERS = [
    "Host: localhost", "Host: elsewhere.example", "Host:", "Host: [", "Content-Encoding: gzip",
    "Transfer-Encoding: chunked", "Content-Length: -1", "Content-Length: 99999999999999999999",
    "Content-Length: 5\r\nContent-Length: 6", "Expect: 100-continue",
    "Content-Type: application/json; charset=utf-7", "Content-Type: \x00", "Origin: https://elsewhere.example",
    "X-Driftwise: 1", "Cookie: driftwise=" + "x" * 5000, "Cookie: =;=;\x80", "Authorization: Bearer " + "x" * 5000,
    "Authorization: \xff", "Accept: " + "*/*," * 2000, "Range: bytes=0-,5-,-1",
    "Upgrade: websocket\r\nConnection: upgrade", "A" * 5000 + ": 1", "Connection: close, keep-alive, \x01",
    " folded: 1", "no colon", "X-Forwarded-For: 127.0.0.1", "If-None-Match: *",
]  # fmt: skip


class Request(NamedTuple):
    """Bytes, what they are in words, whether they end in the middle, and bytes that follow when it was answered."""

    data: bytes
    told: str
    is_cut: bool = False
    late: bytes = b""


def _pick(rng, some):
    return some[int(rng.integers(len(some)))]


def body(rng) -> tuple[str, bytes]:
    """Return samples that are none: their media type, and bytes."""
    draw, count = rng.random(), int(rng.integers(1, 20))
    if draw < 0.35:
        some = []
        for _ in range(count):
            key, time, name, cell = (_pick(rng, found) for found in (KEYS, TIMES, ["value", "", "u", "time"], CELLS))
            some.append(f'{{"key":{key},"time":{time},"{name}":{cell}}}')
        text = "\n".join(some) if rng.random() < 0.7 else "[" + ",".join(some) + "]"
        return "application/x-ndjson", text.encode()
    if draw < 0.65:
        return "text/plain", "\n".join(_pick(rng, LINES) for _ in range(count)).encode()
    if draw < 0.75:
        deep = int(rng.choice([10, 1000, 100_000]))
        return "application/json", _pick(rng, [b"[" * deep, b'{"value":' * deep, b"[" * deep + b"1" + b"]" * deep])
    if draw < 0.9:
        honest = "\n".join(json.dumps({"key": f"s{i}", "time": 1767225600.0 + i, "value": 0.5 * i}) for i in range(20))
        return "application/x-ndjson", mutated(honest.encode(), rng, 1 + int(rng.geometric(0.2)))
    return _pick(rng, ["application/x-ndjson", "text/plain"]), rng.integers(0, 256, 3000).astype(np.uint8).tobytes()


def drawn(rng: np.random.Generator) -> Request:
    """Return any request."""
    if rng.random() < 0.5:
        kind, data = body(rng)
        lines = ["POST /samples HTTP/1.1", "Host: localhost", "X-Driftwise: 1", f"Content-Type: {kind}"]
        told = f"samples, {kind}"
    else:
        data = b"" if rng.random() < 0.7 else body(rng)[1]
        method = _pick(
            rng, ["GET", "GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "TRACE", "CONNECT", "get", "\x00"]
        )
        path = _pick(rng, PATHS) + _pick(rng, QUERIES)
        lines = [f"{method} {path} {_pick(rng, ['HTTP/1.1'] * 6 + ['HTTP/1.0', 'HTTP/9.9', ''])}", "Host: localhost"]
        told = lines[0][:80]
    if data or rng.random() < 0.5:
        lines.append(f"Content-Length: {len(data)}")
    for _ in range(int(rng.integers(0, 3))):
        lines.insert(int(rng.integers(1, len(lines) + 1)), extra := _pick(rng, HEADERS))
        told += f", {extra[:40]!r}"
    end = "\r\n" if rng.random() < 0.9 else "\n"
    found = end.join(lines).encode("latin-1") + 2 * end.encode() + data
    draw, is_open = rng.random(), any(line.startswith(("Transfer-Encoding", "Content-Length: 9")) for line in lines)
    if draw < 0.15:
        return Request(mutated(found, rng, 1 + int(rng.geometric(0.3))), f"{told}, altered", True)
    if draw < 0.25:
        return Request(found[: int(rng.integers(len(found) + 1))], f"{told}, cut", True)
    if draw < 0.3:
        return Request(found * 5, f"{told}, five at once", True)
    if draw < 0.35:
        at = int(rng.integers(len(found) + 1))
        late = found[at:] if rng.random() < 0.5 else mutated(found[at:] or b"x", rng, 3)
        return Request(found[:at], f"{told}, in two parts", True, late)
    return Request(found, told, is_open)  # which waits for more


class Service:
    """A live service with a page, in a process of its own."""

    def __init__(self, folder: Path):
        path = folder / "live.toml"
        path.write_text(f'[model]\nmodel = "ar:1"\n[store]\npath = "{folder / "store"}"\n[web]\nport = 0\n')
        command = [sys.executable, "-m", "driftwise", "live", str(path)]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, errors="replace")
        assert self.process.stderr is not None
        self.said = [self.process.stderr.readline()]
        self.port = int(self.said[0].rstrip().rpartition(":")[2].strip("/"))
        self._hears = threading.Thread(target=lambda: self.said.extend(self.process.stderr or ()), daemon=True)
        self._hears.start()

    @property
    def peak(self) -> int:
        """Bytes that it has held at most, where the system says."""
        try:
            found = re.search(r"VmHWM:\s+(\d+)", Path(f"/proc/{self.process.pid}/status").read_text())
        except OSError:
            return 0
        return int(found[1]) << 10 if found else 0

    def ask(self, data: bytes, is_cut: bool = False, late: bytes = b"") -> bytes:
        """Return what it answers, to the end of the first answer's head at least; nothing where it hangs up."""
        answer = b""
        with socket.create_connection(("127.0.0.1", self.port), SECONDS) as wire:
            try:
                wire.sendall(data)
                if late:
                    select.select([wire], [], [], LATE)
                    wire.sendall(late)
                if is_cut:
                    wire.shutdown(socket.SHUT_WR)
                while b"\r\n\r\n" not in answer and (part := wire.recv(1 << 16)):
                    answer += part
            except OSError as error:
                if isinstance(error, TimeoutError):
                    raise  # else it has hung up
        return answer

    def tried(self, request: Request) -> tuple[list[str], Outcome]:
        """Return what is wrong with how it takes a request, and with how it is afterwards; and what it answered."""
        found, begun = [], time.perf_counter()
        try:
            answer = self.ask(request.data, request.is_cut, request.late)
        except TimeoutError:
            waits = b"\r\n\r\n" in request.data or b"\n\n" in request.data
            answer = b""
            found += ["no answer"] * (not waits)
        status = re.match(rb"HTTP/1\.1 (\d{3})", answer)
        if answer and (status is None or int(status[1]) not in ANSWERS):
            found.append(f"answers {answer[:60]!r}")
        if time.perf_counter() - begun > SECONDS + 1:
            found.append(f"took {time.perf_counter() - begun:.0f} s")
        if status is not None and int(status[1]) >= 400 and len(answer) > WORDS and not request.is_cut:
            found.append(f"{len(answer)} bytes of refusal")
        for word in (b"Traceback", b"root:", b"Internal Server Error"):
            found += [f"{word.decode()!r} in the answer"] * (word in answer)
        if self.process.poll() is not None:
            found.append(f"the service ended: {self.process.returncode}")
        elif b'"healthy":true' not in (health := self.heard("/health")):
            found.append(f"no longer healthy: {health[-300:]!r}")
        code = int(status[1]) if status else 0
        return found, Outcome([request.told], code, answer.decode("utf-8", "replace"), "", 0.0, 0.0, self.peak)

    def heard(self, path: str) -> bytes:
        """Return the answer to an honest question, asked again where too many came from here within a second."""
        end = time.perf_counter() + SECONDS
        while b"429" in (answer := self.told(path))[:20] and time.perf_counter() < end:
            time.sleep(0.1)
        return answer

    def told(self, path: str) -> bytes:
        """Return the answer to an honest question."""
        with socket.create_connection(("127.0.0.1", self.port), SECONDS) as wire:
            wire.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n".encode())
            answer = b""
            while len(answer) < LARGEST and (part := wire.recv(1 << 16)):
                answer += part
        return answer.replace(b" ", b"")

    def end(self) -> tuple[list[str], Outcome]:
        """Ask it to end; return what was wrong with it as a whole, and what came of it."""
        peak = self.peak
        self.process.send_signal(signal.SIGTERM)
        code = self.process.wait(60)
        self._hears.join(10)
        said = "".join(self.said)
        found = [f"exit code {code}"] * (code != 0) + [f"held {peak >> 20} MB"] * (peak > MEMORY)
        found += [f"said {said[-2000:]!r}"] * ("Traceback" in said or "Exception" in said)
        return found, Outcome(["live"], code, "", said, 0.0, 0.0, peak)


@contextmanager
def served(folder: Path):
    """Yield a service, which is killed if nobody has ended it."""
    service = Service(folder)
    try:
        yield service
    finally:
        if service.process.poll() is None:
            service.process.kill()
            service.process.wait()
