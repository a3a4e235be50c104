"""A case: files, a command on them, and what the command may do to what is there already."""

from __future__ import annotations

import shutil
import signal
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from . import packed, plots, tables
from .trial import CODES, SECONDS, SILENT, Outcome, attempt, faults

OLD = {".html": b"<html>old</html>", ".json": b'{"old": 1}', ".csv": b"old,1\n", ".parquet": b"old"}


@dataclass
class Case:
    """Files by name, a command, and what was done to them in words."""

    files: dict[str, bytes]
    args: list[str]
    told: str = ""
    stdin: bytes | None = None
    options: dict = field(default_factory=dict)  # of `attempt`

    codes: set[int] = field(default_factory=lambda: CODES)
    seconds: float = SECONDS  # of CPU that it may take
    is_silent: bool = False  # whether nobody is there who could hear why it was refused
    folder: str | None = None  # where its own folder is made


def try_case(case: Case) -> tuple[list[str], Outcome]:
    """Run a case in a folder of its own; return what is wrong with what came of it, and the outcome."""
    folder = Path(tempfile.mkdtemp(prefix="hostile-", dir=case.folder))
    try:
        for name, data in case.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
        read = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
        written: dict[Path, bytes | None] = dict(read)
        for at, arg in enumerate(case.args[:-1]):
            if arg in ("--report", "--json", "--save") and case.args[at + 1] != "-":
                path = folder / case.args[at + 1]
                written.setdefault(path, None)
        outcome = attempt(case.args, folder, case.stdin, **case.options)
        if not folder.exists():  # the trouble was that it is deleted
            written = {}
        wrong = faults(outcome, written, case.codes, case.seconds)
        return [line for line in wrong if not (case.is_silent and line == SILENT)], outcome
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def with_targets(args: list[str], rng, files: dict, save: bool = False) -> list[str]:
    """Return a command that also writes something, sometimes over what is there."""
    found = list(args)
    for option, ending in (("--report", ".html"), ("--json", ".json"), ("--save", ".csv"), ("--save", ".parquet")):
        if option not in found and (option != "--save" or save) and rng.random() < 0.3:
            name = f"out{ending}"
            found += [option, name]
            if rng.random() < 0.5:
                files[name] = OLD[ending]
    return found


MODELS = ["arx:1,1,1", "arx:2,2,0", "armax:1,1,1,1", "oe:1,1,1", "bj:1,1,1,1,1", "ar:2", "arma:1,1", "regression"]
MEMORIES = ["constant", "auto", "restart", "exponential:0.99", "random-walk:1e-4", "window:20", "imm", "bank"]


def a_table(rng, automatic: float = 0.2) -> Case:
    """Return a run, a comparison or a fleet on a hostile table."""
    table = tables.hostile(rng)
    ending, data = packed.wrapped(table.to_bytes(), rng)
    told = ", ".join(table.told)
    if rng.random() < 0.15:
        ending, data, told = ".parquet", packed.parquet(rng), "parquet"
    name = f"table{ending}"
    files = {name: data}
    names = table.names if rng.random() < 0.3 else ["t", "u", "y"]
    columns = ["-o", names[-1], "-i", names[1 % len(names)]] + (["-t", names[0]] if rng.random() < 0.5 else [])
    is_stream = rng.random() < 0.1
    place = "-" if is_stream else name
    draw = rng.random()
    if draw < automatic:
        args = ["run", place]
    elif draw < 0.85:
        args = ["run", place, *columns]
        if rng.random() < 0.6:
            args += ["--model", str(rng.choice(MODELS))]
        if rng.random() < 0.4:
            args += ["--memory", str(rng.choice(MEMORIES))]
        if rng.random() < 0.1:
            args += ["--smooth", "all"]
        if rng.random() < 0.1:
            args += ["--from", str(rng.choice(["0", "10", "2024-03-30", "x", "1e400"]))]
    elif draw < 0.92:
        args = ["compare", place, "arx:1,1,1", "last", *columns]
    else:
        args = ["fleet", "run", name, "--by", names[0], "-o", names[-1], "--out", "fleet", "-q"]
    if args[0] != "fleet":
        args = with_targets(args, rng, files, save=args[0] == "run")
    return Case(files, args, f"{told} as {ending}", data if is_stream else None)


def some_plots(rng) -> Case:
    """Return a tracker on plots of any format, damaged."""
    name, data, told = plots.hostile(rng)
    files = {name: data}
    args = ["track", name, "-q"]
    if rng.random() < 0.5:
        args += ["--site", "46.2,15.1,800"]
    if rng.random() < 0.3:
        args += ["--single"]
    stdin, ended = None, {}
    if rng.random() < 0.3:
        args += ["--follow"]
        if rng.random() < 0.7:
            args[1], stdin = "-", data
        else:  # a file that grows is followed until Ctrl-C
            ended = {"ended_by": signal.SIGINT, "after": 3.0}
    args = with_targets(args, rng, files)
    if rng.random() < 0.3:
        args += ["--out", "tracks", "--format", "csv,kml,geojson"]
    return Case(files, args, told, stdin, ended)


VALUES = [
    "", "-1", "0", "1e9", "99999999999999999999", "nan", "inf", "-inf", "1e-400", "x", "\u22121", "1,1", ":", "auto:",
    "a" * 3000, "\x1b[31m", "[/]", "--", "\u0661", "1/0", "../..", "%n", "list", "arx:1,1,1@auto", "arx:",
    "arx:1e3,1,1", "arx:9999,1,1", "arx:-1,1,1", "arx:1,1/2/3,1", "polynomial:nan", "random-walk:-1", "exponential:2",
    "window:1e12", "window:-3", "drift:inf", "parameters:0", "level:1e300", "glr:10,1e9",
]  # fmt: skip
OPTIONS = [
    "--order", "--orders", "--noise", "--model", "--memory", "--jumps", "--smooth", "--gate", "--offset", "--dt",
    "--from", "--to", "--save", "--report", "--json", "--plant", "--input", "--output", "--time", "--chunk",
]  # fmt: skip


def odd_options(rng) -> Case:
    """Return an honest table, and options that no page of help suggests."""
    table = tables.plain(rng, 30)
    args = ["run", "table.csv", "-o", "y", "-i", "u"]
    for _ in range(int(rng.integers(1, 4))):
        args += [str(rng.choice(OPTIONS)), str(rng.choice(VALUES))]
    return Case({"table.csv": table.to_bytes()}, args, "odd options")


KINDS = {"tables": (a_table, 5), "plots": (some_plots, 2), "options": (odd_options, 1)}


def drawn(rng: np.random.Generator) -> Case:
    """Return any case."""
    weights = np.array([weight for _, weight in KINDS.values()], float)
    return list(KINDS.values())[int(rng.choice(len(weights), p=weights / weights.sum()))][0](rng)
