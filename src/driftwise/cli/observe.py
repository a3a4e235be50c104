"""`driftwise run --plant FILE`: a table and a known plant in; its state, disturbances and derived outputs out."""

from __future__ import annotations

import os
from typing import Any

from driftwise import estimators as families
from driftwise.cli.job import RecordJob
from driftwise.cli.run_options import RunOptions
from driftwise.cli.saving import Saver
from driftwise.engine.errors import CommandError, InputError
from driftwise.results.numbers import number, plus_minus

UNEVEN = 1e-3  # a step that differs by this share from the usual one makes a table irregular
TUNED = 20_000  # rows that a walk is tuned on


class ObserveJob(RunOptions, RecordJob):
    """Observes a plant whose equations are known, of one output or several."""

    writes = (("trace", "save"), ("report", "report"), ("results", "json"))
    options: Any = None  # of the observer, and the numbers of the disturbances whose walk is to be tuned
    estimator: Any = None
    summary: Any = None
    keeper: Any = None
    notes: Any = ()

    def check(self) -> None:
        """Refuse wrong options, and read the plant, before the table is read."""
        from driftwise.tables import plantfile

        self.need_output()
        if wrong := self.changed:
            raise CommandError(f"{', '.join(wrong)}: with --plant the plant is known, and nothing of it is estimated.")
        self.options, self.tuned = plantfile.read(str(self.plant), self.outputs, list(self.inputs))
        super().check()

    def estimate(self) -> None:
        """Run the observer over the table."""
        from driftwise.cli.downsample import ObserverDownsampler

        self.open(*self.outputs, find_clock=False).is_of_plant = True
        state = None
        with Saver(self.save) as saver:
            for chunk in self.chunks("estimating"):
                y, u, time = self._columns(chunk)
                if self.estimator is None:
                    self.estimator, self.notes = self._made(y, u, time)
                    self.summary, self.keeper = self.estimator.summary(), ObserverDownsampler()
                trace = self.estimator.scan(y, u, time=time if self.estimator.irregular else None, state=state)
                if time is not None:
                    trace.time = time
                state = trace.state
                self.summary.add(trace)
                self.keeper.add(trace)
                if self.save:
                    saver.add(trace.columns())

    def _columns(self, chunk):
        """Return y, u and the time (None without one) of a chunk."""
        import numpy as np

        y = np.stack([chunk.columns[name] for name in self.outputs], axis=1)
        u = np.stack([chunk.columns[name] for name in self.inputs], axis=1) if self.inputs else None
        return (y[:, 0] if y.shape[1] == 1 else y), u, chunk.columns[self.time] if self.time else None

    def _made(self, y, u, time):
        """Return the observer, its walks tuned on the first rows where that is asked for, and what to say about it."""
        import numpy as np

        options, dt, said = self.options, self.dt or self.record.clock.dt, []
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
            if self.tuned or any(finds.values()):
                stamps = time[rows] if time is not None and estimator.irregular else None
                more = {"which": self.tuned, "noise": finds["noise"]} if self.tuned or finds["noise"] else {}
                estimator = estimator.tune(y[rows], None if u is None else u[rows], time=stamps, **more)
                said.append(f"by the first {len(y[rows])} rows: {estimator.tuned.words}")
        except InputError as error:
            raise CommandError(f"--plant {self.plant}: {error}") from None
        return estimator, said

    def summarise(self) -> None:
        """Say what to beware of."""
        said = [note for note in self.record.clock.notes() if not (self.estimator.irregular and "irregular" in note)]
        self.notes = [*self.notes, *self.record.code_notes(), *said]

    def draw(self, path: str) -> None:
        from driftwise.results import verbs

        names = {
            "outputs": [self.named(name) for name in self.outputs],
            "inputs": [self.named(name) for name in self.inputs],
            "time": self.named(self.time) if self.time else "time (s)",
            "origin": self.record.clock.origin if self.time else None,
        }
        title = f"{self.short_title}: {', '.join(self.outputs)}"
        verbs.call("report", self.keeper.trace(), path, self.summary, title, names, self.keeper.events)

    def content(self) -> dict[str, Any]:
        return {
            "file": self.file, "plant": self.plant,
            "columns": {"outputs": self.outputs, "inputs": list(self.inputs), "time": self.time},
            "estimator": repr(self.estimator), "notes": self.notes, "summary": self.summary.as_dict(),
        }  # fmt: skip

    def facts(self) -> list[str]:
        """Return what the run was, in a few words."""
        est = self.estimator
        window = "all samples so far" if est.is_growing else f"window of {number(est.window)} s"
        return [f"{self.summary.samples} samples", f"plant {os.path.basename(str(self.plant))}", window,
                f"dt {number(est.dt, 4)} s", f"took {self.took:.2f} s"]  # fmt: skip

    def show(self, out) -> None:
        if self.json == "-":  # nothing but the results
            return
        from rich.text import Text

        from driftwise.report.terminal import foot, head, table

        summary = self.summary
        head(out, self.short_title, self.facts())
        shown = table(("", "left"), ("last estimate", "left"))
        for name, value, std in summary.estimates:
            shown.add_row(name, plus_minus(value, std))
        out.print(shown)
        numbers = ("one-step rms", "fit", "NIS", "in 95 % band", "missing")
        shown = table(("output", "left"), *((name, "right") for name in numbers))
        for name, part in zip(self.outputs, summary.outputs):
            shown.add_row(
                name, number(part.rmse, 3), f"{part.fit:.1f} %", number(part.nis, 3), f"{100 * part.coverage:.1f} %",
                str(part.missing_outputs),
            )  # fmt: skip
        out.print()
        out.print(shown)
        out.print()
        out.print(Text(summary.words))
        foot(out, beware=self.notes)
        if not self.written:
            out.print()


def _roughness(y) -> list[float]:
    """Return a noise deviation to start from for each output: that of white noise with the same third differences."""
    import numpy as np

    columns = [rough[np.isfinite(rough)] for rough in np.diff(y.reshape(len(y), -1), 3, axis=0).T]
    return [float(np.sqrt(np.mean(rough**2) / 20)) if rough.any() else 1.0 for rough in columns]
