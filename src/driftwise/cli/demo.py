"""Things to try: a real record that comes along, and tables of known plants."""

from __future__ import annotations

import sys

from driftwise.cli.specs import floats
from driftwise.engine.errors import InputError

__all__ = ["fly", "random_plant", "write_table"]


OPTIONS = "--output track_deg --input roll_deg --time time_s --model auto"


def fly(report: str | None) -> None:
    """Identify the flight that comes with the package and say what to type for another table."""
    from pathlib import Path

    from driftwise.cli.automatic import Automatic, execute

    file = str(Path(__file__).parent.parent / "data" / "flight.csv")
    print("An airliner takes off, climbs and gathers speed, and turns a few times:")
    print("its track and its roll, every 2 s, from its own radio messages. Model and memory are found out.")
    execute(Automatic(file, "track_deg", ("roll_deg",), "time_s", report=report))
    print("\nWhat physics says: track is the integral of roll (a pole at 1), with a gain b1 = 2 s x g / speed")
    print("that falls from 0.158 at 124 m/s to 0.086 at 227 m/s. Nobody told the filter; the report shows b1 falling.")
    print(f"\nThis was:  driftwise run {file} \\")
    print(f"               {OPTIONS} \\")
    print(f"               --report {report or 'report.html'}")
    print("Your own:  driftwise run FILE --report report.html")


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


def write_table(file, a, b, direct, order, samples, noise_std, noise, missing, dt, seed) -> None:
    """Write t, u, y as CSV and say on standard error what the plant is."""
    from driftwise.models.simulation import simulate

    if a is None:
        if b is not None:
            raise InputError("--b is the numerator that goes with --a, which is not there; give both or none.")
        a_list, b_list = random_plant(order, seed)
    else:
        a_list = floats("--a", a)
        b_list = floats("--b", b) if b is not None else None
        if b_list is not None and len(b_list) != len(a_list):
            raise InputError(
                f"--b must list as many numbers as --a ({len(a_list)}), got {len(b_list)}; fill up with zeros."
            )
    y, u = simulate(
        a_list,
        b_list,
        samples=samples,
        noise_std=noise_std,
        noise=noise,
        direct=direct,
        missing=missing,
        seed=seed,
    )
    _write(file, y, u, dt)
    plant = f"a = {', '.join(f'{v:.6g}' for v in a_list)}"
    if b_list:
        plant += f"; b = {', '.join(f'{v:.6g}' for v in b_list)}"
    print(f"{samples} samples of {plant}; noise {noise_std:g} ({noise}), seed {seed}", file=sys.stderr)


def _write(file, y, u, dt):
    import numpy as np
    import pyarrow as pa
    from pyarrow import csv

    data = {"t": np.arange(len(y)) * (dt or 1.0)}
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
