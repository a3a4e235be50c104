"""`driftwise run FILE` with nothing said: columns recognised, model chosen, in one pass and constant memory."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from typing import Any

from driftwise.cli.asking import recognised
from driftwise.cli.job import BETWEEN, RecordJob, reading, undivided
from driftwise.cli.run_options import RunOptions
from driftwise.cli.saving import Saver
from driftwise.engine.errors import CommandError, InputError


class AutomaticJob(RunOptions, RecordJob):
    """Finds out everything but the columns that were named."""

    writes = (("samples", "save"), ("report", "report"), ("results", "json"))
    found: Any = None  # the `Identification`
    keeper: Any = None
    notes: Any = ()

    def check(self) -> None:
        """Refuse what names a model, before the table is read."""
        wrong = [name for name in self.changed if name != "--model"]
        if wrong:
            raise CommandError(f"{', '.join(wrong)}: the model is found out here; name one with --model.")
        if len(self.outputs) > 1:
            raise CommandError(
                f"--output was given {len(self.outputs)} times ({', '.join(self.outputs)}), and one output is "
                "identified at a time: run once for each, the other perhaps as an --input."
            )
        _ = self.seasons  # refused before the table is read
        super().check()

    def estimate(self) -> None:
        """Identify the table."""
        from driftwise.analysis.events import events_of
        from driftwise.analysis.identification import Finder, all_columns
        from driftwise.analysis.table_together import together_of
        from driftwise.cli.downsample import PairDownsampler
        from driftwise.report.advice_translation import spoken_verdicts
        from driftwise.results.numbers import SAMPLES
        from driftwise.tables.autoread import gathered

        output = self.output[0] if self.output else None
        inputs = None if self.input is None else self.inputs
        table, segments = recognised(self, output, inputs)
        finder = Finder(table, segments.origin, self.seasons, events_of(segments.table.head, table))
        with Saver(self.save) as saver, reading(segments.table.source, "identifying") as advance:
            try:
                for piece in gathered(self._within(table, segments), self.chunk):
                    with undivided():
                        forecast, trace = finder.add(*piece)
                        self.keeper = self.keeper or PairDownsampler(finder.estimator)
                        self.keeper.join(trace, forecast)
                        if self.save:
                            saver.add(all_columns(forecast, trace))
                    advance()
            except KeyboardInterrupt:
                if self.keeper is None or not saver.has_begun:
                    raise
                self.is_stopped = True
        if self.keeper is None:
            raise InputError(f"{self.file}: no row {'can be read' if self.is_whole else BETWEEN}.")
        trace, forecast = self.keeper.traces()
        common = together_of(segments.table.head, table) if self.is_whole else ()
        found = finder.found(trace, forecast, segments.losses(), segments.clock.breaks, common)
        if found.table.time is None and not found.table.timed:
            found.summary.unit = SAMPLES
        self.found = replace(found, diagnosis=spoken_verdicts(found.diagnosis))
        self.notes = self.found.notes

    @property
    def is_whole(self) -> bool:
        """Whether neither --from nor --to was given."""
        return self.start is None and self.stop is None

    def _within(self, table, segments):
        """Yield the segments between --from and --to."""
        if self.is_whole:
            yield from segments
            return
        at, time_of = segments.table.moment, table.count.time
        first = -math.inf if self.start is None else time_of(at(table.time, "--from", self.start))
        last = math.inf if self.stop is None else time_of(at(table.time, "--to", self.stop, is_end=True))
        for time, y, u in segments:
            inside = (time >= first) & (time <= last)
            if inside.any():
                yield time[inside], y[inside], u[inside]

    def summarise(self) -> None:
        """Say what to beware of."""
        from driftwise.cli.notes import STOPPED

        self.notes = [*([STOPPED] if self.is_stopped else []), *self.notes]

    def draw(self, path: str) -> None:
        from driftwise.report.identification_page import write

        write(self.found, path, self.short_title, self.keeper.events, self.notes)

    def show(self, out) -> None:
        from driftwise.report.terminal import show_identification

        show_identification(self.found, title=self.title, taken=self.took, notes=self.notes, stderr=self.json == "-")

    def content(self) -> dict[str, Any]:
        found = self.found
        table, f, own = found.table, found.forecast_summary, found.own_summary
        return {
            "columns": {"output": table.output, "inputs": list(table.inputs), "time": table.time},
            "dt": table.dt,
            "alternatives": [reading._asdict() for reading in table.alternatives],
            "words": found.words,
            "claims": [claim.as_dict() for claim in found.claims],
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
                {
                    "sample": c.since, "time": c.time, "interval": c.interval, "odds": c.odds,
                    "words": found.phrase(c), "events": [event._asdict() for event in c.events],
                }
                for c in found.changes
            ],
            "alarms": found.alarms,
            "together": [asdict(one) for one in found.together],
            "diagnosis": [verdict.as_dict() for verdict in found.diagnosis],
            "summary": found.summary.as_dict(),
            "notes": self.notes,
        }  # fmt: skip
