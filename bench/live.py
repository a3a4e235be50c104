"""`driftwise live`: samples a second to what is on disk, by MQTT too; latency; memory; start."""

from __future__ import annotations

import json
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import driftwise as dw
from driftwise.live.config import parse
from driftwise.live.core import Core
from driftwise.live.decode import chunks
from driftwise.live.sources.base import Parcel
from driftwise.live.store.sqlite import SqliteStore
from driftwise.live.view import gathered
from driftwise.live.web.samples import samples_of

from .memory import resident
from .verdicts import Verdict, at_least, at_most

SOURCE = "bench/live.py"
NOW = 2e9
TOPICS = 200


def verdicts(big: bool = False) -> Iterator[Verdict]:
    """Yield rates of the core, memory, start, and what passes through mosquitto where there is one."""
    with tempfile.TemporaryDirectory() as folder:
        yield from _core(Path(folder), 10_000_000 if big else 1_000_000)
    with tempfile.TemporaryDirectory() as folder:
        yield _start(Path(folder))
    if shutil.which("mosquitto"):
        with tempfile.TemporaryDirectory() as folder:
            yield from _mqtt(Path(folder))


def estimator(config=None) -> dw.AR:
    """Return what every series gets."""
    return dw.AR(2, offset=True, memory=dw.AutoMemory())


def core_in(folder: Path) -> Core:
    """Return a core with its store in a folder."""
    config = parse(f'[model]\nmodel = "ar:2"\n[store]\npath = "{folder}"\n')
    return Core(config, SqliteStore(folder), estimator)


def messages(count: int, size: int, first: int = 0) -> list[tuple[str, bytes]]:
    """Return so many messages of so many samples, of 200 series in turn."""
    rng, found = np.random.default_rng(1), []
    for i in range(count):
        at = first + i // TOPICS * size
        times, values = [1e9 + at + j for j in range(size)], rng.standard_normal(size).round(4).tolist()
        body = {"time": times, "value": values} if size > 1 else {"time": times[0], "value": values[0]}
        found.append((f"s{i % TOPICS}", json.dumps(body).encode()))
    return found


def _core(folder: Path, total: int) -> Iterator[Verdict]:
    """Yield rates of one core without a network, and memory over all of it."""
    core, at = core_in(folder), 0
    for size, handful, least in ((50, 40, 20_000.0), (1, 100, 2_000.0)):
        count = max(total // 4 // size // (10 if size == 1 else 1), 4 * TOPICS)
        cost = _fed(core, messages(count, size, at), handful)
        at += count // TOPICS * size + size
        what = f"live: messages of {size} samples through decoding, estimating, committing"
        yield at_least(what, count * size / cost, least, "samples/s of CPU time", SOURCE)
    body = b"".join(
        b'{"key": "h%d", "time": %d, "value": %.3f}\n' % (i % 50, 1e9 + i // 50, i % 7) for i in range(50_000)
    )
    begun = time.process_time()
    core.take([Parcel(gathered(samples_of(body, "json")[0]))], NOW)
    core.commit()
    yield at_least("live: a body of 50 000 lines by HTTP", 50_000 / (time.process_time() - begun), 50_000.0,
                   "samples/s of CPU time", SOURCE)  # fmt: skip
    after, size = [], 50
    for _ in range(4):
        _fed(core, messages(total // 4 // size, size, at), 40)
        at += total // 4 // size // TOPICS * size + size
        part = core.history.part()
        if part is not None:
            core.history.write(part, core.keys(part.numbers))
            core.store.forget(part.last)
            core.history.written(part)
        after.append(resident())
    yield at_most("live: memory, after all samples over after half of them", after[3] / after[1], 1.05, "x", SOURCE,
                  f"{after[3] / 1e6:.0f} MB, history in Parquet")  # fmt: skip
    core.store.close()


def _fed(core: Core, found: list[tuple[str, bytes]], handful: int) -> float:
    """Feed messages, so many between two commits; return CPU seconds."""
    begun = time.process_time()
    for i in range(0, len(found), handful):
        core.take([Parcel(chunks(payload, key)) for key, payload in found[i : i + handful]], NOW)
        core.commit()
    return time.process_time() - begun


def _start(folder: Path) -> Verdict:
    """Return how long a core of 10 000 stored series takes to begin."""
    core = core_in(folder)
    rng = np.random.default_rng(2)
    for t in range(0, 40, 10):
        times = [1e9 + t + j for j in range(10)]
        core.take([Parcel(chunks(json.dumps({"time": times, "value": rng.standard_normal(10).tolist()}), f"s{i}"))
                   for i in range(10_000)], NOW)  # fmt: skip
    core.commit()
    core.store.close()
    begun = time.perf_counter()
    core_in(folder).store.close()
    return at_most("live: start with 10 000 stored series", time.perf_counter() - begun, 3.0, "s", SOURCE)


def _mqtt(folder: Path) -> Iterator[Verdict]:
    """Yield rates and latency through a broker, wall time: publisher, broker and service share the machine."""
    import paho.mqtt.client as paho

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    (folder / "m.conf").write_text(
        f"listener {port} 127.0.0.1\nallow_anonymous true\nmax_queued_messages 0\nmax_inflight_messages 0\n"
    )
    (folder / "live.toml").write_text(
        f'[model]\nmodel = "ar:2"\nfirst = 4\n[store]\npath = "{folder}/store"\n[web]\nenabled = false\n'
        f'[[source]]\nkind = "mqtt"\nurl = "mqtt://127.0.0.1:{port}"\ntopics = ["in/+"]\nkey = "{{1}}"\n'
        f'[[out]]\nkind = "mqtt"\nurl = "mqtt://127.0.0.1:{port}"\nevents = false\nestimates = true\n'
    )
    broker = subprocess.Popen(["mosquitto", "-c", str(folder / "m.conf")], stderr=subprocess.DEVNULL)
    time.sleep(0.5)
    service = subprocess.Popen([sys.executable, "-m", "driftwise", "live", str(folder / "live.toml")])
    try:
        client = paho.Client(paho.CallbackAPIVersion.VERSION2)
        client.max_inflight_messages_set(1000)
        client.connect("127.0.0.1", port)
        came: dict[str, float] = {}
        client.on_message = lambda c, u, m: came.__setitem__(
            m.topic.rpartition("/")[2] + str(json.loads(m.payload)["time"]), time.perf_counter()
        )
        client.subscribe("driftwise/estimates/+")
        client.loop_start()
        _warm(client, came)
        at = 1000
        for size, count, least in ((50, 4000, 20_000.0), (1, 10_000, 2_000.0)):
            before, begun = _cpu(service.pid), time.perf_counter()
            _pass(client, came, messages(count, size, at))
            at += count // TOPICS * size + size
            note = f"estimates published too; wall {time.perf_counter() - begun:.1f} s, broker and publisher beside it"
            yield at_least(f"live: MQTT, QoS 1, {size} samples a message", count * size / (_cpu(service.pid) - before),
                           least, "samples/s of the service's CPU time", SOURCE, note)  # fmt: skip
        took = np.array(_latency(client, came, at)) * 1e3
        for percent, most in ((50, 20.0), (99, 100.0)):
            yield at_most(f"live: from publishing to the estimate published, p{percent}, 2000 samples/s",
                          float(np.percentile(took, percent)), most, "ms", SOURCE)  # fmt: skip
    finally:
        service.terminate()
        service.wait(30)
        broker.terminate()
        broker.wait(10)


def _warm(client, came: dict[str, float]) -> None:
    """Publish until every series answers."""
    for t in range(60):
        for i in range(TOPICS):
            client.publish(f"in/s{i}", json.dumps({"time": 1e9 + t, "value": float((t * 7 + i) % 5)}), qos=1)
        time.sleep(0.2)
        if len({key[: key.index("1000000")] for key in list(came)}) == TOPICS:
            return
    raise RuntimeError("the service does not answer")


def _pass(client, came: dict[str, float], found: list[tuple[str, bytes]]) -> None:
    """Publish, and return when the last estimate of every series is here."""
    last = {key + str(_last(payload)) for key, payload in found[-TOPICS:]}
    for key, payload in found:
        client.publish(f"in/{key}", payload, qos=1)
    while not last <= came.keys():
        time.sleep(0.01)


def _cpu(number: int) -> float:
    """Return the CPU seconds of a process so far."""
    fields = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _last(payload: bytes) -> float:
    times = json.loads(payload)["time"]
    return times[-1] if isinstance(times, list) else times


def _latency(client, came: dict[str, float], at: int) -> list[float]:
    """Return seconds from publishing to the estimate, at 2000 samples a second for five seconds."""
    sent: dict[str, float] = {}
    begun = time.perf_counter()
    for i, (key, payload) in enumerate(messages(10_000, 1, at)):
        while time.perf_counter() < begun + i / 2000:
            time.sleep(0.0005)
        sent[key + str(_last(payload))] = time.perf_counter()
        client.publish(f"in/{key}", payload, qos=1)
    time.sleep(1.0)
    return [came[name] - begun for name, begun in sent.items() if name in came]
