"""`driftwise run --plant FILE` of a file with the user's own matrices: the Kalman filter over a table."""

from __future__ import annotations

import os
from typing import Any

from driftwise import estimators as families
from driftwise.cli.observe import TUNED, ObserveJob
from driftwise.engine.errors import CommandError, InputError
from driftwise.results.numbers import number


class MatricesJob(ObserveJob):
    """Filters a table by the matrices of a file."""

    which: Any = ()  # of Q and R: what is to be tuned

    def check(self) -> None:
        """Refuse wrong options, and read the matrices, before the table is read."""
        from driftwise.tables import matricesfile

        self.need_output()
        if wrong := self.changed:
            raise CommandError(f"{', '.join(wrong)}: the model is the matrices that --plant names.")
        self.options, self.which = matricesfile.read(str(self.plant))
        super(ObserveJob, self).check()

    def _made(self, y, u, time):
        """Return the filter, its noise learnt from the first rows where that is asked for, and what to say about it."""
        options, dt = self.options, self.dt or self.record.clock.dt
        if not dt and options.get("continuous"):
            raise CommandError("continuous matrices are in seconds: say --time COLUMN, or --dt")
        rows, names = slice(0, TUNED), {"inputs": list(self.inputs) or None, "outputs": self.outputs}
        said: list[str] = []
        try:
            estimator: Any = families.StateSpace(dt=dt or 1.0, **options)
            if estimator.model.outputs != len(self.outputs) or estimator.model.inputs != len(self.inputs):
                raise InputError(_counts(estimator.model, self.outputs, self.inputs))
            estimator = estimator.replace(**names).scaled_to(y, u)
            if self.which:
                stamps = time[rows] if time is not None and estimator.irregular else None
                estimator = estimator.tune(y[rows], None if u is None else u[rows], time=stamps, which=self.which)
                said.append(f"by the first {len(y[rows])} rows: {estimator.tuned.words}")
        except InputError as error:
            raise CommandError(f"--plant {self.plant}: {error}") from None
        return estimator, said

    def facts(self) -> list[str]:
        """Return what the run was, in a few words."""
        samples, _, _, dt, took = super().facts()
        evidence = f"log evidence {number(self.summary.loglik, 6)}"
        return [samples, f"matrices {os.path.basename(str(self.plant))}", evidence, dt, took]


def _counts(model, outputs, inputs) -> str:
    """Return what is wrong where columns are not as many as rows of H or columns of G."""
    return (
        f"H has {model.outputs} rows and G {model.inputs} columns, and {len(outputs)} outputs and {len(inputs)} inputs "
        "are named: --output COLUMN for each row, --input COLUMN for each column, in their order"
    )
