"""The options of `driftwise run`, and what they ask for: orders to compare, a memory, an estimator."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Annotated, Any

import typer

from driftwise import analysis, detect, models
from driftwise import estimators as families
from driftwise.cli import specs
from driftwise.cli.options import Chunk, From, Inputs, Json, TableFile, TakeBest, To, time_option
from driftwise.engine.bounds import whole
from driftwise.engine.errors import CommandError, InputError

AUTO = "1-5"  # what --order auto compares unless told otherwise
USUAL, LARGEST = 2, 30
OFFSETS = ("estimated", "mean", "median", "none")
SMOOTHED = ("ar", "arx", "regression")  # recursive models that look back
OF_MODELS = ("order", "orders", "noise", "model", "memory", "jumps", "smooth", "gate", "direct", "offset", "raw")


def _order(text: str | None) -> int | str | None:
    """Return the order as a number, or "auto"; typer hands over the default, too."""
    if text is None or text == "auto":
        return text
    number = whole(text.removeprefix("-"))
    if number is None:
        raise typer.BadParameter(f"{text!r} is neither a whole number nor auto.")
    return -number if text.startswith("-") else number


@dataclass
class RunOptions:
    """What `driftwise run` was asked for."""

    file: TableFile
    output: Annotated[
        list[str] | None,
        typer.Option(
            "--output",
            "-o",
            metavar="COLUMN",
            help="Column of the measured output. What is not named is found out: columns, clock, model, changes.",
        ),
    ] = None
    input: Inputs = None
    time: Annotated[str | None, time_option(": numbers, or time stamps.")] = None
    plant: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|NAME",
            help="The plant is known. A TOML file with its matrices, disturbances and derived outputs: its state, the "
            "disturbances and what is derived of them are estimated. A TOML file of formulas, or a plant of the "
            "library such as battery: its physical parameters are, with units. Several --output may be given.",
        ),
    ] = None
    order: Annotated[
        Any,
        typer.Option(
            "--order",
            "-n",
            parser=_order,
            metavar="N|auto",
            help="The joint filter of this order: how many past outputs matter; auto takes the most probable of "
            "--orders. 2 where options are named that only it has.",
        ),
    ] = None
    orders: Annotated[
        str | None,
        typer.Option(metavar="1-5|1,2,4", help="Compare these orders by their evidence; prints a table."),
    ] = None
    noise: Annotated[
        str,
        typer.Option(
            metavar="KIND",
            help="equation-error (ARX), output-error (white noise on the sensor alone), unknown (its colour is "
            "estimated too: ARMAX), or polynomial:d0,d1,..",
        ),
    ] = "equation-error"
    model: Annotated[
        str | None,
        typer.Option(
            metavar="KIND:ORDERS",
            help="auto: found out, as where no option of a model is given. Recursive identification instead of the "
            "joint filter: arx:na,nb,nk, armax:na,nb,nc,nk, oe:nb,nf,nk, "
            "bj:nb,nc,nd,nf,nk, ar:na, arma:na,nc or regression. Orders that differ by input: arx:2,2/1,1/0.",
        ),
    ] = None
    memory: Annotated[
        str | None,
        typer.Option(
            metavar="KIND:NUMBER",
            help="How the past is forgotten: constant (constant parameters; the default without --model), "
            "random-walk:Q (they drift; variance per sample) or random-walk:JUMP/EVERY (as jumps of that size every "
            "so many samples would have it), restart or restart:STEP (constant until they jump; size to expect "
            "where output and inputs have size one), auto (the default with --model, without --jumps; nothing to "
            "tune: how fast each parameter drifts, the noise, outliers and jumps are found out; auto:outliers or "
            "auto:jumps where only these are to be expected), exponential:LAM (a sample fades "
            "to LAM of its weight with each new one), window:T (the last T samples), drift:NVR (a walk of that "
            "noise variance ratio), and more: --memory list says what each is. The joint filter (no --model) takes "
            "them all; what is forgotten there are the parameters, and the state given them stays.",
        ),
    ] = None
    jumps: Annotated[
        str | None,
        typer.Option(
            metavar="DETECTOR:RATE[,SIZE]",
            help="Start afresh at jumps, with one false alarm in RATE samples (10000, or '1 per 10_000'). DETECTOR: "
            "parameters (which one, which way; SIZE of its jump where output and inputs are of size one; one output), "
            "level (a shift of the innovations; SIZE in standard deviations), noise (they widen, as they do "
            "when any parameter jumps; SIZE: variance after over before), glr (a shift of any size; SIZE: samples to "
            "look back). How to start afresh: --memory restart:STEP or gain-reset:N.",
        ),
    ] = None
    smooth: Annotated[
        str | None,
        typer.Option(
            metavar="all|LAG",
            help="Look back: parameters (and state) given the whole record, or LAG later samples; with --model arx, ar "
            "or regression their drift and jumps by maximum likelihood. Holds the record in memory.",
        ),
    ] = None
    gate: Annotated[
        float | None,
        typer.Option(metavar="SIGMAS", help="Set aside outputs this many standard deviations off, e.g. 5."),
    ] = None
    direct: Annotated[
        bool, typer.Option("--direct", metavar="", help="The input acts on the output at once (term b0).")
    ] = False
    offset: Annotated[
        str,
        typer.Option(
            metavar="estimated|mean|median|none",
            help="From where output and inputs count: a constant is estimated with the parameters, the mean or the "
            "median of the first chunk is subtracted instead, or none: they are deviations already.",
        ),
    ] = "estimated"
    raw: Annotated[
        bool,
        typer.Option(
            "--raw", metavar="", help="Take codes for a missing value, such as -9999, as they stand: they are values."
        ),
    ] = False
    take_best: TakeBest = False
    dt: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", help="Seconds between samples; taken from --time if omitted, else 1."),
    ] = None
    season: Annotated[
        str | None,
        typer.Option(
            metavar="SAMPLES|none",
            help="Seasons of the output to look for where the model is found out, in samples: 12, or 24,168. Day, week "
            "and year as the clock suggests them, unless told otherwise.",
        ),
    ] = None
    save: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write the trace, sample by sample, to this .parquet or .csv.")
    ] = None
    report: Annotated[str | None, typer.Option(metavar="FILE", help="Write a self-contained HTML report.")] = None
    json: Json = None
    start: From = None
    stop: To = None
    chunk: Chunk = 65_536

    @property
    def outputs(self) -> list[str]:
        return self.output or []

    @property
    def inputs(self) -> tuple[str, ...]:
        return tuple(self.input or ())

    @cached_property
    def changed(self) -> list[str]:
        """The options of models that were given."""
        usual = {field.name: field.default for field in fields(self)}
        return [f"--{name}" for name in OF_MODELS if getattr(self, name) != usual[name]]

    @property
    def is_estimated(self) -> bool:
        """Whether a constant is one of the parameters."""
        return self.offset == "estimated"

    @property
    def center(self) -> str:
        """What of the first chunk is subtracted: mean, median or none; an estimated constant counts from the mean."""
        return "mean" if self.is_estimated else self.offset

    @property
    def called(self) -> tuple[str, ...]:
        """What was called, in words, without its options."""
        return "run", self.file

    def need_output(self) -> None:
        """Refuse what is said of a model without an output."""
        if not self.output:
            about = ", ".join(self.changed) or "--plant"
            raise CommandError(f"{about}: of which column? Say --output.")

    @property
    def candidates(self) -> list[int]:
        """Orders to compare; none unless asked for."""
        if self.orders is None and self.order != "auto":
            return []
        return orders(AUTO if self.orders is None else self.orders)

    @property
    def seasons(self) -> tuple[int, ...] | None:
        """Samples of each season to look for; None: as the clock suggests."""
        from driftwise.analysis.seasons import checked

        if self.season in (None, "none"):
            return None if self.season is None else ()
        lengths = [whole(text.strip()) for text in str(self.season).split(",")]
        if None in lengths:
            raise CommandError(f"--season must be samples, such as 12 or 24,168, or none, got {self.season!r}.")
        try:
            return checked(tuple(lengths))
        except InputError as error:
            raise CommandError(f"--season: {error}") from None

    @property
    def lag(self) -> int | None:
        """Samples that the smoother looks ahead; None: to the end."""
        from driftwise.engine import validation

        if self.smooth in (None, "all"):
            return None
        lag = whole(str(self.smooth))
        if not lag:
            raise InputError(
                f"--smooth must be all (the whole record) or a number of samples to look ahead, at least 1, "
                f"got {self.smooth!r}."
            )
        return validation.count("lag", lag)

    @property
    def memory_word(self) -> str:
        """The word for the memory: that of --memory, else auto where a recursive model need not wait for --jumps."""
        return self.memory or ("constant" if self.model is None or self.jumps is not None else "auto")

    @property
    def policy(self) -> Any:
        """The memory, with the detector of --jumps."""
        return specs.policy(self.memory_word, self.jumps)

    def make_evidence(self, dt: float) -> Any:
        """Return an `OrderEvidence` of the orders to compare; the gate is left out."""
        noise = self.noise
        if "," in self.memory_word:
            raise InputError(
                f"--memory {self.memory_word} lists one number for each parameter, and every order has another number "
                "of them: give one number for all while orders are compared."
            )
        model = dict(noise=lambda order: _noise(noise, order), memory=self.policy, dt=dt, offset=self.is_estimated)
        return analysis.OrderEvidence(self.candidates, len(self.inputs), self.direct, **model)

    def make_estimator(self, dt: float) -> Any:
        """Return the estimator; its prior is not yet in units of the data."""
        if self.offset not in OFFSETS:
            raise InputError(f"--offset must be estimated, mean, median or none, got {self.offset!r}.")
        if self.direct and not self.inputs:
            raise InputError("--direct says that an input acts at once, but there is no --input; which column is it?")
        gate = None
        if self.gate is not None:
            if not self.gate > 0:
                raise InputError(f"--gate must be a positive number of standard deviations, got {self.gate:g}.")
            gate = detect.InnovationGate(sigmas=self.gate)
        if self.model is not None:
            return specs.recursive(
                self.model, self.inputs, memory=self.policy, gate=gate, dt=dt, offset=self.is_estimated
            )
        if not isinstance(self.order, int):
            raise InputError(f"--order must be a whole number or auto, got {self.order!r}.")
        model = dict(
            noise=_noise(self.noise, self.order), memory=self.policy, gate=gate, dt=dt, offset=self.is_estimated
        )
        return families.Joint(self.order, len(self.inputs), self.direct, **model)

    def check_model(self) -> None:
        """Refuse what only the joint filter has."""
        kind, given = str(self.model).partition(":")[0], self.changed
        for option, instead in (
            ("--order", "the orders stand behind the colon"),
            ("--orders", "the orders stand behind the colon; compare runs by their fit"),
            ("--noise", "the model says what colours the noise"),
            ("--direct", "nk = 0 acts at once"),
        ):
            if option in given:
                raise InputError(f"{option} is for the joint filter, without --model; with --model {kind}, {instead}.")
        if self.smooth is not None and kind not in SMOOTHED:
            raise InputError(
                f"--smooth is for {', '.join(SMOOTHED)}, whose regressors are data, and for the joint filter, without "
                f"--model (--noise unknown estimates the colour of the noise as well); --model {kind} is not smoothed."
            )


def orders(text: str) -> list[int]:
    """Return the orders of a range such as 1-5 or a list such as 1,2,4."""
    found: set[int] = set()
    for part in text.split(","):
        low, dash, high = (piece.strip() for piece in part.partition("-"))
        first, last = whole(low), whole(high or low)
        if first is None or last is None or (dash and not high):
            raise InputError(f"--orders takes a range or a list of orders, for example 1-5 or 1,2,4; got {text!r}.")
        if last < first:
            raise InputError(f"--orders {part.strip()} counts downwards; was {last}-{first} meant?")
        if first < 1 or last > LARGEST:
            raise InputError(f"--orders must lie between 1 and {LARGEST}, got {text!r}.")
        found.update(range(first, last + 1))
    return sorted(found)


def _noise(text: str, order):
    kind, _, numbers = text.partition(":")
    if kind in specs.NOISES and not numbers:
        return getattr(models, specs.NOISES[kind])()
    if kind == "polynomial" and numbers:
        d = specs.floats("--noise polynomial:", numbers)
        if len(d) != order:
            raise InputError(
                f"--noise polynomial lists {len(d)} coefficients d0,d1,.. and the order is {order}: it takes as many "
                "as the order (fill up with zeros in front)."
            )
        return models.NoisePolynomial(tuple(d))
    raise InputError(
        "--noise must be equation-error, output-error, unknown or polynomial:d0,d1,.. (as many as the order), "
        f"got {text!r}."
    )
