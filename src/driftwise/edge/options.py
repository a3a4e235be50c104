"""What a user asked for on the command line, in words, turned into the parts of an estimator."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

from driftwise.errors import InputError

__all__ = ["Plan", "floats"]


class Plan(NamedTuple):
    """The options of `driftwise run`."""

    file: str
    output: str
    inputs: tuple[str, ...]
    time: str | None = None
    order: int = 2
    noise: str = "equation-error"
    memory: str = "never"
    gate: float | None = None
    direct: bool = False
    center: str = "mean"
    dt: float | None = None
    save: str | None = None
    report: str | None = None
    json: str | None = None
    chunk: int = 65_536
    start: float | None = None
    stop: float | None = None

    def estimator(self, dt: float) -> Any:
        """Return the estimator; its prior is not yet in units of the data."""
        import driftwise as dw

        if self.center not in ("mean", "median", "none"):
            raise InputError(f"--center must be mean, median or none, got {self.center!r}.")
        if self.direct and not self.inputs:
            raise InputError("--direct says that an input acts at once, but there is no --input; which column is it?")
        gate = None
        if self.gate is not None:
            if not self.gate > 0:
                raise InputError(f"--gate must be a positive number of standard deviations, got {self.gate:g}.")
            gate = dw.Gate(sigmas=self.gate)
        return dw.Joint(
            self.order,
            len(self.inputs),
            self.direct,
            noise=_noise(self.noise),
            memory=_memory(self.memory),
            gate=gate,
            dt=dt,
        )

    def check_targets(self) -> None:
        """Refuse a place that cannot be written to before the work, not after it."""
        for option, path in (("--save", self.save), ("--report", self.report), ("--json", self.json)):
            if path is None or (path == "-" and option == "--json"):
                continue
            folder = os.path.dirname(path) or "."
            if not os.path.isdir(folder):
                raise InputError(
                    f"{option}: there is no folder {folder} to write {os.path.basename(path)} into; make it first."
                )
            if os.path.isdir(path):
                raise InputError(f"{option}: {path} is a folder; give the name of a file in it.")
            if (
                os.path.exists(path)
                and self.file != "-"
                and os.path.exists(self.file)
                and os.path.samefile(path, self.file)
            ):
                raise InputError(f"{option} would overwrite the table that is being read, {path}; give another name.")
        if self.save and not self.save.lower().endswith((".parquet", ".csv")):
            raise InputError(f"--save writes .parquet or .csv, got {self.save}; the ending says which.")


def floats(option: str, text: str) -> list[float]:
    """Return the numbers of a comma-separated list."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"{option} takes numbers separated by commas, for example 0.5,-0.2; got {text!r}.") from None


def _noise(text: str):
    import driftwise as dw

    kind, _, numbers = text.partition(":")
    if kind == "output-error" and not numbers:
        return dw.OutputError()
    if kind == "equation-error" and not numbers:
        return dw.EquationError()
    if kind == "polynomial" and numbers:
        return dw.NoisePolynomial(tuple(floats("--noise polynomial:", numbers)))
    raise InputError(
        f"--noise must be output-error, equation-error or polynomial:d0,d1,.. (as many as the order), got {text!r}."
    )


def _memory(text: str):
    import driftwise as dw

    kind, _, number = text.partition(":")
    if kind == "never" and not number:
        return dw.Never()
    if kind == "walk" and number:
        steps = floats("--memory walk:", number)
        return dw.Walk(steps[0] if len(steps) == 1 else tuple(steps))
    raise InputError(
        f"--memory must be never or walk:Q (Q is a variance per sample, for example walk:1e-6), got {text!r}."
    )
