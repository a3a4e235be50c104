"""Things to try: a real record that comes along, and tables of known plants."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from driftwise.cli.automatic import AutomaticJob
from driftwise.cli.specs import floats
from driftwise.engine.errors import CommandError, InputError
from driftwise.report.printed import say

OPTIONS = "--output track_deg --input roll_deg --time time_s"


@dataclass
class DemoJob:
    """Estimate a real record that comes along: an airliner's turns, and how hard it must bank as it gathers speed."""

    report: Annotated[str | None, typer.Option(help="Write a self-contained HTML report.")] = None

    def run(self) -> None:
        """Identify the flight that comes with the package and say what to type for another table."""
        file = str(Path(__file__).parent.parent / "data" / "flight.csv")
        say("An airliner takes off, climbs and gathers speed, and turns a few times:")
        say("its track and its roll, every 2 s, from its own radio messages. Model and memory are found out.")
        AutomaticJob(file, ["track_deg"], ["roll_deg"], "time_s", report=self.report).run()
        say("\nWhat physics says: track is the integral of roll (a pole at 1), with a gain of 2 s x g / speed that")
        say("falls from 0.158 at 124 m/s to 0.086 at 227 m/s, to 0.54 of it. Nobody told the filter: the answer above")
        say("says what it found of the gain from roll_deg.")
        say(f"\nThis was:  driftwise run {file} \\")
        say(f"               {OPTIONS} \\")
        say(f"               --report {self.report or 'report.html'}")
        say("Your own:  driftwise run FILE --report report.html")


@dataclass
class SimulateJob:
    """Write a table t, u, y of a known plant, to try things on.

    Example: driftwise simulate plant.csv --a -1.5,0.7 --b 1,0.5 --missing 0.1
    """

    file: Annotated[str, typer.Argument(help="CSV to write; - for standard output.")] = "-"
    a: Annotated[
        str | None,
        typer.Option("--a", help="a1,a2,.. of A(q) = 1 + a1/q + ..; a random stable plant if omitted."),
    ] = None
    b: Annotated[str | None, typer.Option("--b", help="b1,b2,.. of the input; as long as --a.")] = None
    direct: Annotated[float | None, typer.Option(help="b0: the input acts at once.")] = None
    order: Annotated[int, typer.Option("--order", "-n", min=1, max=20, help="Order of the random plant.")] = 2
    samples: Annotated[int, typer.Option(min=1, help="Number of samples.")] = 1000
    noise_std: Annotated[float, typer.Option(min=0, help="Standard deviation of the noise.")] = 0.1
    noise: Annotated[str, typer.Option(help="equation (through the dynamics) or output (on the measurement).")] = (
        "equation"
    )
    missing: Annotated[float, typer.Option(min=0, max=1, help="Fraction of the outputs to lose.")] = 0.0
    dt: Annotated[float, typer.Option(help="Seconds between samples.")] = 1.0
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same table.")] = 0

    def run(self) -> None:
        """Write t, u, y as CSV and say on standard error what the plant is."""
        from driftwise.models.simulation import simulate

        names = ("samples", "noise_std", "noise", "direct", "missing", "seed")
        try:
            a, b = self._plant()
            y, u = simulate(a, b, **{name: getattr(self, name) for name in names})
        except InputError as error:
            raise CommandError(str(error)) from None
        _write(self.file, y, u, self.dt)
        plant = f"a = {', '.join(f'{v:.6g}' for v in a)}"
        if b:
            plant += f"; b = {', '.join(f'{v:.6g}' for v in b)}"
        how = f"noise {self.noise_std:g} ({self.noise}), seed {self.seed}"
        say(f"{self.samples} samples of {plant}; {how}", stderr=True)

    def _plant(self):
        """Return a and b: those that were said, or of a random plant."""
        if self.a is None:
            if self.b is not None:
                raise InputError("--b is the numerator that goes with --a, which is not there; give both or none.")
            return random_plant(self.order, self.seed)
        a, b = floats("--a", self.a), floats("--b", self.b) if self.b is not None else None
        if b is not None and len(b) != len(a):
            raise InputError(f"--b must list as many numbers as --a ({len(a)}), got {len(b)}; fill up with zeros.")
        return a, b


def random_plant(order: int, seed: int):
    """Return (a, b) of a random stable plant with a static gain of one or so.

    Poles have sizes between 0.5 and 0.95; half of them come in pairs that ring.
    """
    import numpy as np

    rng = np.random.default_rng(seed)
    poles: list[complex] = []
    while len(poles) < order:
        size = rng.uniform(0.5, 0.95)
        if order - len(poles) >= 2 and rng.random() < 0.5:
            angle = rng.uniform(0.1, 1.2)
            poles += [size * np.exp(1j * angle), size * np.exp(-1j * angle)]
        else:
            poles.append(size)
    a = np.real(np.poly(poles))
    b = rng.uniform(0.2, 1.0, order)
    return a[1:].tolist(), (b * a.sum() / b.sum()).tolist()


def _write(file, y, u, dt):
    import numpy as np
    import pyarrow as pa
    from pyarrow import csv

    data = {"t": np.arange(len(y)) * dt}
    if u is not None:
        data["u"] = u
    data["y"] = pa.array(y, from_pandas=True)
    table = pa.table(data)
    try:
        if file == "-":
            with pa.output_stream(sys.stdout.buffer) as stream:
                csv.write_csv(table, stream)
        else:
            csv.write_csv(table, file)
    except OSError as error:
        raise InputError(f"{file} cannot be written ({error.strerror or error}). Does its folder exist?") from None
