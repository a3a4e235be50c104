"""Every recording as the file it is: what `driftwise run FILE` tells of it, beside what is known to have changed.

``python -m driftwise_studies.score.raw_files`` prints a table, ``--page docs/raw-files.md`` writes it. A file is read
twice: nothing named (where `run` would ask, its likelier reading is taken, and the table says so), and the columns
named. Changes are all that were told, ``found.alarms``, not the few that the words list, and those that several columns
have in common (``found.together``), which are told where `run` asks, too. A date is one in hindsight:
"found" says that a change was dated near a known one, not how soon somebody watching would have been told.

What was told of a file is kept under ``out/raw_files``, by the commit's source and by the file, and is not read again:
the command goes on where it was broken off. Nothing is kept of sources that are not committed.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np

from driftwise.engine.errors import InputError

from .records import AIR, anomaly, columns, folder
from .worlds.judged import ROOT, git

DAY, YEAR = 86400.0, 365.25 * 86400.0
LONG = 2000  # rows above which the promise of 1 false change per 1000 is judged
PROMISE = 1.0  # false changes per 1000 rows
PUMP_SECONDS = 60.0  # within which the fault of the pump rig is to be dated
FLOW = "Volume Flow RateRMS"
SOURCES = "src", "studies/driftwise_studies/score/raw_files.py", "studies/driftwise_studies/score/records.py"
S, FEED = ("S1", "S2", "S3", "I1_set", "I3_set"), ("feed", "vapour", "cooling")


class Known(NamedTuple):
    """A documented change: seconds since the first row (rows, where the file has no clock), and how near is found."""

    what: str
    at: float
    reach: float


class Raw(NamedTuple):
    """A file, its columns as somebody who knows the plant would name them, and what is documented of it."""

    file: str
    output: str | None = None
    inputs: tuple[str, ...] | None = None  # None: left to be recognised
    known: tuple[Known, ...] = ()
    is_changing: bool = False  # something is documented to change, whether or not its date is among ``known``
    is_irregular: bool = False


class Told(NamedTuple):
    """What was said of a file."""

    output: str
    is_asked: bool  # `run` would have asked
    rows: int
    changes: int
    near: tuple[float | None, ...]  # of every known change: when it is told; None: it is not
    rmse: float
    last_value: float
    seconds: float

    @property
    def false(self) -> int:
        """Changes that are none of the known ones."""
        return self.changes - sum(at is not None for at in self.near)

    @property
    def per_thousand(self) -> float:
        """False changes per 1000 rows."""
        return 1000 * self.false / max(self.rows, 1)


DAM = float((np.datetime64("2011-11-26") - np.datetime64("2000-01-01")).astype(int)) * DAY
FILES = (
    Raw("air_quality_sensors.csv", "NO2(GT)", ("PT08.S4(NO2)", "T", "AH"), is_changing=True),
    Raw("hair_dryer.csv", "air_temp_V", ("heater_V",)),
    Raw("robot_arm.csv", "acceleration", ("reaction_torque",)),
    Raw("heating_system.csv", "temp_degC", ("drive_V",)),
    Raw("gas_furnace.csv", "co2_percent", ("gas_rate",), is_changing=True),
    Raw("heat_exchanger.csv", "outlet_temp", ("flow",),
        (Known("k = 800", 800, 100), Known("k = 2000", 2000, 100)), is_changing=True),
    Raw("hydraulic_hanging_load.csv", "position", ("reference",), is_changing=True),
    Raw("dc_motor_hoop_random.csv", "speed_V", ("u",), (Known("reversal", 410.0, 10.0),), is_changing=True),
    Raw("emps_train.csv", "position_m", ("u_V",)),
    Raw("leaf_cell_hppc_25C.csv", "voltage_V", ("current_A",), is_irregular=True),
    Raw("nasa_battery_B0005.csv", "voltage_V", ("current_A",), is_changing=True, is_irregular=True),
    Raw("building_heat_load.csv", "heatload_kW", ("Ta_obs_degC", "I_obs_Wm2")),
    Raw("mur_groundwater.csv", "head_m", ("river_m", "prec_mm", "evap_mm"),
        (Known("the dam", DAM, 60 * DAY),), is_changing=True),
    Raw("canning_rainfall_flow.csv", "flow_mm", ("rain_mm", "pet_mm")),
    Raw("ahu_faults_szvav.csv", "Supply_Air_T", tuple(AIR), is_changing=True),
    Raw("soldering_station.csv", "temperature", ("setpoint",), is_irregular=True),
    Raw("nile.csv", "flow_1e8m3", (), (Known("1899", 28 * YEAR, 3 * YEAR),), is_changing=True),
    Raw("second/emps_pulses.csv", "position_m", ("u_V",)),
    Raw("second/ball_beam.csv", "ball_position", ("beam_angle",)),
    Raw("second/cd_player_arm.csv", "y1", ("u1", "u2")),
    Raw("second/winding.csv", "T1", S),
    Raw("second/evaporator.csv", "out_flow", FEED),
    Raw("second/thermic_wall.csv", "heat_flow", ("T_in", "T_out")),
    Raw("second/hydraulic_cylinders.csv", "pos1", ("ref1", "ref2")),
    Raw("second/leaf_cell_hppc_40C.csv", "voltage_V", ("current_A",), is_irregular=True),
    Raw("second/nasa_battery_B0006.csv", "voltage_V", ("current_A",), is_changing=True, is_irregular=True),
    Raw("second/wye_rainfall_flow.csv", "flow_mm_h", ("rain_mm_h",)),
    Raw("second/ahu_faults_szcav.csv", "Supply_Air_T", tuple(AIR), is_changing=True),
    Raw("second/uk_seatbelts.csv", "drivers", ("kms", "PetrolPrice"),
        (Known("the law", 169 / 12 * YEAR, 0.5 * YEAR),), is_changing=True),
    Raw("skab/anomaly_free.csv", FLOW),
)  # fmt: skip


def pump_rig(where: Path) -> Iterator[Raw]:
    """Return the labelled files of the pump rig, of both sets: the fault begins and ends."""
    for one in (where, where / "second"):
        for path in sorted((one / "skab").glob("*.csv")):
            if path.name == "anomaly_free.csv":
                continue
            stamps = np.asarray(columns(path, ";")["datetime"]).astype("datetime64[s]")
            rows = np.flatnonzero(anomaly(one, path.name))
            seconds = (stamps - stamps[0]).astype(float)
            ends = zip(("onset", "end"), (rows[0], rows[-1]))
            known = tuple(Known(what, float(seconds[row]), PUMP_SECONDS) for what, row in ends)
            yield Raw(str(path.relative_to(where)), FLOW, None, known, True)


def read(raw: Raw, where: Path, is_named: bool) -> Told:
    """Return what is told of a file, its columns named or not."""
    import driftwise as dw

    began = perf_counter()
    named = {"output": raw.output, "input": raw.inputs} if is_named else {}
    found = dw.identify(str(where / raw.file), **named)
    apart = [one for one in found.together if not any(spans(one, change) for change in found.changes)]
    free, near = [*found.changes, *apart], []
    for known in raw.known:
        close = [c for c in free if abs(c.time - known.at) <= known.reach]
        best = min(close, key=lambda c: abs(c.time - known.at), default=None)
        if best is not None:
            free.remove(best)
        near.append(None if best is None else float(best.time))
    return Told(
        str(found.table.output), found.is_ambiguous, len(found.forecast.y), found.alarms + len(apart), tuple(near),
        found.quoted.rmse, found.naive["last value"], perf_counter() - began,
    )  # fmt: skip


def spans(one, other) -> bool:
    """Say whether two changes may be one: their intervals have an instant in common."""
    return bool(one.times[0] <= other.times[1] and other.times[0] <= one.times[1])


def kept_at(where: Path) -> Path | None:
    """Return the folder of what the committed sources say, made if need be; None where they are not committed."""
    try:
        is_changed = git("status", "--porcelain", "--", *SOURCES)
        sources = "".join(git("rev-parse", f"HEAD:{source}") for source in SOURCES)
    except (InputError, OSError):
        return None
    if is_changed:
        return None
    found = where / hashlib.sha256(sources.encode()).hexdigest()[:12]
    found.mkdir(parents=True, exist_ok=True)
    return found


def remembered(raw: Raw, where: Path, is_named: bool, kept: Path | None) -> Told | str:
    """Return what is told of a file, or why it is refused: as it was kept, else read now and kept."""
    asked = hashlib.sha256(repr((raw, is_named)).encode() + (where / raw.file).read_bytes()).hexdigest()[:16]
    place = None if kept is None else kept / f"{asked}.json"
    if place is not None and place.is_file():
        before = json.loads(place.read_text())
        return before if isinstance(before, str) else Told(**{**before, "near": tuple(before["near"])})
    try:
        told: Told | str = read(raw, where, is_named)
    except InputError as error:
        print(f"REFUSED: {raw.file}: {error}", file=sys.stderr, flush=True)
        told = f"refused: {type(error).__name__}"
    if place is not None:
        begun = place.with_suffix(".begun")
        begun.write_text(json.dumps(told if isinstance(told, str) else told._asdict()))
        begun.replace(place)  # whole, or not there
    return told


class Line(NamedTuple):
    """A file, and what was told of it: nothing named, columns named; or why nothing was."""

    raw: Raw
    told: tuple[Told | str, ...]


def measure(where: Path, only: str = "", kept: Path | None = None) -> Iterator[Line]:
    """Return a line for every file that is there; an absent one, or one that is refused, is a line too."""
    for raw in (*FILES, *pump_rig(where)):
        if only not in raw.file:
            continue
        if not (where / raw.file).is_file():
            print(f"ABSENT: {where / raw.file}", file=sys.stderr, flush=True)
            yield Line(raw, ("absent", "absent"))
            continue
        line = Line(raw, tuple(remembered(raw, where, is_named, kept) for is_named in (False, True)))
        print(table_rows(line), file=sys.stderr, flush=True)  # a run that is broken off has told this much
        yield line


def cells(raw: Raw, told: Told | str) -> list[str]:
    """Return the cells of one reading."""
    if isinstance(told, str):
        return [told, "", "", "", "", ""]
    dated = [
        f"{known.what}: " + ("missed" if at is None else f"{at - known.at:+.0f} s" if known.reach < DAY else "found")
        for known, at in zip(raw.known, told.near)
    ]
    return [
        told.output + (" (asks)" if told.is_asked else ""), f"{told.rows}", f"{told.changes}",
        f"{told.per_thousand:.2f}", "; ".join(dated), f"{told.rmse / told.last_value:.3f}",
    ]  # fmt: skip


HEAD = ("file", "named", "output", "rows", "changes told", "not known, per 1000", "known ones", "rmse / last value")


def table(lines: list[Line]) -> str:
    """Return everything as a table of Markdown."""
    rows = ["| " + " | ".join(HEAD) + " |", "|" + "---|" * len(HEAD)]
    return "\n".join([*rows, *map(table_rows, lines)])


def table_rows(line: Line) -> str:
    """Return the two rows of a file."""
    told = zip(("nothing", "columns"), line.told)
    return "\n".join("| " + " | ".join([line.raw.file, name, *cells(line.raw, one)]) + " |" for name, one in told)


def verdicts(lines: list[Line]) -> Iterator[str]:
    """Return, in words, what of the promises is met: what is absent or refused counts as not met."""
    for k, name in enumerate(("nothing named", "columns named")):
        seen = [(line.raw, line.told[k]) for line in lines]
        read_ones = [(raw, told) for raw, told in seen if isinstance(told, Told)]
        yield f"{name}: {len(read_ones)} of {len(seen)} files read, {sum(t.is_asked for _, t in read_ones)} asked about"
        steady = [(raw, told) for raw, told in read_ones if not raw.is_changing and told.rows > LONG]
        above = [f"{raw.file} {t.per_thousand:.2f}" for raw, t in steady if t.per_thousand > PROMISE]
        yield (
            f"{name}: false changes <= {PROMISE:g} per 1000 on {len(steady) - len(above)} of {len(steady)} records of "
            f"more than {LONG} rows without a known change" + _but(above)
        )
        rig = [told for raw, told in seen if FLOW == raw.output and raw.known]
        onsets = sum(isinstance(t, Told) and t.near[0] is not None for t in rig)
        yield f"{name}: pump rig, fault dated within {PUMP_SECONDS:.0f} s in {onsets} of {len(rig)} files"
        others = [(raw, told) for raw, told in seen if raw.output != FLOW and raw.known]
        missed = [
            f"{raw.file} {known.what}"
            for raw, told in others
            for j, known in enumerate(raw.known)
            if not (isinstance(told, Told) and told.near[j] is not None)
        ]
        total = sum(len(raw.known) for raw, _ in others)
        yield f"{name}: other documented changes found {total - len(missed)} of {total}" + _but(missed)
        clocks = [(raw, told) for raw, told in seen if raw.is_irregular]
        worse = [raw.file for raw, t in clocks if not (isinstance(t, Told) and t.rmse <= t.last_value)]
        yield (
            f"{name}: irregular clocks no worse than the last value {len(clocks) - len(worse)} of {len(clocks)}"
            + _but(worse)
        )


def _but(names: list[str]) -> str:
    return f" (not: {', '.join(names)})" if names else ""


def page(lines: list[Line]) -> str:
    """Return the page of the documentation."""
    said = "\n".join(f"- {verdict}" for verdict in verdicts(lines))
    about = " ".join((__doc__ or "").split("\n\n")[1].replace("``", "`").split())
    return f"# Recordings as the files they are\n\n{about}\n\n{said}\n\n{table(lines)}\n"


def main(arguments=None) -> None:
    """Read, print, and write the page where one is asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--data", help="the folder of recordings (DRIFTWISE_DATA)")
    parser.add_argument("--only", default="", help="files with this in their name")
    parser.add_argument("--keep", type=Path, default=ROOT / "out" / "raw_files", help="where readings are kept")
    parser.add_argument("--page", type=Path, help="write this page of Markdown (everything only)")
    asked = parser.parse_args(arguments)
    if asked.page and asked.only:
        parser.error("the page has everything on it: --page and --only cannot be used together")
    lines = list(measure(folder(asked.data), asked.only, kept_at(asked.keep)))
    text = page(lines)
    print(text)
    if asked.page:
        asked.page.write_text(text)


if __name__ == "__main__":
    main()
