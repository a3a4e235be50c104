"""`driftwise fleet simulate`: pumps in a folder of Parquet, a few of them with faults that are known."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from driftwise.engine.errors import InputError
from driftwise.report.printed import say

A, B, NOISE = (-1.1, 0.3), (0.25, 0.12), 0.02  # of a pump as it should be; each differs by SPREAD
SPREAD = 0.02
SHARE, TOGETHER = 0.005, 0.03  # of the fleet, for each fault; of those that jump together
START, STEP = "2026-01-01", 60  # time stamp of the first sample, s between samples
ROWS = 250_000  # of a file
TRUTH = "_faults.csv"  # beside the data; a name with _ in front is no data
FAULTS = {
    "wears": "its gain falls steadily, by half in the end",
    "jumps": "its gain falls by half at once",
    "together": "its gain rises by half, at the same time as that of others",
    "stuck": "its speed never moves",
    "loud": "its noise is three times that of the others",
    "other make": "its dynamics are not those of the others",
    "bad data": "a third of its cells is empty, one in fifty infinite, rows come late or twice",
}


class Pump(NamedTuple):
    """A pump of the demonstration: what is wrong with it ("" for nothing), and from which sample on."""

    name: str
    fault: str
    sample: int


def pumps(series: int, samples: int, seed: int) -> list[Pump]:
    """Return who is in the fleet: sound pumps, and one in 200 (at least one) with each fault."""
    import numpy as np

    rng, together = np.random.default_rng([seed, 7]), round(0.6 * samples)
    counts = {fault: max(round(SHARE * series), 1) for fault in FAULTS} | {"together": max(round(TOGETHER * series), 3)}
    if series < 2 * sum(counts.values()):
        raise InputError(f"--series must be at least {2 * sum(counts.values())}, so that most are sound; got {series}.")
    faults = [fault for fault, count in counts.items() for _ in range(count)]
    where = dict(zip(rng.choice(series, len(faults), replace=False).tolist(), faults))
    when = rng.integers(round(0.4 * samples), round(0.8 * samples), series).tolist()
    first = {"jumps": lambda k: when[k], "together": lambda k: together}
    return [Pump(f"pump {k:05d}", where.get(k, ""), first.get(where.get(k, ""), lambda k: 0)(k)) for k in range(series)]


def write_fleet(folder, series: int = 1000, samples: int = 500, seed: int = 0) -> list[Pump]:
    """Write columns time, asset, speed, flow of a fleet as Parquet files, the faults as `TRUTH`; return the pumps."""
    import numpy as np
    import pyarrow as pa
    from pyarrow import parquet

    found = pumps(series, samples, seed)
    data = [_table(pump, k, samples, seed) for k, pump in enumerate(found)]
    time, speed, flow, who, when = (np.concatenate(column) for column in zip(*data))
    order = np.lexsort((who, when))
    table = pa.table({
        "time": pa.array(np.datetime64(START, "s") + (STEP * time[order]).astype("timedelta64[s]")),
        "asset": pa.DictionaryArray.from_arrays(who[order].astype(np.int32), [pump.name for pump in found]),
        "speed": speed[order],
        "flow": pa.array(flow[order], from_pandas=True),
    })  # fmt: skip
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _clear(folder)
        for k, first in enumerate(range(0, len(table), ROWS)):
            parquet.write_table(table.slice(first, ROWS), folder / f"part-{k:04d}.parquet", row_group_size=65_536)
        lines = [f"{p.name},{p.fault},{p.sample}\n" for p in found if p.fault]
        (folder / TRUTH).write_text("".join(["asset,fault,sample\n", *lines]), encoding="utf-8")
    except OSError as error:
        raise InputError(f"{folder} cannot be written to: {error.strerror or error}.") from None
    return found


def _clear(folder: Path) -> None:
    """Delete the fleet that was simulated here before; refuse data that are somebody's."""
    there = [path for path in folder.iterdir() if path.suffix in (".parquet", ".csv") and path.name != TRUTH]
    if there and not (folder / TRUTH).exists():
        raise InputError(f"{folder} holds data already ({there[0].name}): give another folder.")
    for path in folder.glob("part-[0-9][0-9][0-9][0-9].parquet"):
        path.unlink()


def _table(pump: Pump, number: int, samples: int, seed: int):
    """Return time (in steps), speed, flow, number of the pump, and when each row comes."""
    import numpy as np

    from driftwise.models.simulation import simulate

    rng, fault = np.random.default_rng([seed, number]), pump.fault
    a, b = (np.asarray(value) * (1 + SPREAD * rng.standard_normal(2)) for value in (A, B))
    u = np.repeat(rng.choice([-1.0, -0.6, 0.6, 1.0], samples), rng.integers(2, 9, samples))[:samples]
    path = np.ones(samples)
    if fault == "wears":
        path = np.linspace(1.0, 0.5, samples)
    elif fault in ("jumps", "together"):
        path[pump.sample :] = 0.5 if fault == "jumps" else 1.5
    elif fault == "stuck":
        u[:] = 0.0
    elif fault == "other make":
        a = a + [0.4, -0.1]
    noise = 3 * NOISE if fault == "loud" else NOISE
    y, _ = simulate(a, path[:, None] * b, u=u, noise_std=noise, seed=int(rng.integers(2**31)))
    time: np.ndarray = np.arange(samples)
    when = time.astype(float)
    speed, flow = 1450.0 + 60.0 * u, 120.0 + 8.0 * y
    if fault == "bad data":
        flow[rng.random(samples) < 1 / 3] = np.nan
        flow[rng.random(samples) < 1 / 50] = np.inf
        when += np.where(rng.random(samples) < 1 / 20, 2.5, 0.0)
        rows = np.repeat(time, np.where(rng.random(samples) < 1 / 20, 2, 1))
        time, when, speed, flow = time[rows], when[rows], speed[rows], flow[rows]
    return time, speed.round(2), flow.round(3), np.full(len(time), number), when


@dataclass
class FleetSimulateJob:
    """Write a fleet of pumps to try things on: columns time, asset, speed, flow, and faults that are known.

    Example: driftwise fleet simulate pumps --series 1000 --samples 500
    """

    folder: Annotated[str, typer.Argument(metavar="DIR", help="Folder to write Parquet files into.")]
    series: Annotated[int, typer.Option(min=1, help="Number of pumps.")] = 1000
    samples: Annotated[int, typer.Option(min=50, help="Samples of each.")] = 500
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same files.")] = 0

    def run(self) -> None:
        """Write the fleet, and say what is wrong with which pumps and what to type next."""
        found = write_fleet(self.folder, self.series, self.samples, self.seed)
        for fault, words in FAULTS.items():
            names = [pump.name for pump in found if pump.fault == fault]
            more = f" and {len(names) - 3} more" if len(names) > 3 else ""
            say(f"{', '.join(names[:3])}{more}: {words}")
        say(f"All of them stand in {Path(self.folder) / TRUTH}. Now find them:")
        columns = "--by asset --output flow --input speed --time time"
        say(f"  driftwise fleet run {self.folder} {columns} --out results")
