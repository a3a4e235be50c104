"""`driftwise live` as a process: samples by MQTT and HTTP over sockets, latency to events, memory over ten million.

`python -m bench.live_service [rates|latency|http|memory ..]` prints verdicts; each word takes less than three minutes.
Publisher, broker and service share the machine: rates are of the service's processor time, beside them by the clock.
"""

from __future__ import annotations

import http.client
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from .live_messages import TOPICS, messages
from .verdicts import Verdict, at_least, at_most

SOURCE = "bench/live_service.py"
RATE = 2000  # samples a second while latency is measured
LAST = 10  # s of it
STUCK = 5  # equal outputs that are told, once in so many samples of a series:
ONCE = 50


def verdicts(words: tuple[str, ...] = ("rates", "latency", "http")) -> Iterator[Verdict]:
    """Yield what is asked for; by MQTT only where there is mosquitto."""
    for word in words:
        if word == "http":
            yield from _http()
        elif shutil.which("mosquitto"):
            yield from {"rates": _rates, "latency": _latency, "memory": _memory}[word]()


class Running:
    """A service that runs, its address where it serves a page, and a client of its broker where it has one."""

    def __init__(self, process: subprocess.Popen, folder: Path, address: str, client: Any):
        self.process, self.folder, self.address, self.client = process, folder, address, client

    @property
    def seconds(self) -> float:
        """Processor time so far."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    @property
    def resident(self) -> float:
        """Bytes in memory."""
        return int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    def publish(self, found: list[tuple[str, bytes]]) -> None:
        """Publish messages with QoS 1."""
        for key, payload in found:
            self.client.publish(f"in/{key}", payload, qos=1)

    def taken(self) -> float:
        """Return how many samples it has taken, as it says itself."""
        host, _, port = self.address.rpartition("//")[2].partition(":")
        ask = http.client.HTTPConnection(host, int(port))
        ask.request("GET", "/api/service")
        found = json.loads(ask.getresponse().read())["counters"].get("samples", 0.0)
        ask.close()
        return float(found)

    def until(self, samples: float) -> None:
        """Wait until it has taken so many."""
        while self.taken() < samples:
            time.sleep(0.05)


@contextmanager
def running(more: str = "", has_broker: bool = True) -> Iterator[Running]:
    """Run a service, with ``more`` in its configuration, PORT standing for that of a broker."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        broker = client = None
        config = (
            f'[model]\nmodel = "ar:2"\nfirst = 4\nstuck = {STUCK}\n[store]\npath = "{folder}/store"\n[web]\nport = 0\n'
        )
        if has_broker:
            import paho.mqtt.client as paho

            limits = "max_queued_messages 0\nmax_inflight_messages 0\n"
            (folder / "m.conf").write_text(
                f"listener {port} 127.0.0.1\nallow_anonymous true\nset_tcp_nodelay true\n{limits}"
            )
            broker = subprocess.Popen(["mosquitto", "-c", str(folder / "m.conf")], stderr=subprocess.DEVNULL)
            time.sleep(0.5)
            client = paho.Client(paho.CallbackAPIVersion.VERSION2)
            client.max_inflight_messages_set(1000)
            client.connect("127.0.0.1", port)
            client.loop_start()
            config += f'[[source]]\nkind = "mqtt"\nurl = "mqtt://127.0.0.1:{port}"\ntopics = ["in/+"]\nkey = "{{1}}"\n'
        (folder / "live.toml").write_text(config + more.replace("PORT", str(port)))
        words = [sys.executable, "-m", "driftwise", "live", str(folder / "live.toml")]
        process = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
        assert process.stderr is not None
        address = next(line.split()[-1] for line in process.stderr if "the page is at" in line)
        one = Running(process, folder, address, client)
        try:
            if has_broker:
                _warm(one)
            yield one
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(60)
            if broker is not None:
                client.loop_stop()
                broker.terminate()
                broker.wait(10)


def _warm(one: Running) -> None:
    """Publish until every series has its units; loops are compiled by then."""
    size = 40
    while one.taken() < size * TOPICS:
        at = int(one.taken() // TOPICS)
        one.publish(messages(TOPICS, size, at))
        until = time.monotonic() + 5.0
        while one.taken() < (at + size) * TOPICS and time.monotonic() < until:
            time.sleep(0.1)


def _rates() -> Iterator[Verdict]:
    """Yield samples a second by MQTT, with estimates published."""
    more = '[[out]]\nkind = "mqtt"\nurl = "mqtt://127.0.0.1:PORT"\nevents = true\nestimates = true\n'
    with running(more) as one:
        at = 1000
        for size, count, least in ((50, 8000, 20_000.0), (1, 20_000, 2_000.0)):
            found, before = messages(count, size, at), one.taken()
            spent, begun = one.seconds, time.perf_counter()
            one.publish(found)
            one.until(before + count * size)
            took, spent = time.perf_counter() - begun, one.seconds - spent
            at += count // TOPICS * size + size
            note = f"events and estimates published too; by the clock {count * size / took:.0f} samples/s"
            yield at_least(f"live: MQTT, QoS 1, {size} samples a message", count * size / spent, least,
                           "samples/s of the service's CPU time", SOURCE, note)  # fmt: skip


def _latency() -> Iterator[Verdict]:
    """Yield the time from publishing a sample to the event that it made, at 2000 samples a second."""
    more = '[[out]]\nkind = "mqtt"\nurl = "mqtt://127.0.0.1:PORT"\n'
    with running(more) as one:
        came: dict[tuple[str, str, float], float] = {}

        def on_message(client, userdata, message):
            found = json.loads(message.payload)
            came[found["kind"], found["key"], found["time"]] = time.perf_counter()

        one.client.on_message = on_message
        one.client.subscribe("driftwise/events/+")
        rng, held = np.random.default_rng(3), np.zeros(TOPICS)
        sent: dict[tuple[str, str, float], float] = {}
        spent, begun = one.seconds, time.perf_counter()
        for i in range(RATE * LAST):
            t, series = divmod(i, TOPICS)
            place, instant = (t + series) % ONCE, 1e9 + 1000 + t
            held[series] = held[series] if 0 < place < STUCK and place <= t else rng.standard_normal()
            while (ahead := begun + i / RATE - time.perf_counter()) > 0:
                time.sleep(min(ahead, 0.0005))
            told = {STUCK - 1: "stuck", STUCK: "back"}.get(place)
            if told and t >= ONCE:
                sent[told, f"s{series}", instant] = time.perf_counter()
            one.client.publish(f"in/s{series}", json.dumps({"time": instant, "value": held[series]}), qos=1)
        spent = one.seconds - spent
        time.sleep(2.0)
        took = np.array([came.get(name, np.inf) - begun for name, begun in sent.items()]) * 1e3
        missing = int(np.isinf(took).sum())
        note = f"{len(took)} events, {missing} of them missing; the service was at work {spent / LAST:.0%} of the time"
        for percent, most in ((50, 20.0), (99, 100.0)):
            yield at_most(f"live: from publishing a sample to its event, p{percent}, {RATE} samples/s",
                          float(np.percentile(took, percent)), most, "ms", SOURCE, note)  # fmt: skip


def _http() -> Iterator[Verdict]:
    """Yield samples a second by HTTP, in bodies of ten thousand lines, over two connections."""
    size, count, keys = 10_000, 36, 50

    def body(link: int, n: int) -> bytes:
        return b"".join(
            b'{"key": "h%d/%d", "time": %d, "value": %.3f}\n'
            % (link, i % keys, 1e9 + (n * size + i) // keys, (i * 7 + n) % 11)
            for i in range(size)
        )

    def post(address: str, bodies: list[bytes]) -> None:
        host, _, port = address.rpartition("//")[2].partition(":")
        link = http.client.HTTPConnection(host, int(port))
        for one in bodies:
            link.request("POST", "/samples", one, {"Content-Type": "application/x-ndjson", "X-Driftwise": "1"})
            told = json.loads(link.getresponse().read())
            if told["taken"] != size:
                raise RuntimeError(f"the service took {told}")
        link.close()

    found = [[body(link, n) for n in range(count)] for link in range(2)]
    warm = count // 6  # loops are compiled by then
    with running(has_broker=False) as one, ThreadPoolExecutor(2) as pool:
        deque(pool.map(post, [one.address] * 2, [bodies[:warm] for bodies in found]), 0)
        spent, begun = one.seconds, time.perf_counter()
        deque(pool.map(post, [one.address] * 2, [bodies[warm:] for bodies in found]), 0)
        samples, took, spent = 2 * size * (count - warm), time.perf_counter() - begun, one.seconds - spent
    yield at_least("live: HTTP, bodies of 10 000 lines, over sockets", samples / took, 50_000.0, "samples/s", SOURCE,
                   f"by the clock; of the service's CPU time {samples / spent:.0f}")  # fmt: skip


def _memory(total: int = 10_000_000, size: int = 261) -> Iterator[Verdict]:
    """Yield the peak of the second half of all samples over that of the first: history waits for its files."""
    with running() as one:
        at, peaks, have, begun = 1000, list[float](), one.taken(), time.perf_counter()
        for part in range(6):
            peak = 0.0
            for _ in range(8):  # as much as the broker likes to hold
                count = max(round(total / 48 / size / TOPICS), 1) * TOPICS
                one.publish(messages(count, size, at))
                at, have = at + count // TOPICS * size, have + count * size
                one.until(have)
                peak = max(peak, one.resident)
            peaks.append(peak)
            print(f"  {part + 1} of 6: {peak / 1e6:.0f} MB, {time.perf_counter() - begun:.0f} s", file=sys.stderr)
        yield at_most("live: memory of the service, second half over first half of its samples",
                      max(peaks[3:]) / max(peaks[:3]), 1.05, "x", SOURCE,
                      f"{have / 1e6:.1f} million samples, {peaks[-1] / 1e6:.0f} MB")  # fmt: skip


if __name__ == "__main__":
    for one in verdicts(tuple(sys.argv[1:]) or ("rates", "latency", "http", "memory")):
        print(
            f"{'met   ' if one.kept else 'MISSED'} {one.name}: {one.value:.4g} ({one.expected}) {one.note}", flush=True
        )
