"""`driftwise run --plant NAME` of a plant in formulas: its physical parameters with bars, and when they moved."""

from __future__ import annotations

from typing import Any

from driftwise import estimators as families
from driftwise.cli.observe import ObserveJob
from driftwise.engine.errors import CommandError, InputError
from driftwise.results.numbers import number, plus_minus
from driftwise.results.physical_sentences import jump_at_words

TAKEN = ("--memory", "--gate")  # options of models that it takes, too


class GreyBoxJob(ObserveJob):
    """Estimates the physical parameters of a plant in formulas."""

    formulas: Any = None

    def check(self) -> None:
        """Refuse wrong options, and read the plant and the head of the table, before the record is read."""
        from driftwise.cli import specs
        from driftwise.models import formulas

        if wrong := [name for name in self.changed if name not in TAKEN]:
            raise CommandError(f"{', '.join(wrong)}: the model is the plant that --plant names.")
        try:
            self.formulas = formulas.read(str(self.plant))
        except InputError as error:
            raise CommandError(f"--plant {self.plant}: {error}") from None
        self.memory_policy = specs.memory(self.memory or "auto")
        self._match_columns()
        super(ObserveJob, self).check()

    def _match_columns(self) -> None:
        """Find the columns of the plant's inputs and outputs: those that were named, or of their names or units."""
        from driftwise.cli.columns_of_plant import match

        found = match(self.file, self.formulas, self.outputs, list(self.inputs), self.time)
        self.output, self.input, self.time = found

    def _made(self, y, u, time):
        """Return the estimator, with its noise and typical sizes from the first rows, and what to say about it."""
        from driftwise.detect import InnovationGate

        dt = self.dt or self.record.clock.dt
        if not dt:
            raise CommandError("the plant is in seconds: say --time COLUMN, or --dt with the seconds between samples")
        gate = InnovationGate(self.gate) if self.gate is not None else None
        try:
            estimator = families.GreyBox(self.formulas, memory=self.memory_policy, gate=gate, dt=dt)
        except InputError as error:
            raise CommandError(f"--plant {self.plant}: {error}") from None
        if not estimator.knows_noise:
            estimator = estimator.scaled_to(y, u)
        return estimator, list(estimator.notes)

    def show(self, out) -> None:
        if self.json == "-":  # nothing but the results
            return
        from rich.text import Text

        from driftwise.report.terminal import foot, head, table

        est, summary = self.estimator, self.summary
        plant, intervals = est.formulas, est.intervals(summary.state)
        facts = [f"{summary.samples} samples", f"plant {plant.name}", f"dt {number(est.dt, 4)} s",
                 f"took {self.took:.2f} s"]  # fmt: skip
        head(out, self.short_title, facts)
        shown = table(("", "left"), ("now", "left"), ("", "left"), ("within, with 95 %", "left"), ("", "left"))
        abouts = {one.name: one.about for one in plant.free}
        for name, value, std in summary.parameters:
            ends = " … ".join(number(end, 4) for end in intervals[name])
            shown.add_row(name, plus_minus(value, std), plant.units[name], ends, abouts[name])
        out.print(shown)
        out.print()
        origin = self.record.clock.origin if self.time else None
        for event in summary.moves:
            out.print(Text(jump_at_words(event.moved, event.time, origin)))
        out.print(Text(summary.remarks))
        foot(out, beware=self.notes)
        if not self.written:
            out.print()
