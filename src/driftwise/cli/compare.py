"""`driftwise compare`: several estimators on the same table, one table of results and one page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import typer

from driftwise.cli import specs
from driftwise.cli.asking import recognised
from driftwise.cli.job import RecordJob
from driftwise.cli.options import Chunk, From, Inputs, Json, Page, TableFile, TakeBest, To, time_option
from driftwise.engine.errors import CommandError, InputError
from driftwise.results.numbers import number
from driftwise.tables.source import is_stream


@dataclass
class CompareJob(RecordJob):
    """Compare estimators on a recorded table: who predicts the next sample best, and is sure of it?

    All see the same samples once, and are scored on the same ones: one-step fit, log predictive density (the order of
    the table), calibration, alarms and cost. Columns that are not named are recognised, as `driftwise run` does.

    Examples: driftwise compare plant.csv arx:2,2,1 last;
    driftwise compare plant.csv arx:2,2,1 arx:2,2,1@exponential:0.995 joint:2 last -o temperature -i heater
    """

    file: TableFile
    spec: Annotated[
        list[str],
        typer.Argument(
            metavar="SPEC...",
            help="Estimators: KIND:ORDERS or KIND:ORDERS@MEMORY, written as --model and --memory of run (arx:2,2,1, "
            "arx:2,2,1@exponential:0.995, armax:2,2,1,1), joint:N or joint:N,NOISE (joint:3@restart, joint:2,unknown), "
            "last (the last value), mean (so far), or average (of the others).",
        ),
    ]
    output: Annotated[
        str | None, typer.Option("--output", "-o", metavar="COLUMN", help="Column of the measured output.")
    ] = None
    input: Inputs = None
    time: Annotated[str | None, time_option(": numbers, or ISO 8601 stamps.")] = None
    start: From = None
    stop: To = None
    take_best: TakeBest = False
    report: Page = None
    json: Json = None
    chunk: Chunk = 65_536
    changed = ()  # options of a model that a question repeats

    def __post_init__(self):
        self.found: Any = None
        self.offsets: Any = None
        self.notes: list[str] = []

    def check(self) -> None:
        """Refuse files and SPECs before the table is read."""
        super().check()
        if self.output is None and not self.is_open:
            raise CommandError("of a stream, read once, which column is the output? Say --output.")
        try:
            specs.estimators(self.spec, self.inputs or ("u",) * self.is_open, 1.0)
        except InputError as error:
            raise CommandError(str(error)) from None

    @property
    def is_open(self) -> bool:
        """Whether columns are to be recognised."""
        return self.output is None and not is_stream(self.file)

    @property
    def called(self) -> tuple[str, ...]:
        return "compare", self.file, *self.spec

    def estimate(self) -> None:
        """Run all estimators over the table."""
        from driftwise.analysis.comparison import Comparison
        from driftwise.cli.downsample import Offsets

        if self.is_open:
            table, _ = recognised(self, None, None if self.input is None else self.inputs)
            self.output, self.input, self.time = table.output, list(table.inputs), table.time
            self.notes = [table.words, *table.notes]
        self.open(str(self.output))
        for chunk in self.chunks("comparing"):
            if self.found is None:
                self.offsets = Offsets.of(chunk, self.record)
                y, u = self.offsets.taken_from(chunk)
                made = specs.estimators(self.spec, self.inputs, self.step)
                self.found = Comparison({name: _scaled(est, y, u) for name, est in made.items()})
            self.found.add(*self.offsets.taken_from(chunk), self.time_of(chunk, self.step))

    def summarise(self) -> None:
        """Say what to beware of."""
        from driftwise.cli.notes import clock_notes, unreadable

        record, values = self.record, self.offsets.values
        said = [*record.otherwise, *clock_notes(record)]
        if record.bad:
            where = f" (first: {record.first_bad})" if record.first_bad else ""
            said.append(f"{unreadable(record.bad)}{where}.")
        said += record.code_notes() + record.unit_notes()
        if values:
            means = ", ".join(f"{name} {number(value)}" for name, value in values.items())
            said.append(f"means of the first chunk were subtracted, for all alike: {means}.")
        self.notes += [*said, *record.clock.notes()]

    @property
    def facts(self) -> list[str]:
        return [f"{self.found.samples} samples", f"output {self.output}", *(f"input {name}" for name in self.inputs)]

    def draw(self, path: str) -> None:
        from driftwise.cli.notes import labels
        from driftwise.report.comparison_page import write

        write(self.found, path, f"{self.short_title}: {self.record.output}", self.facts, labels(self))

    def content(self) -> dict[str, Any]:
        columns = {"output": self.output, "inputs": list(self.inputs), "time": self.time}
        return {"file": self.file, "columns": columns, "notes": self.notes} | self.found.as_dict()

    def show(self, out) -> None:
        from rich.text import Text

        from driftwise.report.comparison_page import HEAD, cells
        from driftwise.report.terminal import foot, head, table

        head(out, self.title, self.facts)
        shown = table(*((name, "right" if k else "left") for k, name in enumerate(HEAD)))
        for k, column in enumerate(shown.columns):
            column.no_wrap, column.overflow = False, "ellipsis" if k else "fold"
        for line in cells(self.found):
            shown.add_row(*map(Text, line))
        out.print(shown)
        out.print()
        out.print(Text(self.found.words))
        foot(out, beware=self.notes)
        out.print()


def _scaled(est, y, u):
    """Return an estimator in units of the data; one that goes by a fixed prior stays as it is."""
    return est if est.options.get("theta0") is not None else est.scaled_to(y, u if est.model.inputs else None)
