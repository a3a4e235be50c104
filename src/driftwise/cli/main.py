"""The command line: `driftwise run`, `compare`, `track` and their kin. Nothing heavy loads before one runs."""

from __future__ import annotations

import sys
from importlib.metadata import entry_points
from typing import Annotated

import typer

from driftwise.cli.compare import CompareJob
from driftwise.cli.demo import DemoJob, SimulateJob
from driftwise.cli.demo_fleet import FleetSimulateJob
from driftwise.cli.export import ExportJob
from driftwise.cli.fleet import FleetRunJob, FleetShowJob
from driftwise.cli.job import add_command
from driftwise.cli.run import RunJob
from driftwise.cli.track import TrackJob
from driftwise.engine.errors import CommandError, InputError
from driftwise.report.advice_translation import spoken

STUDIES = ("reproduce", "score")  # commands of the second distribution of the repository

app = typer.Typer(
    name="driftwise",
    help="State and parameters of a linear system that may drift, sample by sample, with honest error bars.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
fleet = typer.Typer(
    name="fleet",
    help="Many series in one table: an estimator for each, and who among them needs a look.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.add_typer(fleet)


def _version(wanted: bool) -> None:
    if wanted:
        from driftwise.version import __version__

        typer.echo(f"driftwise {__version__}")
        raise typer.Exit()


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    pass


def warm() -> None:
    """Compile ahead, so that the first estimate does not have to wait."""
    from itertools import chain
    from time import perf_counter

    from driftwise.estimators.common.warm import warm as estimators
    from driftwise.fleet.warm import warm as fleets

    start, count = perf_counter(), 0
    for count, name in enumerate(chain(estimators(), fleets()), 1):
        if sys.stderr.isatty():
            print(f"\r\033[K{count} {name[:70]}", end="", file=sys.stderr, flush=True)
    if sys.stderr.isatty():
        print("\r\033[K", end="", file=sys.stderr)
    typer.echo(f"{count} combinations compiled and stored in {perf_counter() - start:.1f} s")


def _add_commands() -> None:
    """Add the jobs, and the commands that other distributions bring, under the entry points ``driftwise.commands``."""
    jobs = dict(run=RunJob, compare=CompareJob, track=TrackJob, export=ExportJob, simulate=SimulateJob, demo=DemoJob)
    for name, job in jobs.items():
        add_command(app, name, job)
    for name, job in dict(run=FleetRunJob, show=FleetShowJob, simulate=FleetSimulateJob).items():
        add_command(fleet, name, job)
    app.command()(warm)
    brought = {entry.name: entry for entry in entry_points(group="driftwise.commands")}
    for name in sorted({*brought, *STUDIES}):
        if name in brought:
            app.command(name)(brought[name].load())
        else:
            anything = {"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []}
            app.command(name, hidden=True, context_settings=anything)(_refuse_study)


def _refuse_study(context: typer.Context) -> None:
    raise CommandError(
        f"driftwise {context.info_name} is one of the studies, a distribution of its own: pip install ./studies "
        "in the repository."
    )


_add_commands()


def main() -> None:
    """Run the command line: exit code 0 when done, 1 for data that cannot be used, 2 for a wrong command."""
    try:
        app()
    except InputError as error:
        print(f"driftwise: {spoken(str(error))}", file=sys.stderr)
        sys.exit(2 if isinstance(error, CommandError) else 1)
    except OSError as error:  # what no door can know: a disk that fills up, a folder taken away meanwhile
        where = f"{error.filename}: " if error.filename else ""
        print(f"driftwise: stopped by the system: {where}{error.strerror or error}", file=sys.stderr)
        sys.exit(1)


if __name__ == "__main__":
    main()
