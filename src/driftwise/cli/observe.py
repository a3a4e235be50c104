"""`driftwise run --plant FILE`: a table and a known plant in; its state, disturbances and derived outputs out."""

from __future__ import annotations

import os
from time import perf_counter
from typing import Any, NamedTuple

from driftwise import estimators as families
from driftwise.cli.options import Plan
from driftwise.cli.saving import Saver
from driftwise.cli.targets import check_targets
from driftwise.engine.errors import CommandError, InputError
from driftwise.results.numbers import number, plus_minus
from driftwise.tables import plantfile
from driftwise.tables.table import open_record

__all__ = ["Observation", "execute"]

UNEVEN = 1e-3  # a step that differs by this share from the usual one makes a table irregular
TUNED = 20_000  # rows that a walk is tuned on


class Observation(NamedTuple):
    """The options of a run of a known plant."""

    plant: str
    file: str
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    time: str | None
    dt: float | None
    save: str | None
    report: str | None
    json: str | None
    chunk: int
    start: float | str | None
    stop: float | str | None


def execute(asked: Observation) -> None:
    """Run the observer over the table: estimate, save, report, print."""
    from driftwise.cli.downsample import ObserverKeeper
    from driftwise.cli.runner import no_row, progress, window
    from driftwise.results.observer_summary import ObserverSummary

    options, tuned = plantfile.read(asked.plant, list(asked.outputs), list(asked.inputs))
    columns = (*asked.outputs[1:], *asked.inputs)
    plan = Plan(asked.file, asked.outputs[0], columns, asked.time, start=asked.start, stop=asked.stop, dt=asked.dt,
                save=asked.save, report=asked.report, json=asked.json)  # fmt: skip
    check_targets(plan)
    begun = perf_counter()
    record = open_record(plan.file, plan.output, plan.inputs, plan.time, asked.chunk)
    estimator, state, said = None, None, []
    summary: Any = None
    keeper: Any = None
    saver = Saver(asked.save) if asked.save else None
    with progress(record, "estimating") as advance:
        try:
            for chunk in record:
                chunk = window(chunk, record, plan)
                if not chunk.rows:
                    continue
                y, u, time = _columns(asked, chunk)
                if estimator is None:
                    estimator, said = _estimator(asked, options, tuned, record, y, u, time)
                    summary, keeper = ObserverSummary(estimator), ObserverKeeper()
                trace = estimator.scan(y, u, time=time if estimator.irregular else None, state=state)
                if time is not None:
                    trace.time = time
                state = trace.state
                summary.add(trace)
                keeper.add(trace)
                if saver:
                    saver.add(_table(trace))
                advance()
        finally:
            if saver:
                saver.close()
    if estimator is None:
        raise no_row(record)
    said += record.code_notes()
    said += [note for note in record.clock.notes() if not (estimator.irregular and "irregular" in note)]
    title = "standard input" if asked.file == "-" else os.path.basename(asked.file)
    if asked.report:
        from driftwise.report.observer_page import write

        names = {
            "outputs": [_named(record, name) for name in asked.outputs],
            "inputs": [_named(record, name) for name in asked.inputs],
            "time": _named(record, asked.time) if asked.time else "time (s)",
            "origin": record.clock.origin if asked.time else None,
        }
        write(keeper.trace(), asked.report, summary, f"{title}: {', '.join(asked.outputs)}", names, keeper.events)
    if asked.json:
        _write_json(asked, estimator, summary, said)
    if asked.json != "-":
        _show(asked, estimator, summary, title, perf_counter() - begun, said)


def _columns(asked, chunk):
    """Return y, u and the time (None without one) of a chunk."""
    import numpy as np

    y = np.stack([chunk.columns[name] for name in asked.outputs], axis=1)
    u = np.stack([chunk.columns[name] for name in asked.inputs], axis=1) if asked.inputs else None
    return (y[:, 0] if y.shape[1] == 1 else y), u, chunk.columns[asked.time] if asked.time else None


def _estimator(asked, options, tuned, record, y, u, time):
    """Return the observer, its walks tuned on the first rows where that is asked for, and what to say about it."""
    import numpy as np

    dt, said = asked.dt or record.clock.dt, []
    if not dt:
        raise CommandError("the plant is in seconds: say --time COLUMN, or --dt with the seconds between samples")
    if time is not None and "irregular" not in options and len(time) > 1:
        steps = np.diff(time)
        if np.any(abs(steps - dt) > UNEVEN * dt):
            options = options | {"irregular": True}
            said.append(
                f"steps of time lie between {number(steps.min(), 4)} and {number(steps.max(), 4)} s: irregular."
            )
    rows = slice(0, TUNED)
    finds = {"window": options["window"] == "tune", "noise": options["noise_std"] == "tune"}
    if finds["window"]:
        options = options | {"window": len(y[rows]) * dt / 4}
    if finds["noise"]:
        options = options | {"noise_std": _roughness(y[rows])}
    try:
        estimator = families.WindowObserver(dt=dt, **options)
        if tuned or any(finds.values()):
            stamps = time[rows] if time is not None and estimator.irregular else None
            more = {"which": tuned, "noise": finds["noise"]} if tuned or finds["noise"] else {}
            estimator = estimator.tune(y[rows], None if u is None else u[rows], time=stamps, **more)
            said.append(f"by the first {len(y[rows])} rows: {estimator.tuned.words}")
    except InputError as error:
        raise CommandError(f"--plant {asked.plant}: {error}") from None
    return estimator, said


def _roughness(y) -> list[float]:
    """Return a noise deviation to start from for each output: that of white noise with the same third differences."""
    import numpy as np

    columns = [rough[np.isfinite(rough)] for rough in np.diff(y.reshape(len(y), -1), 3, axis=0).T]
    return [float(np.sqrt(np.mean(rough**2) / 20)) if rough.any() else 1.0 for rough in columns]


def _table(trace):
    import pyarrow as pa

    return pa.table({name: pa.array(column) for name, column in trace.columns().items()})


def _named(record, name) -> str:
    unit = record.source.units.get(name)
    return f"{name} ({unit})" if unit else name


def _write_json(asked, estimator, summary, said) -> None:
    from driftwise.cli.results import write
    from driftwise.version import __version__

    content = {
        "driftwise": __version__, "file": asked.file, "plant": asked.plant,
        "columns": {"outputs": list(asked.outputs), "inputs": list(asked.inputs), "time": asked.time},
        "estimator": repr(estimator), "notes": said, "summary": summary.as_dict(),
    }  # fmt: skip
    write(content, asked.json)


def _show(asked, estimator, summary, title, taken, said) -> None:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from driftwise.report.terminal import console

    out = console()
    window = "all samples so far" if estimator.is_growing else f"window of {number(estimator.window)} s"
    facts = [
        f"{summary.samples} samples",
        f"plant {os.path.basename(asked.plant)}",
        window,
        f"dt {number(estimator.dt, 4)} s",
        f"took {taken:.2f} s",
    ]
    out.print()
    out.print(Text(title, style="bold"))
    out.print(Text(" \u00b7 ".join(facts), style="dim"))
    out.print()
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    table.add_column("", header_style="dim")
    table.add_column("last estimate", header_style="dim")
    for name, value, std in summary.estimates:
        table.add_row(name, plus_minus(value, std))
    out.print(table)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    for head in ("output", "one-step rms", "fit", "NIS", "in 95 % band", "missing"):
        table.add_column(head, header_style="dim", justify="left" if head == "output" else "right")
    for name, part in zip(asked.outputs, summary.outputs):
        table.add_row(
            name, number(part.rmse, 3), f"{part.fit:.1f} %", number(part.nis, 3), f"{100 * part.coverage:.1f} %",
            str(part.missing_outputs),
        )  # fmt: skip
    out.print()
    out.print(table)
    out.print()
    out.print(Text(summary.words))
    for note in said:
        out.print(Text("note: ", style="yellow") + Text(note))
    written = [f"{what} in {path}" for what, path in
               (("trace", asked.save), ("report", asked.report), ("results", asked.json)) if path]  # fmt: skip
    out.print(Text(", ".join(written)) if written else Text(""))
