"""The command line: `driftwise run`, `compare`, `track` and their kin. Nothing heavy loads before one runs."""

from __future__ import annotations

import sys
from importlib.metadata import entry_points
from typing import Annotated

import typer

from driftwise.cli import cli_fleet
from driftwise.engine.errors import CommandError, InputError
from driftwise.report.advice_translation import spoken

__all__ = ["app", "main"]

STUDIES = ("reproduce", "score")  # commands of the second distribution of the repository

app = typer.Typer(
    name="driftwise",
    help="State and parameters of a linear system that may drift, sample by sample, with honest error bars.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.add_typer(cli_fleet.app)

# options that several commands share
Inputs = Annotated[
    list[str] | None, typer.Option("--input", "-i", metavar="COLUMN", help="Column of an input; repeat for several.")
]
From = Annotated[
    str | None,
    typer.Option(
        "--from",
        metavar="TIME",
        help="Leave out rows before this time: a number (of time stamps: seconds since the first), or a date such as "
        "2024-03-30 or 2024-03-30T12:00.",
    ),
]
To = Annotated[
    str | None,
    typer.Option(
        "--to", metavar="TIME", help="Leave out rows after this time; a date without a time is the whole day."
    ),
]
Json = Annotated[str | None, typer.Option(metavar="FILE", help="Write the results as JSON; - for standard output.")]
Chunk = Annotated[int, typer.Option(help="Rows held in memory at a time.", min=1, hidden=True)]


def _version(wanted: bool) -> None:
    if wanted:
        from driftwise.version import __version__

        typer.echo(f"driftwise {__version__}")
        raise typer.Exit()


def _order(text: str) -> int | str:
    """Return the order as a number, or "auto"."""
    if text == "auto":
        return text
    try:
        return int(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is neither a whole number nor auto.") from None


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    pass


@app.command()
def run(
    file: Annotated[str, typer.Argument(help="CSV or Parquet table, or - for CSV on standard input.")],
    output: Annotated[
        list[str] | None,
        typer.Option(
            "--output",
            "-o",
            metavar="COLUMN",
            help="Column of the measured output. Left out, everything is found out: columns, model, changes.",
        ),
    ] = None,
    input: Inputs = None,
    time: Annotated[
        str | None,
        typer.Option("--time", "-t", metavar="COLUMN", help="Column of the time: numbers, or time stamps."),
    ] = None,
    plant: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="The plant is known: a TOML file with its matrices, disturbances and derived outputs. Its state, the "
            "disturbances and what is derived of them are estimated; several --output may be given.",
        ),
    ] = None,
    order: Annotated[
        str,
        typer.Option(
            "--order",
            "-n",
            parser=_order,
            metavar="N|auto",
            help="Order of the model: how many past outputs matter; auto takes the most probable of --orders.",
        ),
    ] = "2",
    orders: Annotated[
        str | None,
        typer.Option(metavar="1-5|1,2,4", help="Compare these orders by their evidence; prints a table."),
    ] = None,
    noise: Annotated[
        str,
        typer.Option(
            metavar="KIND",
            help="equation-error (ARX), output-error (white noise on the sensor alone), unknown (its colour is "
            "estimated too: ARMAX), or polynomial:d0,d1,..",
        ),
    ] = "equation-error",
    model: Annotated[
        str | None,
        typer.Option(
            metavar="KIND:ORDERS",
            help="auto: found out, as where no --output is given. Recursive identification instead of the joint "
            "filter: arx:na,nb,nk, armax:na,nb,nc,nk, oe:nb,nf,nk, "
            "bj:nb,nc,nd,nf,nk, ar:na, arma:na,nc or regression. Orders that differ by input: arx:2,2/1,1/0.",
        ),
    ] = None,
    memory: Annotated[
        str | None,
        typer.Option(
            metavar="KIND:NUMBER",
            help="How the past is forgotten: constant (constant parameters; the default without --model), "
            "random-walk:Q (they drift; variance per sample) or random-walk:JUMP/EVERY (as jumps of that size "
            "every so many samples would have it), restart or restart:STEP (constant until they jump; size to "
            "expect where output and inputs have size one). With --model also auto (the default there, without "
            "--jumps; nothing to tune: how fast each parameter drifts, the noise, outliers and jumps are found "
            "out; auto:outliers or auto:jumps where only these are to be expected), exponential:LAM (a sample "
            "fades to LAM of its weight with each new one), window:T (the last T samples), drift:NVR (a walk of "
            "that noise variance ratio), and more: --memory list says what each is.",
        ),
    ] = None,
    jumps: Annotated[
        str | None,
        typer.Option(
            metavar="DETECTOR:RATE[,SIZE]",
            help="Start afresh at jumps, with one false alarm in RATE samples (10000, or '1 per 10_000'). DETECTOR: "
            "parameters (which one, which way; SIZE of its jump where output and inputs are of size one; needs "
            "--model), level (a shift of the innovations; SIZE in standard deviations), noise (they widen, as they do "
            "when any parameter jumps; SIZE: variance after over before), glr (a shift of any size; SIZE: samples to "
            "look back). How to start afresh: --memory restart:STEP or gain-reset:N.",
        ),
    ] = None,
    smooth: Annotated[
        str | None,
        typer.Option(
            metavar="all|LAG",
            help="Look back: parameters (and state) given the whole record, or LAG later samples; with --model arx, ar "
            "or regression their drift and jumps by maximum likelihood. Holds the record in memory.",
        ),
    ] = None,
    gate: Annotated[
        float | None,
        typer.Option(metavar="SIGMAS", help="Set aside outputs this many standard deviations off, e.g. 5."),
    ] = None,
    direct: Annotated[
        bool, typer.Option("--direct", metavar="", help="The input acts on the output at once (term b0).")
    ] = False,
    center: Annotated[
        str,
        typer.Option(
            metavar="mean|median|none",
            help="Subtract the mean or the median of the first chunk from each column, or none.",
        ),
    ] = "mean",
    raw: Annotated[
        bool,
        typer.Option(
            "--raw", metavar="", help="Take codes for a missing value, such as -9999, as they stand: they are values."
        ),
    ] = False,
    dt: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", help="Seconds between samples; taken from --time if omitted, else 1."),
    ] = None,
    save: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write the trace, sample by sample, to this .parquet or .csv.")
    ] = None,
    report: Annotated[str | None, typer.Option(metavar="FILE", help="Write a self-contained HTML report.")] = None,
    json: Json = None,
    start: From = None,
    stop: To = None,
    chunk: Chunk = 65_536,
) -> None:
    """Estimate a system from a recorded table.

    Reads FILE chunk by chunk (any length, constant memory), estimates state and parameters at every sample,
    and prints what the plant is and how far it can be trusted. Empty cells are missing samples, not errors.
    With FILE alone all is found out: the columns, the model, what changed.

    Examples: driftwise run plant.csv --report report.html;
    driftwise run plant.csv --output temperature --input heater --order 2;
    driftwise run plant.csv -o temperature -i heater --model arx:2,2,1 --jumps parameters:10000;
    driftwise run motor.csv -o angle -i voltage -t t --plant motor.toml --report report.html
    """
    from driftwise.cli.options import Plan
    from driftwise.cli.runner import execute

    output = output or []
    given = {
        "--order": str(order) != "2", "--orders": orders, "--noise": noise != "equation-error", "--model": model,
        "--memory": memory, "--jumps": jumps, "--smooth": smooth, "--gate": gate, "--direct": direct,
        "--center": center != "mean", "--raw": raw,
    }  # fmt: skip
    wrong = [name for name, is_given in given.items() if is_given]
    if plant is None and (model == "auto" or not (output or wrong)):
        _identify(file, output, input, time, wrong, dt, start, stop, save, report, json, chunk)
        return
    if not output:
        raise CommandError(f"{', '.join(wrong) or '--plant'}: of which column? Say --output, or leave all options out.")
    if plant is not None:
        from driftwise.cli.observe import Observation
        from driftwise.cli.observe import execute as observe

        if wrong:
            raise CommandError(f"{', '.join(wrong)}: with --plant the plant is known, and nothing of it is estimated.")
        observe(
            Observation(
                plant, file, tuple(output), tuple(input or ()), time, dt, save, report, json, chunk, start, stop
            )
        )
        return
    if len(output) > 1:
        raise CommandError(
            f"--output was given {len(output)} times ({', '.join(output)}), and one output is estimated at a time: run "
            "once for each, the other perhaps as an --input. Together: driftwise.ARX or driftwise.Joint, in Python, or "
            "an observer of a known plant (--plant)."
        )
    execute(
        Plan(
            file,
            output[0],
            tuple(input or ()),
            time,
            order,
            noise,
            memory,
            gate,
            direct,
            center,
            dt,
            save,
            report,
            json,
            chunk,
            start,
            stop,
            orders,
            smooth,
            model,
            jumps,
            raw,
        )
    )


def _identify(file, output, inputs, time, wrong, dt, start, stop, save, report, json, chunk) -> None:
    """Run with everything found out but the columns that were named."""
    from driftwise.cli.automatic import Automatic, execute

    others = {"--from": start, "--to": stop}
    wrong = [name for name in wrong if name != "--model"] + [n for n, value in others.items() if value is not None]
    if wrong:
        raise CommandError(f"{', '.join(wrong)}: the model is found out here; name one with --model and --output.")
    if len(output) > 1:
        raise CommandError(
            f"--output was given {len(output)} times ({', '.join(output)}): one is identified at a time."
        )
    inputs = None if inputs is None else tuple(inputs)
    execute(Automatic(file, output[0] if output else None, inputs, time, save, report, json, chunk, dt))


@app.command()
def compare(
    file: Annotated[str, typer.Argument(help="CSV or Parquet table, or - for CSV on standard input.")],
    spec: Annotated[
        list[str],
        typer.Argument(
            metavar="SPEC...",
            help="Estimators: KIND:ORDERS or KIND:ORDERS@MEMORY, written as --model and --memory of run (arx:2,2,1, "
            "arx:2,2,1@exponential:0.995, armax:2,2,1,1), joint:N or joint:N,NOISE (joint:3@restart, joint:2,unknown), "
            "last (the last value), mean (so far), or average (of the others).",
        ),
    ],
    output: Annotated[str, typer.Option("--output", "-o", metavar="COLUMN", help="Column of the measured output.")],
    input: Inputs = None,
    time: Annotated[
        str | None,
        typer.Option("--time", "-t", metavar="COLUMN", help="Column of the time: numbers, or ISO 8601 stamps."),
    ] = None,
    start: From = None,
    stop: To = None,
    report: Annotated[str | None, typer.Option(metavar="FILE", help="Write a self-contained HTML page.")] = None,
    json: Json = None,
    chunk: Chunk = 65_536,
) -> None:
    """Compare estimators on a recorded table: who predicts the next sample best, and is sure of it?

    All see the same samples once, and are scored on the same ones: one-step fit, log predictive density (the order of
    the table), calibration, alarms and cost.

    Example: driftwise compare plant.csv arx:2,2,1 arx:2,2,1@exponential:0.995 joint:2 last -o temperature -i heater
    """
    from driftwise.cli.compare import execute
    from driftwise.cli.options import Plan

    inputs = tuple(input or ())
    plan = Plan(file, output, inputs, time, report=report, json=json, chunk=chunk, start=start, stop=stop)
    execute(plan, spec)


@app.command()
def track(
    files: Annotated[
        list[str],
        typer.Argument(
            metavar="FILE...",
            help="Plots: ASTERIX (raw or pcap), Mode S frames, CSV, JSON, Parquet, NMEA, AIS. - with --follow is "
            "standard input.",
        ),
    ],
    site: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LAT,LON[,HEIGHT]",
            help="Where the radar stands: degrees and metres. Of several: SAC/SIC=LAT,LON,HEIGHT, once for each.",
        ),
    ] = None,
    sites: Annotated[
        str | None,
        typer.Option(metavar="TABLE", help="The same as CSV (sac, sic, latitude, longitude, height), JSON or TOML."),
    ] = None,
    speed: Annotated[
        str,
        typer.Option(metavar="CLASS", help="aircraft, helicopter, glider, uav, boat, or a typical speed in m/s."),
    ] = "aircraft",
    single: Annotated[
        bool, typer.Option("--single", metavar="", help="Plots that do not say whose they are belong to one object.")
    ] = False,
    out: Annotated[str | None, typer.Option(metavar="DIR", help="Write the tracks into this folder.")] = None,
    format: Annotated[
        str, typer.Option(metavar="KIND,..", help="What is written there: csv, parquet, geojson, kml, cat062.")
    ] = "csv",
    report: Annotated[str | None, typer.Option(metavar="FILE", help="Write a self-contained HTML page.")] = None,
    json: Json = None,
    follow: Annotated[
        bool,
        typer.Option(
            "--follow",
            metavar="",
            help="Wait for more: a file that grows, or standard input. Ctrl-C ends it. On a terminal a table is kept "
            "up to date; elsewhere each event and estimate is a line of JSON.",
        ),
    ] = False,
    delay: Annotated[
        float,
        typer.Option(
            metavar="SECONDS",
            min=0,
            max=599,
            help="With --follow: hold plots back so long, to put them in order of time.",
        ),
    ] = 0.0,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", metavar="", help="Print nothing but errors.")] = False,
) -> None:
    """Track what radars or receivers saw: position, velocity and turns of every object, with honest error bars.

    The kind of each file is recognised. Nothing is tuned but the class of objects.

    Examples: driftwise track plots.csv --report tracks.html;
    driftwise track radar.pcap --sites radars.csv --out tracks --format csv,kml;
    receiver | driftwise track - --follow
    """
    from driftwise.cli.follow import follow as followed
    from driftwise.cli.track import Order, execute

    (followed if follow else execute)(
        Order(tuple(files), tuple(site or ()), sites, speed, out, format, report, json, follow, quiet, single, delay)
    )


@app.command()
def simulate(
    file: Annotated[str, typer.Argument(help="CSV to write; - for standard output.")] = "-",
    a: Annotated[
        str | None,
        typer.Option("--a", help="a1,a2,.. of A(q) = 1 + a1/q + ..; a random stable plant if omitted."),
    ] = None,
    b: Annotated[str | None, typer.Option("--b", help="b1,b2,.. of the input; as long as --a.")] = None,
    direct: Annotated[float | None, typer.Option(help="b0: the input acts at once.")] = None,
    order: Annotated[int, typer.Option("--order", "-n", min=1, max=20, help="Order of the random plant.")] = 2,
    samples: Annotated[int, typer.Option(min=1, help="Number of samples.")] = 1000,
    noise_std: Annotated[float, typer.Option(min=0, help="Standard deviation of the noise.")] = 0.1,
    noise: Annotated[
        str, typer.Option(help="equation (through the dynamics) or output (on the measurement).")
    ] = "equation",
    missing: Annotated[float, typer.Option(min=0, max=1, help="Fraction of the outputs to lose.")] = 0.0,
    dt: Annotated[float, typer.Option(min=0, help="Seconds between samples.")] = 1.0,
    seed: Annotated[int, typer.Option(help="The same seed gives the same table.")] = 0,
) -> None:
    """Write a table t, u, y of a known plant, to try things on.

    Example: driftwise simulate plant.csv --a -1.5,0.7 --b 1,0.5 --missing 0.1
    """
    from driftwise.cli.demo import write_table

    write_table(file, a, b, direct, order, samples, noise_std, noise, missing, dt, seed)


@app.command()
def demo(
    report: Annotated[str | None, typer.Option(help="Write a self-contained HTML report.")] = None,
) -> None:
    """Estimate a real record that comes along: an airliner's turns, and how hard it must bank as it gathers speed."""
    from driftwise.cli.demo import fly

    fly(report)


@app.command()
def warm() -> None:
    """Compile ahead, so that the first estimate does not have to wait."""
    from time import perf_counter

    from driftwise.estimators.common.warm import warm as compile_all

    start, count = perf_counter(), 0
    for count, name in enumerate(compile_all(), 1):
        if sys.stderr.isatty():
            print(f"\r\033[K{count} {name[:70]}", end="", file=sys.stderr, flush=True)
    if sys.stderr.isatty():
        print("\r\033[K", end="", file=sys.stderr)
    typer.echo(f"{count} combinations compiled and stored in {perf_counter() - start:.1f} s")


def _add_commands() -> None:
    """Add the commands that other distributions bring, under the entry points ``driftwise.commands``."""
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
