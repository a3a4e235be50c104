"""`driftwise run FILE` with nothing said: columns recognised, model chosen, in one pass and constant memory."""

from __future__ import annotations

import os
from dataclasses import replace
from time import perf_counter
from typing import Any, NamedTuple

from driftwise.cli.downsample import Keeper, Offsets
from driftwise.cli.runner import progress
from driftwise.cli.targets import check_targets
from driftwise.engine.errors import CommandError, InputError
from driftwise.report.advice_translation import spoken_verdicts

__all__ = ["Automatic", "execute", "identify_file"]


class Automatic(NamedTuple):
    """What may be said all the same."""

    file: str
    output: str | None = None
    inputs: tuple[str, ...] | None = None
    time: str | None = None
    save: str | None = None
    report: str | None = None
    json: str | None = None
    chunk: int = 65_536
    dt: float | None = None


class Both(Keeper):
    """Keeps the trace of the chosen model and the forecast at the same samples."""

    def __init__(self, estimator):
        super().__init__(estimator, Offsets("", ()))
        self.forecast: Any = None

    def join(self, trace, forecast) -> None:
        """Take in the next stretch of both."""
        self.forecast = self.forecast or forecast
        self._last = forecast
        self.add(trace)

    def keep(self, watched, *columns):
        from driftwise.analysis.identifier import widened

        super().keep([*watched, self._last.innovation], *columns, widened(self._last, self.forecast.names))

    def traces(self):
        """Return what was kept: a trace and a forecast."""
        from driftwise.estimators.model_average.trace import AverageTrace

        rows, time, y, u, outs, dof, told = self.kept()
        from driftwise.cli.downsample import ThinTrace

        trace = ThinTrace(self.estimator, y, u, outs, "std", self.state, time=time, dof=dof, rows=rows)
        return trace, AverageTrace(self.forecast.estimator, y, u, told, "std", self._last.state, time=time)


def execute(plan: Automatic) -> None:
    """Identify, save, report, print."""
    from driftwise.cli.saving import Saver
    from driftwise.report.terminal import show_identification

    start = perf_counter()
    check_targets(plan)
    saver = Saver(plan.save) if plan.save else None
    try:
        found, keeper, stopped, losses = identify_file(plan, saver)
    except InputError as error:
        raise CommandError(str(error)) from None
    finally:
        if saver:
            saver.close()
    taken = perf_counter() - start
    title = "standard input" if plan.file == "-" else plan.file
    notes = [*found.table.notes, *losses]
    if stopped:
        notes.insert(0, "stopped early; the results are those of the rows read so far.")
    if plan.report:
        from driftwise.report.identification_page import write

        write(found, plan.report, os.path.basename(title), keeper.events, notes)
    if plan.json:
        from driftwise.cli.results import write as write_json

        write_json(content(found, notes), plan.json)
    show_identification(found, title=title, taken=taken, notes=notes, stderr=plan.json == "-")
    files = (("samples", plan.save), ("report", plan.report), ("results", plan.json))
    written = [f"{what} in {path}" for what, path in files if path]
    if written and plan.json != "-":
        print(", ".join(written))


def identify_file(plan: Automatic, saver=None):
    """Return the `Identification`, its keeper, whether it was stopped early, and what of the cells was lost."""
    import pyarrow as pa

    from driftwise.analysis.identification import Finder, all_columns
    from driftwise.results.numbers import SAMPLES
    from driftwise.tables.autoread import gathered, read

    table, stretches = read(plan.file, plan.output, plan.inputs, plan.time, plan.chunk, dt=plan.dt)
    finder = Finder(table, stretches.table.origin(table.time) if table.time else None)
    keeper: Any = None
    stopped = False
    with progress(stretches.table, "identifying") as advance:
        try:
            for piece in gathered(stretches, plan.chunk):
                forecast, trace = finder.add(*piece)
                keeper = keeper or Both(finder.estimator)
                keeper.join(trace, forecast)
                if saver:
                    saver.add(pa.table(all_columns(forecast, trace)))
                advance()
        except KeyboardInterrupt:
            if keeper is None:
                raise
            stopped = True
    if keeper is None:
        raise InputError(f"{plan.file}: no row can be read.")
    found = finder.found(*keeper.traces())
    if found.table.time is None and not found.table.timed:
        found.summary.unit = SAMPLES
    return replace(found, diagnosis=spoken_verdicts(found.diagnosis)), keeper, stopped, stretches.losses()


def content(found, notes) -> dict[str, Any]:
    """Return the answer as plain data."""
    from driftwise.version import __version__

    table, f, own = found.table, found.forecast_summary, found.own_summary
    return {
        "driftwise": __version__,
        "columns": {"output": table.output, "inputs": list(table.inputs), "time": table.time},
        "dt": table.dt,
        "words": found.words,
        "model": found.chosen.name,
        "center": found.center.tolist(),
        "candidates": found.evidence(),
        "naive": found.naive,
        "forecast": {
            "samples": f.count, "fit": f.fit, "rmse": f.rmse, "nis": f.nis, "coverage": f.coverage,
            "log_score": f.log_score,
        },
        "own_forecast": {
            "samples": own.count, "fit": own.fit, "rmse": own.rmse, "nis": own.nis, "coverage": own.coverage,
        },
        "quoted": "own_forecast" if found.is_alone else "forecast",
        "changes": [
            {"sample": c.since, "time": c.time, "noticed": c.noticed, "odds": c.odds, "words": found.phrase(c)}
            for c in found.changes
        ],
        "alarms": found.alarms,
        "diagnosis": [verdict.as_dict() for verdict in found.diagnosis],
        "summary": found.summary.as_dict(),
        "notes": notes,
    }  # fmt: skip
