"""Tables as loggers, spreadsheets and statistics packages write them, of columns whose parts are known.

`write_table` takes signals and a random generator, and writes one file of `KINDS`: names of columns in several
languages, units here or there, dates in one of `table_stamps.WAYS`, and columns beside that mean nothing. What it
returns, `Written`, is the truth that an answer is held against.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .table_names import CLOCK_WORDS, THEMES, Theme
from .table_stamps import MONTH, WAYS, fitting

UNKNOWABLE = 0.15  # share of the files whose names say nothing


class Kind(NamedTuple):
    """How a program writes its files.

    header : "names", "units below", "titles", "titles and units", "group", "none", "comments"
    rows : what stands before each row: "", "index" (a column with a name or without), "R" (no name for it)
    ways : the ways of writing time that it may use, () for any
    """

    delimiter: str = ","
    decimal: str = "."
    header: str = "names"
    quote: str = ""
    rows: str = ""
    missing: str = ""
    ways: tuple[str, ...] = ()
    footer: str = ""


KINDS: dict[str, Kind] = {
    "plain": Kind(),
    "spreadsheet, German": Kind(";", ",", ways=("German", "German, short", "iso", "none", "months before years")),
    "spreadsheet, French": Kind(";", ",", ways=("British", "two columns, British", "iso"), missing="#N/A"),
    "spreadsheet, American": Kind(ways=("American", "American, short", "days of Excel"), quote="names"),
    "tabs": Kind("\t", ways=("seconds", "milliseconds", "iso", "Matlab", "spaces")),
    "oscilloscope": Kind(",", header="units below", ways=("plain t", "seconds")),
    "titles": Kind(header="titles"),
    "titles and units": Kind(";", header="titles and units", missing="---"),
    "TOA5": Kind(header="titles and units", quote="all", rows="record", missing="NAN", ways=("iso", "two zones")),
    "array logger": Kind(header="none", ways=("Campbell", "seconds"), missing="-6999"),
    "HOBO": Kind(header="titles", quote="names", rows="#", ways=("American", "American, short", "two columns")),
    "R write.table": Kind(" ", quote="names", rows="R", missing="NA"),
    "R write.csv": Kind(quote="names", rows="unnamed", missing="NA"),
    "pandas": Kind(rows="unnamed", ways=("iso", "iso days", "seconds", "none", "two zones", "months")),
    "SPSS": Kind("\t", rows="id", ways=("date in parts", "year and month", "day of year and hour"), missing="-9999"),
    "Stata": Kind(ways=("Stata", "months of Stata", "quarters", "years"), missing="."),
    "SAS": Kind(ways=("SAS", "iso", "date in parts"), missing="."),
    "Matlab": Kind("\t", ways=("Matlab", "plain t", "seconds"), missing="NaN"),
    "savetxt": Kind(" ", header="comments", missing="nan", ways=("plain t", "seconds", "none")),
    "numbers only": Kind(header="none", ways=("plain t", "none")),
    "LabVIEW": Kind("\t", header="titles", ways=("plain t", "seconds")),
    "SCADA": Kind(";", ".", "group", missing="Bad", ways=("iso", "German", "British", "summer time", "set back")),
    "weather service": Kind(
        ";", rows="station", missing="-999", ways=("compact", "compact number", "compact day", "day of year", "spaces")
    ),
    "economists": Kind(ways=("months", "quarters of R", "quarters", "months by name", "decimal years", "years")),
    "data base": Kind("|", rows="id", missing="NULL", ways=("iso T Z", "since 1970, ms", "since 1970", "iso")),
    "hydrology": Kind(ways=("day of year", "iso days", "date in parts", "year and hour beside"), missing="-99.99"),
    "with an end": Kind(header="titles", footer="End of data", ways=("iso", "British", "minutes")),
}

BESIDE = ("constant", "counter", "copy", "other unit", "flag", "battery", "remark", "sum", "shifted", "set point")
NAMELESS = re.compile(r"column\d+")  # what a column is called by its place
KILO = 1000.0  # of the output in another unit


@dataclass(frozen=True)
class Written:
    """The truth about a file.

    Attributes
    ----------
    path, kind, way, language : where it is, how it is written, how its time is, and in which language
    outputs, inputs : names of the columns as driftwise reads them (``column3`` where nothing names them)
    clocks : the columns that make its clock, the first or any of them counts; () for none
    dt : seconds between rows; 1 without a clock
    units : unit per name, as it is written
    affine : name -> (a, b): what is written is a + b times the signal that was handed over
    beside : name -> what it is, of columns that play no part; those called "copy" or "other unit" hold the output
    knows_output, knows_inputs : whether names or units say so to a reader of the field
    code : what stands for a lost cell, "" where nothing does
    lost : name -> how many cells of outputs and inputs are lost
    """

    path: Path
    kind: str
    way: str
    language: str
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    clocks: tuple[str, ...]
    dt: float
    units: dict[str, str]
    affine: dict[str, tuple[float, float]]
    beside: dict[str, str] = field(default_factory=dict)
    knows_output: bool = True
    knows_inputs: bool = True
    code: str = ""
    lost: dict[str, int] = field(default_factory=dict)

    def read_with(self, output: str) -> Written:
        """Return the truth for a reader who takes ``output``: of copies without names none says which is the first."""
        factor = {"copy": 1.0, "other unit": KILO}.get(self.beside.get(output, ""))
        if factor is None or not NAMELESS.fullmatch(output):
            return self
        a, b = self.affine[self.outputs[0]]
        beside = {name: what for name, what in self.beside.items() if name != output} | {self.outputs[0]: "copy"}
        affine = self.affine | {output: (factor * a, factor * b)}
        return replace(self, outputs=(output, *self.outputs[1:]), affine=affine, beside=beside)


def write_table(
    path,
    y,
    u,
    rng: np.random.Generator,
    *,
    dt: float | None = None,
    time=None,
    kind: str | None = None,
    way: str | None = None,
    beside: int | None = None,
    events: Mapping[str, np.ndarray] | None = None,
) -> Written:
    """Write a record as one of `KINDS` and return the truth about it.

    Parameters
    ----------
    path : file to write, with or without ``.csv``
    y : (T,) or (T, p) output, p at most 2; NaN where missing
    u : (T, k) inputs, k at most 3; (T, 0) or None for none
    rng : what is not said is drawn from it
    dt : seconds between rows; drawn to suit the kind where None
    time : (T,) seconds of each row, where rows are not ``dt`` apart (then give ``dt`` too, the usual step)
    kind, way : of `KINDS` and of `table_stamps.WAYS`
    beside : how many columns that play no part; drawn where None, 0 for none
    events : name -> (T,), columns that say when something was done

    Examples
    --------
    >>> import tempfile
    >>> rng = np.random.default_rng(3)
    >>> y, u = rng.normal(size=50), rng.normal(size=(50, 1))
    >>> truth = write_table(tempfile.mkdtemp() + "/one.csv", y, u, rng, kind="plain", way="iso", beside=0)
    >>> truth.path.read_text().splitlines()[0].count(",")
    2
    """
    y, u = np.asarray(y, float), np.zeros((len(y), 0)) if u is None else np.asarray(u, float)
    y, u = y.reshape(len(y), -1), u.reshape(len(u), -1)
    kind, way = _drawn_kind(rng, kind, way, dt, time is not None, len(y))
    made, written_as = KINDS[kind], WAYS[way]
    if way == "none":
        step = 1.0
    elif dt is not None:
        step = dt
    else:
        step = float(rng.choice(written_as.steps))
    seconds = np.arange(len(y)) * step if time is None else np.asarray(time, float)
    theme = _drawn_theme(rng, y.shape[1], u.shape[1])
    names = [*theme.outputs[: y.shape[1]], *theme.inputs[: u.shape[1]]]
    values = np.column_stack((y, u))
    affine = [_physical(values[:, j], unit, rng) for j, (_, unit) in enumerate(names)]
    values = np.column_stack([a + b * values[:, j] for j, (a, b) in enumerate(affine)])
    style = str(rng.choice(["brackets", "parentheses", "underscore", "comma", "none"], p=[0.3, 0.2, 0.2, 0.1, 0.2]))
    has_units_row = made.header in ("units below", "titles and units")
    if has_units_row or made.header == "none":
        style = "none"
    elif not all(unit.isascii() for _, unit in names) or not theme.is_knowable:
        style = "brackets" if style == "underscore" else style
    if style == "none" and _needs_units(theme) and not has_units_row:
        style = "brackets"
    columns = [(_named(name, unit, style), values[:, j]) for j, (name, unit) in enumerate(names)]
    truth = [name for name, _ in columns]
    units = {name: unit for name, (_, unit) in zip(truth, names)}
    count = int(rng.integers(0, 4)) if beside is None else beside
    added = _beside(rng, count, columns, y.shape[1], units, style)
    added += [(name, column, "event") for name, column in (events or {}).items()]
    missing = np.zeros(values.shape, bool)
    if made.missing and rng.random() < 0.6:  # a few cells were lost
        missing = rng.random(values.shape) < 0.01
        columns = [(name, np.where(missing[:, j], np.nan, column)) for j, (name, column) in enumerate(columns)]
    cells = [(name, _cells(column, made)) for name, column in [*columns, *((n, c) for n, c, _ in added)]]
    order = rng.permutation(len(cells)) if rng.random() < 0.5 else np.arange(len(cells))
    start = datetime(int(rng.integers(2001, 2022)), int(rng.integers(1, 12)), int(rng.integers(1, 27)))
    start += timedelta(hours=int(rng.integers(0, 23)) * (step < 86_400))
    if step >= 0.9 * MONTH:  # a century of months, no more
        start = start.replace(year=max(2020 - int(len(y) * step / 3.15e7), 1700), month=1, day=1, hour=0)
    stamps = written_as.write(seconds, start, str(rng.choice(CLOCK_WORDS[theme.language])))
    stamps = [(name, _decimal(column, made)) for name, column in stamps]
    body = [*_row_marks(made, len(y), rng), *stamps, *(cells[i] for i in order)]
    header = _unique([name.replace(" ", "_") if made.header == "comments" else name for name, _ in body])
    called = dict(zip((name for name, _ in body), header))
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    _write(path, made, kind, header, [column for _, column in body], [units.get(name, "") for name, _ in body], rng)
    if made.header == "none":
        called = {name: f"column{j + 1}" for j, (name, _) in enumerate(body)}
    is_knowable = theme.is_knowable and made.header != "none"
    return Written(
        path,
        kind,
        way,
        theme.language,
        tuple(called[name] for name in truth[: y.shape[1]]),
        tuple(called[name] for name in truth[y.shape[1] :]),
        tuple(called[name] for name, _ in stamps[: written_as.clocks]),
        step,
        {called[name]: unit for name, unit in units.items()},
        {called[name]: pair for name, pair in zip(truth, affine)},
        {called[name]: what for name, _, what in added},
        is_knowable,
        is_knowable,
        made.missing,
        {called[name]: int(np.isnan(column).sum()) for name, column in columns},
    )


def _drawn_kind(rng, kind, way, dt, is_irregular: bool, rows: int) -> tuple[str, str]:
    possible = [w for w in fitting(dt) if w != "none" or not is_irregular]
    possible = [w for w in possible if w != "years" or rows < 300]
    kinds = [k for k in KINDS if not KINDS[k].ways or set(KINDS[k].ways) & set(possible)]
    kind = kind or str(rng.choice(kinds))
    if way is None:
        way = str(rng.choice([w for w in (KINDS[kind].ways or possible) if w in possible] or possible))
    return kind, way


def _drawn_theme(rng, outputs: int, inputs: int) -> Theme:
    is_knowable = rng.random() > UNKNOWABLE
    fitting = [t for t in THEMES if len(t.outputs) >= outputs and len(t.inputs) >= inputs]
    fitting = [t for t in fitting if t.is_knowable == is_knowable]
    theme = fitting[int(rng.integers(len(fitting)))]
    outs, ins = rng.permutation(len(theme.outputs)), rng.permutation(len(theme.inputs))
    return theme._replace(outputs=tuple(theme.outputs[i] for i in outs), inputs=tuple(theme.inputs[i] for i in ins))


def _needs_units(theme: Theme) -> bool:
    """Whether names alone tell nothing, but units do."""
    return theme.is_knowable and theme.outputs[0][0][:1] + theme.inputs[0][0][:1] in ("TQ", "sc", "SX")


PHYSICAL = {"°C": (20.0, 4.0), "degC": (20.0, 4.0), "%": (50.0, 12.0), "rpm": (1500.0, 200.0), "W": (900.0, 200.0)}


def _physical(values, unit: str, rng) -> tuple[float, float]:
    """Return (a, b) that bring a signal where such a thing is measured."""
    spread, middle = float(np.nanstd(values)) or 1.0, float(np.nanmean(values))
    center, size = PHYSICAL.get(unit, (10.0 ** rng.uniform(0, 2), 10.0 ** rng.uniform(-1, 1)))
    if np.unique(values[np.isfinite(values)]).size <= 2:
        center = size  # a switch rests at a whole number
    b = float(f"{size / spread:.4g}")
    return float(f"{center - b * middle:.4g}"), b


def _named(name: str, unit: str, style: str) -> str:
    if not unit or style == "none":
        return name
    plain = {"%": "pct", "°C": "degC", "l/min": "lpm"}.get(unit, unit)
    return {
        "brackets": f"{name} [{unit}]",
        "parentheses": f"{name} ({unit})",
        "underscore": f"{name}_{plain}" if "/" not in plain else f"{name} [{unit}]",
        "comma": f"{name} in {unit}",
    }[style]


def _beside(rng, count: int, columns, outputs: int, units, style: str) -> list[tuple[str, Any, str]]:
    """Return (name, values, what) of columns that play no part."""
    T = len(columns[0][1])
    y_name, y = columns[0]
    u = [column for _, column in columns[outputs:]]
    possible = [what for what in BESIDE if what != "sum" or len(u) > 1]
    found = []
    for what in rng.choice(possible, min(count, len(possible)), replace=False):
        bare = y_name.split(" [")[0].split(" (")[0].split(" in ")[0]
        name, values = {
            "constant": ("station height", np.full(T, 412.0)),
            "counter": ("sample", np.arange(1.0, T + 1)),
            "copy": (f"{bare} copy", y),
            "other unit": (f"{bare} x1000", KILO * y),
            "flag": ("quality", (rng.random(T) < 0.02).astype(float)),
            "battery": (
                "battery [V]" if style != "none" else "battery",
                12.6 - 0.2 * np.arange(T) / T + _noise(rng, T),
            ),
            "remark": ("remark", np.where(rng.random(T) < 0.02, "checked", "ok")),
            "sum": ("total", np.sum(u, axis=0) if u else y),
            "shifted": (f"{bare} previous", np.concatenate((y[:1], y[:-1]))),
            "set point": (f"{bare} setpoint", np.full(T, float(f"{np.nanmean(y):.3g}"))),
        }[str(what)]
        found.append((name, values, str(what)))
    return found


def _noise(rng, T: int):
    return np.round(0.01 * rng.normal(size=T), 2)


def _cells(column, made: Kind) -> list[str]:
    if column.dtype.kind in "US":
        return [str(cell) for cell in column]
    fine = column[np.isfinite(column)]
    if fine.size and fine.min() == fine.max():
        return _decimal([f"{value:g}" if value == value else made.missing for value in column], made)
    spread = float(np.std(fine)) or 1.0
    digits = 0 if np.all(fine == np.round(fine)) else max(0, 4 - int(np.floor(np.log10(spread))))
    return _decimal([f"{value:.{digits}f}" if value == value else made.missing for value in column], made)


def _decimal(cells: list[str], made: Kind) -> list[str]:
    if made.decimal == ".":
        return cells
    return [cell.replace(".", ",") if cell.count(".") == 1 and ":" not in cell else cell for cell in cells]


def _row_marks(made: Kind, T: int, rng) -> list[tuple[str, list[str]]]:
    if not made.rows:
        return []
    first = 0 if made.rows in ("unnamed", "record") else 1
    count = [str(k) for k in range(first, first + T)]
    name = {"R": "", "unnamed": "", "record": "RECORD", "id": "id", "#": "#", "station": "STATIONS_ID"}[made.rows]
    return [(name, ["433"] * T if made.rows == "station" else count)]


def _unique(names: list[str]) -> list[str]:
    return [name if name not in names[:j] else f"{name}.{names[:j].count(name) + 1}" for j, name in enumerate(names)]


TITLES = (
    ("Plot Title: {kind}",),
    ("Serial number:;4711", "Station;North", "Interval;fixed"),
    ("Exported on 2024-02-29 by operator 7", ""),
    ("Measurement report", "Device: DL-200, firmware 3.1", "Channels: all", ""),
)


def _write(path: Path, made: Kind, kind: str, header, columns, units, rng) -> None:
    d = made.delimiter

    def line(cells, quoted=False) -> str:
        return d.join(f'"{cell}"' if quoted or d in cell else cell for cell in cells)

    out: list[str] = []
    if kind == "TOA5":
        out.append(line(["TOA5", "North", "CR1000", "4711", "CR1000.Std.32", "CPU:main.CR1", "1234", "Table1"], True))
    elif made.header in ("titles", "titles and units"):
        out += [text.format(kind=kind).replace(";", d) for text in TITLES[int(rng.integers(len(TITLES)))]]
    elif made.header == "group":
        out.append(line(["Plant 7"] + [""] * (len(header) - 1)))
    names = [name for name in header if name or made.rows != "R"]
    if made.header == "comments":
        out.append("# " + " ".join(names))
    elif made.header != "none":
        out.append(line(names, made.quote in ("names", "all")))
    if made.header in ("units below", "titles and units"):
        below = ["TS" if kind == "TOA5" and j == 1 else unit for j, unit in enumerate(units)]
        out.append(line(below, made.quote == "all"))
        if kind == "TOA5":
            out.append(line(["", ""] + ["Avg"] * (len(header) - 2), True))
    out += [line(row) for row in zip(*columns)]
    if made.footer:
        out.append(made.footer)
    path.write_text("\n".join(out) + "\n", encoding="utf-8")
