"""The commands of `driftwise fleet`: run, show, simulate."""

from __future__ import annotations

from typing import Annotated

import typer

__all__ = ["app"]

app = typer.Typer(
    name="fleet",
    help="Many series in one table: an estimator for each, and who among them needs a look.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.command()
def run(
    data: Annotated[str, typer.Argument(help="Parquet or CSV file, or a folder of them (partitioned or not).")],
    by: Annotated[str, typer.Option("--by", "-b", metavar="COLUMN", help="Column that says whose row it is.")],
    output: Annotated[
        list[str], typer.Option("--output", "-o", metavar="COLUMN", help="Column of the measured output.")
    ],
    out: Annotated[str, typer.Option("--out", metavar="DIR", help="Folder for the results; made if need be.")],
    input: Annotated[
        list[str] | None,
        typer.Option("--input", "-i", metavar="COLUMN", help="Column of an input; repeat for several."),
    ] = None,
    time: Annotated[
        str | None,
        typer.Option(
            "--time",
            "-t",
            metavar="COLUMN",
            help="Column of the time. Rows that come late or twice are then counted and left out; without it, rows of "
            "a series are trusted to be in order.",
        ),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            metavar="KIND:ORDERS",
            help="As for run: arx:NA,NB[,NK] (arx:2,2 if omitted; ar:2 without an input), armax, oe, bj; or joint:N. "
            "Each series has an offset besides.",
        ),
    ] = None,
    memory: Annotated[
        str | None,
        typer.Option(
            metavar="KIND:NUMBER",
            help="As for run: auto if omitted (how fast each parameter drifts, noise, outliers and jumps are found "
            "out), constant (several times faster), exponential:LAM, restart, ...",
        ),
    ] = None,
    jumps: Annotated[
        str | None,
        typer.Option(metavar="DETECTOR:RATE[,SIZE]", help="As for run: start afresh at jumps, e.g. parameters:10000."),
    ] = None,
    dt: Annotated[
        float | None,
        typer.Option(
            metavar="STEP",
            help="Step of the clock: ticks without a row become missing samples. Without it, rows are taken as equally "
            "spaced.",
        ),
    ] = None,
    missing: Annotated[
        list[float] | None,
        typer.Option(metavar="CODE", help="A value that stands for a missing one, e.g. -9999; repeat for several."),
    ] = None,
    first: Annotated[
        int,
        typer.Option(
            metavar="ROWS",
            min=1,
            help="Complete rows of each series that tell its level and units; more for slow plants.",
        ),
    ] = 32,
    every: Annotated[
        int, typer.Option(metavar="N", min=0, help="Write an estimate for every N samples of a series; 0: none.")
    ] = 100,
    batch: Annotated[int, typer.Option(metavar="ROWS", min=1, help="Rows in memory at a time.")] = 1 << 18,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads; all cores if omitted.")] = None,
    checkpoint: Annotated[
        str,
        typer.Option(metavar="SECONDS|BATCHESb", help="Between two checkpoints: 60 (seconds), 20b (batches)."),
    ] = "60",
    resume: Annotated[
        bool,
        typer.Option(
            "--resume", metavar="", help="Go on from the last checkpoint in DIR, bit for bit as if never stopped."
        ),
    ] = False,
    replace: Annotated[
        bool, typer.Option("--replace", metavar="", help="Delete what a former run wrote into DIR, and nothing else.")
    ] = False,
    spark: Annotated[
        str | None, typer.Option(metavar="URL", help="Run on Apache Spark, e.g. local[4] or spark://host:7077.")
    ] = None,
    json: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write the summary as JSON; - for standard output.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", metavar="", help="Print nothing but errors.")] = False,
) -> None:
    """Estimate every series of a long table, in memory that does not grow with it.

    Rows of a series may be mixed with those of others in any way; those of one series stand in order of time. Writes
    into DIR: summary.html and outliers.csv (who jumped, drifts, differs, is not identifiable, is not to be believed),
    final.parquet (one row for each series), estimates, events.parquet, and the states to go on with.

    Example: driftwise fleet run pumps --by asset --output flow --input speed --time time --out results
    """
    from driftwise.cli.fleet import Order, execute, one

    execute(
        Order(
            data, by, one(output), out, tuple(input or ()), time, model, memory, jumps, dt, first, every, batch,
            threads, checkpoint, resume, replace, spark, json, quiet, tuple(missing or ()),
        )
    )  # fmt: skip


@app.command()
def show(folder: Annotated[str, typer.Argument(metavar="DIR", help="Folder of a finished run.")]) -> None:
    """Print the summary of a finished run again.

    Example: driftwise fleet show results
    """
    from driftwise.cli.fleet import show_again

    show_again(folder)


@app.command()
def simulate(
    folder: Annotated[str, typer.Argument(metavar="DIR", help="Folder to write Parquet files into.")],
    series: Annotated[int, typer.Option(min=1, help="Number of pumps.")] = 1000,
    samples: Annotated[int, typer.Option(min=50, help="Samples of each.")] = 500,
    seed: Annotated[int, typer.Option(help="The same seed gives the same files.")] = 0,
) -> None:
    """Write a fleet of pumps to try things on: columns time, asset, speed, flow, and faults that are known.

    Example: driftwise fleet simulate pumps --series 1000 --samples 500
    """
    from driftwise.cli.demo_fleet import tell, write_fleet

    tell(write_fleet(folder, series, samples, seed), folder)
