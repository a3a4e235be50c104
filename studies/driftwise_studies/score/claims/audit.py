"""All files of a seed through the front door, and what became of their claims."""

from __future__ import annotations

import contextlib
import io
import json
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from driftwise.engine.errors import InputError

from .checking import FALSE, TRUE, VACUOUS, Case, check, is_attainable, is_dated, is_near, is_told, tellable_jumps
from .drawing import draw
from .oracle import ask
from .plant import Plant
from .simulation import MEAN_GAP, Record, record
from .tables import Written, write_table

ASKED = 3  # exit code of a question
USUAL = 60.0  # seconds between the rows of an irregular clock, usually
MARKED = 0.25  # share of the files that have a column of what was done
DONE = "law", "retrofit", "new supplier", "Umbau", "travaux", "tariff reform", "batch", "crew", "phase", "firmware"
NARROW = 0.2  # width of the oracle's interval below which a number ought to be claimed


@dataclass
class Line:
    """What became of one file."""

    number: int
    about: str
    troubles: frozenset[str]
    outcome: str  # answered, asked, refused
    claims: list[tuple[str, str, str]] = field(default_factory=list)  # kind, verdict, text
    expected: dict[str, int] = field(default_factory=dict)  # what the oracle knows well
    found: dict[str, int] = field(default_factory=dict)  # of these, claimed
    dated: list[bool] = field(default_factory=list)  # of changes that are told: whether the date's interval holds them
    is_named: bool = False
    has_columns: bool = False
    why: str = ""


def play(seed: int, numbers: Iterable[int], processes: int = 1) -> list[Line]:
    """Return a line for each file."""
    if processes == 1:
        return [one(seed, number) for number in numbers]
    with ProcessPoolExecutor(processes or None) as pool:
        return list(pool.map(partial(one, seed), numbers))


def one(seed: int, number: int) -> Line:
    """Draw a plant, write its file, have it answered, check what is claimed."""
    plant = draw(seed, number)
    data = record(plant, seed)
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        written = write(plant, data, seed, Path(folder))
        line = Line(number, plant.about, plant.troubles, "answered", is_named=written.knows_output)
        try:
            answer = front_door(written.path)
        except InputError as error:
            line.outcome, line.why = "refused", str(error)
            return line
    if answer is None:
        line.outcome = "asked"
        return line
    columns = answer["columns"]
    written = written.read_with(columns["output"])
    case = Case(plant, data, written, ask(plant, data), answer)
    line.claims = [(claim["kind"], check(case, claim), claim["text"]) for claim in answer["claims"]]
    line.has_columns = columns["output"] == written.outputs[0] and set(columns["inputs"]) == set(written.inputs)
    recall(case, line)
    return line


def write(plant: Plant, data: Record, seed: int, folder: Path) -> Written:
    """Write the record of a plant as a table of some kind."""
    rng, rows = np.random.default_rng([seed, plant.number, 24]), data.rows
    clock: dict[str, Any] = {"dt": plant.dt} if plant.number % 2 else {}  # else one that suits the kind of table
    if plant.is_irregular:
        clock = {"dt": USUAL, "time": rows * USUAL / MEAN_GAP}
    events = done(plant, np.random.default_rng([seed, plant.number, 39]))
    events = {name: column[rows] for name, column in events.items()}
    return write_table(folder / f"plant{plant.number}.csv", data.y[rows], data.u[rows], rng, **clock, events=events)


def done(plant: Plant, rng) -> dict[str, np.ndarray]:
    """Return a column (T,) that says when something was done, of some plants: half of them where something jumps."""
    if rng.random() > MARKED:
        return {}
    dates = [jump.at for jump in plant.jumps] if rng.random() < 0.5 else []
    at = int(rng.choice(dates) if dates else plant.samples * rng.uniform(0.1, 0.9))
    before, after = rng.permutation([0, 1]) if rng.random() < 0.7 else np.sort(rng.integers(1, 9, 2)) + [0, 1]
    return {str(rng.choice(DONE)): np.where(np.arange(plant.samples) < at, float(before), float(after))}


def front_door(path: Path) -> dict[str, Any] | None:
    """Return what `driftwise run FILE --json` writes; None where it asks."""
    import typer

    from driftwise.cli.main import app

    result = path.with_suffix(".json")
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        try:
            code = app(["run", str(path), "--json", str(result)], standalone_mode=False)
        except (SystemExit, typer.Exit) as stop:
            code = getattr(stop, "exit_code", getattr(stop, "code", None))
    return None if code == ASKED else json.loads(result.read_text(encoding="utf-8"))


def recall(case: Case, line: Line) -> None:
    """Count what the oracle knows well, and what of it is claimed."""
    expected, found = Counter[str](), Counter[str]()
    claims, oracle = case.answer["claims"], case.oracle
    gains = {claim["subject"] for claim in claims if claim["kind"] == "gain" and claim["value"] is not None}
    for name, value, bar in zip(case.written.inputs, oracle.gains, oracle.gain_bars):
        if 2 * bar < NARROW * abs(value):
            expected["gain"] += 1
            found["gain"] += name in gains
    times = {claim["subject"] for claim in claims if claim["kind"] == "time constant"}
    for name, (value, bar) in zip(case.written.inputs, oracle.times):
        if 2 * bar < NARROW * abs(value):
            expected["time constant"] += 1
            found["time constant"] += name in times
    for k in tellable_jumps(case):
        what, was_told = f"change of {case.plant.jumps[k].what}", any(is_told(case, k, claim) for claim in claims)
        for name in (what, f"{what}, date and kind not told")[: 1 + is_attainable(case, k)]:
            expected[name] += 1
            found[name] += was_told
    for k in range(len(case.plant.jumps)):
        told = next((claim for claim in claims if is_told(case, k, claim) and is_near(case, k, claim)), None)
        line.dated += [is_dated(case, k, told)] if told else []
    line.expected, line.found = dict(expected), dict(found)


def table(lines: list[Line]) -> str:
    """Return claims by kind, and recall, as a table of Markdown."""
    rows = [
        "| claims | said | checked | true | vacuous | true share |", "| --- | --- | --- | --- | --- | --- |",
    ]  # fmt: skip
    said = Counter(kind for line in lines for kind, _, _ in line.claims)
    by = Counter((kind, verdict) for line in lines for kind, verdict, _ in line.claims)
    for kind in [*said, "all"]:
        kinds = list(said) if kind == "all" else [kind]
        good, empty, bad = (sum(by[k, verdict] for k in kinds) for verdict in (TRUE, VACUOUS, FALSE))
        total = good + empty + bad
        count = sum(said[k] for k in kinds)
        rows.append(f"| {kind} | {count} | {total} | {good} | {empty} | {_share(good + empty, total)} |")
    rows += ["", "| what the oracle knows | there | claimed | share |", "| --- | --- | --- | --- |"]
    expected, found = Counter[str](), Counter[str]()
    for line in lines:
        expected.update(line.expected)
        found.update(line.found)
    rows += [f"| {what} | {n} | {found[what]} | {_share(found[what], n)} |" for what, n in sorted(expected.items())]
    rows += ["", "| files | of | share |", "| --- | --- | --- |"]
    answered = [line for line in lines if line.outcome == "answered"]
    named = [line for line in answered if line.is_named]
    dated = [is_held for line in answered for is_held in line.dated]
    for what, count, of in (
        ("refused", sum(line.outcome == "refused" for line in lines), len(lines)),
        ("asked", sum(line.outcome == "asked" for line in lines), len(lines)),
        ("output and inputs right, by names of the vocabulary", sum(line.has_columns for line in named), len(named)),
        ("dates of changes that are told: held by their 95 % interval", sum(dated), len(dated)),
        ("no false claim", sum(_is_clean(line) for line in answered), len(answered)),
    ):
        rows.append(f"| {what} | {count} of {of} | {_share(count, of)} |")
    return "\n".join(rows) + "\n"


def falsehoods(lines: list[Line], most: int) -> str:
    """Return the first false claims of each kind, with the file."""
    shown, rows = Counter[str](), []
    for line in lines:
        rows += [f"refused: {line.about}: {line.why}"] if line.outcome == "refused" else []
        for kind, verdict, text in line.claims:
            if verdict == FALSE and shown[kind] < most:
                shown[kind] += 1
                rows.append(f"{kind}: {text}\n    [{line.about}]")
    return "\n".join(sorted(rows)) + "\n"


def _is_clean(line: Line) -> bool:
    return all(verdict != FALSE for _, verdict, _ in line.claims)


def _share(part: int, of: int) -> str:
    return f"{part / of:.3f}" if of else ""
