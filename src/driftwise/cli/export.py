"""`driftwise export`: an estimator as C for a controller, or as Structured Text for a PLC."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Annotated, Any

import typer

from driftwise.cli import specs
from driftwise.cli.job import Job
from driftwise.cli.options import Inputs
from driftwise.cli.targets import refuse_folder
from driftwise.engine.errors import CommandError, InputError


@dataclass
class ExportJob(Job):
    """Write an estimator as C for a controller: one .c, one .h, a test with expected bits, and what it takes.

    Nothing is allocated or printed, and no library is needed. Where GCC for Arm and QEMU are installed, the README
    tells code, stack and instructions on two controllers. For a PLC, --language st writes Structured Text
    (IEC 61131-3) instead: one function block, and one that tests it.

    Example: driftwise export arx:2,2@restart -i heater --out firmware --name pump
    """

    what: Annotated[
        str,
        typer.Argument(
            metavar="SPEC|STATE",
            help="What to export: KIND:ORDERS@MEMORY, as compare takes it (arx:2,2@exponential:0.99, joint:2), fresh; "
            "or a file with an estimator and the state that it reached: .json of save_state, .npz of trace.save.",
        ),
    ]
    out: Annotated[str, typer.Option("--out", metavar="DIR", help="Folder to write into; made if it is not there.")]
    name: Annotated[str, typer.Option(metavar="NAME", help="What files, functions and types begin with.")] = "driftwise"
    language: Annotated[
        str,
        typer.Option(
            metavar="c|st",
            help="c: C99, which is C++ too. st: Structured Text, for ARX, AR, regression and joint with constant, "
            "exponential, walk or restart.",
        ),
    ] = "c"
    single: Annotated[
        bool,
        typer.Option("--float", metavar="", help="Numbers of 32 bits; refused where that was not shown to be sound."),
    ] = False
    input: Inputs = None
    dt: Annotated[float, typer.Option(help="Of a SPEC: seconds between samples.")] = 1.0
    y_scale: Annotated[float, typer.Option(help="Of a SPEC: typical size of the output, for the prior.")] = 1.0
    u_scale: Annotated[str, typer.Option(metavar="LIST", help="Of a SPEC: typical size of each input.")] = "1"

    def check(self) -> None:
        """Refuse a folder that cannot be written, and numbers that Structured Text is not written with."""
        refuse_folder("--out", self.out)
        if self.language == "st" and self.single:
            raise CommandError(
                "--float has no meaning with --language st: Structured Text is written with LREAL, doubles."
            )

    def estimate(self) -> None:
        """Make the estimator, or read it, and write its files."""
        est, state = self._read() if self.what.lower().endswith((".json", ".npz")) else (self._made(), None)
        precision = "single" if self.single else "double"
        try:
            self.files = est.export(self.out, state, language=self.language, name=self.name, precision=precision)
        except InputError as error:
            raise CommandError(str(error)) from None

    def tell(self) -> None:
        """Say what was written."""
        from driftwise.report.printed import say

        say(", ".join(map(str, self.files)))

    def _read(self) -> tuple[Any, Any]:
        """Return the estimator and the state of a file."""
        from driftwise.results.snapshot import load_state
        from driftwise.results.trace import Trace

        if not os.path.isfile(self.what):
            raise CommandError(f"there is no file {self.what}; a SPEC is written as arx:2,2@restart.")
        if self.what.lower().endswith(".json"):
            return load_state(self.what)
        trace = Trace.load(self.what)
        return trace.estimator, trace.state

    def _made(self) -> Any:
        """Return the estimator of a SPEC."""
        inputs = tuple(self.input or ())
        try:
            est = specs.estimators([self.what], inputs, self.dt)[self.what]
            given = specs.floats("--u-scale", self.u_scale)
            sizes = {"y_scale": self.y_scale, "u_scale": given if len(given) > 1 else given * len(inputs) or 1.0}
            return est.replace(**{name: size for name, size in sizes.items() if name in est.options})
        except InputError as error:
            raise CommandError(str(error)) from None
