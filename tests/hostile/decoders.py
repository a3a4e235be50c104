"""What decodes bytes that nobody vouches for: each door by a name, what it may raise, and where its inputs begin."""

from __future__ import annotations

import contextlib
import io
import json
import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

import driftwise as dw
from driftwise.models.formulas import library, read

from . import formulas, packed, plots, tables

LONGEST = 1 << 14  # bytes of an input


@dataclass(frozen=True)
class Decoder:
    """A door: ``take`` reads bytes and may raise `InputError`, nothing else; ``seeds`` returns honest inputs."""

    take: Callable[[bytes], object]
    seeds: Callable[[], list[bytes]]


@cache
def _folder() -> Path:
    """Return a folder in memory where the system has one."""
    return Path(tempfile.mkdtemp(prefix="fuzz-", dir="/dev/shm" if os.path.isdir("/dev/shm") else None))


def _file(name: str, data: bytes) -> Path:
    path = _folder() / f"{os.getpid()}-{name}"
    path.write_bytes(data)
    return path


# --- tables ------------------------------------------------------------------------------------------------------


def take_table(data: bytes) -> None:
    """Read a delimited table to its end, every column as numbers."""
    from driftwise.tables.cells import converted, kind_of
    from driftwise.tables.csvfile import CsvSource

    source = CsvSource(io.BytesIO(data), len(data))
    for arrays, _ in source.batches(list(source.names)):
        for array in arrays[:20]:
            converted(array, kind_of(array, source.decimal, source.day_first), source.decimal, source.day_first)


def take_recognised(data: bytes) -> None:
    """Recognise a table that nobody described, and read it onto a regular clock."""
    from driftwise.tables.autoread import gathered, read

    _, segments = read(str(_file("t.csv", data)))
    for _ in gathered(segments, 1000):
        pass


def take_parquet(data: bytes) -> None:
    """Read a Parquet file to its end."""
    from driftwise.tables.record import open_record

    record = open_record(str(_file("t.parquet", data)), "y", ("u",), "t")
    for _ in record:
        pass


def _tables() -> list[bytes]:
    rng = np.random.default_rng(1)
    return [tables.plain(rng, 8).to_bytes() for _ in range(12)] + [
        tables.hostile(rng, 8).to_bytes()[:4000] for _ in range(60)
    ]


# --- plots -------------------------------------------------------------------------------------------------------


def take_asterix(data: bytes) -> None:
    """Decode ASTERIX, raw or captured."""
    from driftwise.tracking.formats.asterix import read_asterix

    read_asterix(data, {"25/201": (46.2, 15.1, 800.0)})


def take_plots(data: bytes) -> None:
    """Read plots of any kind."""
    from driftwise.tracking.read import read_plots

    read_plots(str(_file("p.bin", data)), site=(46.2, 15.1))


def take_live(data: bytes) -> None:
    """Read plots as they come, in pieces."""
    from driftwise.tracking.live_plots import LivePlots

    live, half = LivePlots("live", (46.2, 15.1)), len(data) // 2
    half = data.rfind(b"\n", 0, half) + 1
    for piece in (data[:half], data[half:]):
        if piece:
            live.take(piece)


BLOCK = "300030fdf70219c9356d4da0c5aff1e0020005283c660c10c236d4182001c0780031bc0000400deb07b9582e410020f5"


def _asterix() -> list[bytes]:
    rng, found = np.random.default_rng(2), [bytes.fromhex(BLOCK), bytes.fromhex(BLOCK) * 3, plots.cat048(None, 4)]
    for category in (1, 2, 8, 10, 19, 20, 21, 34, 48, 62, 63, 65, 247):
        for _ in range(3):
            body = rng.integers(0, 256, int(rng.integers(5, 60))).astype(np.uint8).tobytes()
            found.append(bytes([category]) + (3 + len(body)).to_bytes(2, "big") + body)
    capture = b"\xd4\xc3\xb2\xa1\x02\x00\x04\x00" + bytes(8) + b"\xff\xff\0\0\x01\0\0\0"
    packet = bytes(12) + b"\x08\x00" + b"\x45\0\0\x4c" + bytes(5) + b"\x11" + bytes(10) + b"\0\1\0\1\0\x38\0\0"
    packet += bytes.fromhex(BLOCK)
    size = len(packet).to_bytes(4, "little")
    return [*found, capture + bytes(8) + size + size + packet]


def _plots() -> list[bytes]:
    rng = np.random.default_rng(3)
    return [make(rng, 4) for make in plots.FORMATS.values()] + [plots.LAUGHS, plots.OUTSIDE]


# --- saved files -------------------------------------------------------------------------------------------------


def _estimator():
    return dw.ARX(2, 1, memory=dw.RestartOnChange(dw.detect.PageHinkley()))


def take_state(data: bytes) -> None:
    """Load the state of an estimator."""
    dw.load_state(_file("s.json", data))


def take_trace(data: bytes) -> None:
    """Load a trace."""
    dw.Trace.load(_file("s.npz", data))


def take_tracker(data: bytes) -> None:
    """Load a tracker."""
    dw.tracking.Tracker.load(_file("k.npz", data))


def _states() -> list[bytes]:
    rng, found = np.random.default_rng(4), []
    for est in (_estimator(), dw.AR(1), dw.Joint(1, memory=dw.Constant())):
        trace = est.scan(rng.standard_normal(9), rng.standard_normal(9) if est.model.inputs else None)
        path = _folder() / "seed.json"
        dw.save_state(est, trace.state, path)
        found.append(path.read_bytes())
    for est in (dw.StateSpace([[1, 1], [0, 0.9]], H=[1, 0], Q=[0, 0.1], R=1.0), dw.GreyBox("tank", start=None)):
        trace = est.scan(rng.standard_normal(9), rng.standard_normal(9) if est.model.inputs else None)
        dw.save_state(est, trace.state, path)
        found.append(path.read_bytes())
    return found


def _traces() -> list[bytes]:
    rng, path = np.random.default_rng(5), _folder() / "seed.npz"
    _estimator().scan(rng.standard_normal(9), rng.standard_normal(9)).save(path)
    return [path.read_bytes()]


def _trackers() -> list[bytes]:
    from driftwise.tracking.plots import plots as made

    tracker, time, path = dw.tracking.Tracker("boat"), np.arange(6.0), _folder() / "seed-k.npz"
    tracker.feed(made(time, np.stack([3 * time, 4 * time], axis=1)))
    tracker.save(path)
    return [path.read_bytes()]


# --- settings ----------------------------------------------------------------------------------------------------


def take_words(data: bytes) -> None:
    """Make an estimator of what stands behind --model, --memory and --jumps, a line each."""
    from driftwise.cli import specs

    lines = [line.replace("\0", "") for line in data.decode("utf-8", "replace").split("\n")] + [""] * 3
    specs.recursive(lines[0], ("u",), memory=specs.policy(lines[1] or "constant", lines[2] or None), dt=1.0)


def _words() -> list[bytes]:
    from .cases import MEMORIES, MODELS, VALUES

    jumps = ["", "parameters:10000", "level:1000,2", "noise:1 per 10_000", "glr:1000,20"]
    found = [f"{m}\n{w}\n{j}" for m in MODELS for w in MEMORIES[:4] for j in jumps]
    return [text.encode() for text in found + [f"arx:1,1,1\n{v}\n{v}" for v in VALUES]]


def take_plant(data: bytes) -> None:
    """Read a known plant."""
    from driftwise.tables.plantfile import read

    read(str(_file("p.toml", data)), ["y"], ["u"])


def _plants() -> list[bytes]:
    from driftwise.tables.plantfile import EXAMPLE

    return [EXAMPLE.encode(), EXAMPLE.replace("frequency", "degree = 1 #").replace("learn", "tune").encode()]


def take_formulas(data: bytes) -> None:
    """Read a plant in formulas, as text and from a file, and look at what would be compiled of it."""
    with contextlib.suppress(dw.InputError):
        read(str(_file("f.toml", data)))
    formulas.take(data.decode("utf-8", "replace"))


def _formulas() -> list[bytes]:
    odd = [text.encode("utf-8", "replace") for text in formulas.written().values()]
    return [formulas.HONEST.encode(), *(read(name).text.encode() for name in library()), *odd]


def take_sites(data: bytes) -> None:
    """Read where radars stand: TOML, JSON or CSV, by its ending."""
    from driftwise.tracking.sites import read_sites

    for ending in ("toml", "json", "csv"):
        with contextlib.suppress(dw.InputError):
            read_sites(str(_file(f"s.{ending}", data)))


def _sites() -> list[bytes]:
    table = {"25/201": [46.2, 15.1, 800]}
    return [
        b"sac,sic,latitude,longitude,height\n25,201,46.2,15.1,800\n", json.dumps(table).encode(),
        b'["25/201"]\nlatitude = 46.2\nlongitude = 15.1\nheight = 800\n', b'"25/201" = [46.2, 15.1, 800]\n',
    ]  # fmt: skip


DECODERS = {
    "table": Decoder(take_table, _tables),
    "recognised": Decoder(take_recognised, _tables),
    "parquet": Decoder(take_parquet, lambda: [packed.parquet(np.random.default_rng([6, i])) for i in range(20)]),
    "asterix": Decoder(take_asterix, _asterix),
    "plots": Decoder(take_plots, lambda: _plots() + _asterix()),
    "live": Decoder(take_live, _plots),
    "state": Decoder(take_state, _states),
    "trace": Decoder(take_trace, _traces),
    "tracker": Decoder(take_tracker, _trackers),
    "words": Decoder(take_words, _words),
    "plant": Decoder(take_plant, _plants),
    "formulas": Decoder(take_formulas, _formulas),
    "sites": Decoder(take_sites, _sites),
}
