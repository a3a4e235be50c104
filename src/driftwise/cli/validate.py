"""`driftwise validate`: a model held against what an engineer asks of it, on a table."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any

import typer

from driftwise.cli import specs
from driftwise.cli.job import TableJob
from driftwise.cli.options import Inputs, Json, Page, TableFile, time_option
from driftwise.engine.errors import CommandError, InputError

MOST = 200_000  # rows that are held


@dataclass
class ValidateJob(TableJob):
    """Validate a model on a recorded table: wrong delay, feedback, missing lags, colour, square laws, fresh data.

    Each test is at a level of 1 %, and says what to do. Forecasts 1, 5 and 25 samples ahead and simulations of a model
    of the first two thirds are told on the last third; the page has step response, Bode, Nyquist and poles with bands.
    Without --model it is the one that `driftwise run --season none` finds; columns that are not named are recognised.

    Examples: driftwise validate plant.csv;
    driftwise validate plant.csv --model arx:2,2,1 -o temperature -i heater --report page.html
    """

    file: TableFile
    model: Annotated[
        str | None,
        typer.Option(
            metavar="KIND:ORDERS[@MEMORY]",
            help="The model: arx:2,2,1, armax:2,2,1,1, oe:2,2,1, joint:2, .. as compare takes it, with an offset; its "
            "memory is constant unless one is named (@auto).",
        ),
    ] = None
    output: Annotated[
        str | None, typer.Option("--output", "-o", metavar="COLUMN", help="Column of the measured output.")
    ] = None
    input: Inputs = None
    time: Annotated[str | None, time_option(": numbers, or time stamps.")] = None
    dt: Annotated[float | None, typer.Option(metavar="SECONDS", help="Seconds between samples.")] = None
    report: Page = None
    json: Json = None

    def __post_init__(self):
        self.table: Any = None
        self.found: Any = None  # the `Validation`
        self.name = ""
        self.notes: list[str] = []

    def check(self) -> None:
        """Refuse files, and what is no model, before the table is read."""
        super().check()
        if self.model is not None:
            self._estimator(tuple(self.input or ("u",)), 1.0)

    def _estimator(self, inputs: tuple[str, ...], dt: float) -> Any:
        text = str(self.model) if "@" in str(self.model) else f"{self.model}@constant"
        if text.partition("@")[0] in specs.NAMED:
            raise CommandError(f"--model {self.model} is a forecaster without a model: there is nothing to validate.")
        try:
            (est,) = specs.estimators([text], inputs, dt).values()
        except InputError as error:
            raise CommandError(f"--model: {error}") from None
        return est.replace(offset=True) if "offset" in est.options else est

    def estimate(self) -> None:
        """Read the table, run the model over it, and validate it."""
        import numpy as np

        from driftwise.analysis.identification import Finder
        from driftwise.analysis.seasons import held, of_table, season_words
        from driftwise.analysis.validation import validate
        from driftwise.results.numbers import SAMPLES, SECONDS
        from driftwise.tables.autoread import gathered, read

        inputs = None if self.input is None else tuple(self.input)
        table, segments = read(self.file, self.output, inputs, self.time, dt=self.dt)
        parts: list[Any] = []
        for piece in gathered(segments):
            parts.append(piece)
            if sum(len(part[0]) for part in parts) >= MOST:
                self.notes.append(f"only the first {MOST} samples were looked at.")
                break
        if not parts:
            raise InputError(f"{self.file}: no row can be read.")
        time, y, u = (np.concatenate(part)[:MOST] for part in zip(*parts))
        if self.model is None:
            finder = Finder(table, segments.origin, ())  # a season is learnt from y: no equation holds it
            if seasons := held(of_table(table), int(np.isfinite(y).sum())):
                self.notes.append(
                    f"{season_words(seasons, table)} would be looked for by `driftwise run`: this is the "
                    "best equation without."
                )
            _, trace = finder.add(time, y, u)
            self.name = finder.identifier.chosen.name
            center = finder.identifier.center
            trace.y, trace.u, trace.table[:, 0] = (
                trace.y - center[0],
                trace.u - center[1:],
                trace.prediction - center[0],
            )
        else:
            y = y - np.nanmean(y)
            u = u - np.nan_to_num(np.nanmean(u, axis=0)) if u.shape[1] else u
            est = self._estimator(table.inputs, table.dt)
            rows = u if est.model.inputs else None
            trace, self.name = est.scaled_to(y, rows).scan(y, rows, time=time), str(self.model)
        self.table = table
        unit = SECONDS if table.timed else SAMPLES
        self.found = validate(trace, table.inputs if trace.u.shape[1] else (), unit)
        self.notes = [*self.notes, *table.notes, *segments.losses()]

    @property
    def facts(self) -> list[str]:
        return [
            self.name,
            f"output {self.table.output}",
            *(f"input {name}" for name in self.table.inputs),
            self.table.step,
        ]

    def draw(self, path: str) -> None:
        from driftwise.report.validation_page import write

        write(self.found, path, f"{self.short_title}: {self.name} of {self.table.output}", self.notes, self.facts)

    def content(self) -> dict[str, Any]:
        columns = {"output": self.table.output, "inputs": list(self.table.inputs), "time": self.table.time}
        return {"file": self.file, "columns": columns, "dt": self.table.dt, "model": self.name, "notes": self.notes} | (
            self.found.as_dict()
        )

    def show(self, out) -> None:
        from driftwise.report.advice_translation import spoken_verdicts
        from driftwise.report.terminal import show_validation

        found = replace(self.found, verdicts=spoken_verdicts(self.found.verdicts))
        show_validation(
            found, title=self.title, facts=[f"{found.samples} samples", *self.facts], notes=self.notes, out=out
        )
