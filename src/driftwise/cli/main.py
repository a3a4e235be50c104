"""The command line: `driftwise run`, `compare`, `track` and their kin. Nothing heavy loads before one runs."""

from __future__ import annotations

import sys
from pkgutil import resolve_name
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from driftwise.cli.compare import CompareJob
from driftwise.cli.demo import DemoJob, SimulateJob
from driftwise.cli.demo_fleet import FleetSimulateJob
from driftwise.cli.entry_points import entry_points
from driftwise.cli.export import ExportJob
from driftwise.cli.fleet import FleetRunJob, FleetShowJob
from driftwise.cli.job import Command, add_command
from driftwise.cli.live import LiveJob
from driftwise.cli.progress import bar
from driftwise.cli.run import RunJob
from driftwise.cli.track import TrackJob
from driftwise.cli.validate import ValidateJob
from driftwise.engine.errors import CommandError, InputError, Stopped, brief
from driftwise.report.advice_translation import spoken
from driftwise.report.printed import say

STUDIES = ("reproduce", "score")  # commands of the second distribution of the repository


class Commands(TyperGroup):
    """The commands, and those that other distributions bring, under the entry points ``driftwise.commands``.

    They are looked for where one is asked for that is not ours, or all are listed: it takes longer than to read ours.
    """

    def get_command(self, ctx, cmd_name):
        self._bring({cmd_name} - self.commands.keys())
        return super().get_command(ctx, cmd_name)

    def list_commands(self, ctx):
        self._bring(STUDIES)
        return super().list_commands(ctx)

    def _bring(self, wanted) -> None:
        """Add what others bring, and in place of a study that is not there what says where it is."""
        if not wanted:
            return
        others, brought = typer.Typer(callback=_common), entry_points("driftwise.commands")
        for name in sorted({*brought, *STUDIES} - self.commands.keys()):
            if name in brought:
                others.command(name)(resolve_name(brought[name]))
            else:
                anything = {"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []}
                others.command(name, hidden=True, context_settings=anything)(_refuse_study)
        found: Any = typer.main.get_command(others)
        self.commands |= found.commands


app = typer.Typer(
    name="driftwise",
    cls=Commands,
    help="State and parameters of a linear system that may drift, sample by sample, with honest error bars.",
    no_args_is_help=True,
    add_completion=True,
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

        say(f"driftwise {__version__}")
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
    with bar("compiling") as advance:
        for name in chain(estimators(), fleets()):
            count += 1
            advance(None, name[:70])
    say(f"{count} combinations compiled and stored in {perf_counter() - start:.1f} s")


def _add_commands() -> None:
    """Add the commands."""
    commands: dict[str, type[Command]] = dict(
        run=RunJob, validate=ValidateJob, compare=CompareJob, track=TrackJob, export=ExportJob, simulate=SimulateJob,
        demo=DemoJob, live=LiveJob,
    )  # fmt: skip
    of_fleets: dict[str, type[Command]] = dict(run=FleetRunJob, show=FleetShowJob, simulate=FleetSimulateJob)
    for name, command in commands.items():
        add_command(app, name, command)
    for name, command in of_fleets.items():
        add_command(fleet, name, command)
    app.command()(warm)


def _refuse_study(context: typer.Context) -> None:
    raise CommandError(
        f"driftwise {context.info_name} is one of the studies, a distribution of its own: pip install ./studies "
        "in the repository."
    )


_add_commands()


def main() -> None:
    """Run the command line: exit code 0 when done, 1 for data of no use, 2 for a wrong command, 3 for a question."""
    code = 0
    try:
        code = app(prog_name="driftwise", standalone_mode=False) or 0
        if code == STOPPED:  # by Ctrl-C before a job had begun
            raise Stopped(STOPPED)
    except InputError as error:
        code = _complain(spoken(str(error)), 2 if isinstance(error, CommandError) else 1)
    except Stopped as asked_to:
        code = _complain("; ".join(filter(None, ["stopped", str(asked_to)])), asked_to.code)
    except OSError as error:  # what no door can know: a disk that fills up, a folder taken away meanwhile
        code = _stop(error)
    except MemoryError:
        code = _complain("there is not enough memory for this: fewer samples, lower orders, a smaller --chunk?", 1)
    except USAGE as error:
        code = _explain(error)
    sys.exit(_printed(code))


STOPPED = 130
USAGE: Any = next(kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException")


def _printed(code: int) -> int:
    """Return the exit code once all is out that was printed: here, where it can be told that it fails."""
    try:
        if sys.stdout is not None and not sys.stdout.closed:
            sys.stdout.flush()
    except OSError as error:
        sys.stdout = None  # it is not tried again
        if code == 0:
            code = _stop(error, "standard output: ")
    return code


def _stop(error: OSError, where: str = "") -> int:
    """Say what stopped the command; nothing where nobody reads what it prints, as in `driftwise run .. | head`."""
    if isinstance(error, BrokenPipeError):
        return 1
    where = f"{error.filename}: " if error.filename else where
    return _complain(f"stopped by the system: {where}{error.strerror or error}", 1)


def _complain(text: str, code: int) -> int:
    say(f"driftwise: {text}", stderr=True)
    return code


def _explain(error: Any) -> int:
    """Say what is wrong with the words of the command; of one that is none but asks for help, the help."""
    if type(error).__name__ == "NoArgsIsHelpError":
        error.show()
    else:
        about = getattr(error.ctx, "command_path", "driftwise") if getattr(error, "ctx", None) else "driftwise"
        _complain(f"{brief(error.format_message().rstrip('.'))}. What there is: {about} --help", error.exit_code)
    return error.exit_code


if __name__ == "__main__":
    main()
