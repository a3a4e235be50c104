"""What a user asked for on the command line, in words, turned into the parts of an estimator."""

from __future__ import annotations

from typing import Any, NamedTuple

from driftwise import analysis, detect, models
from driftwise import estimators as families
from driftwise.cli import specs
from driftwise.cli.targets import check_targets
from driftwise.engine.errors import InputError

__all__ = ["Plan", "orders"]

AUTO = "1-5"  # what --order auto compares unless told otherwise
LARGEST = 30
SMOOTHED = ("ar", "arx", "regression")  # recursive models that look back


class Plan(NamedTuple):
    """The options of `driftwise run`."""

    file: str
    output: str
    inputs: tuple[str, ...]
    time: str | None = None
    order: int | str = 2
    noise: str = "equation-error"
    memory: str | None = None
    gate: float | None = None
    direct: bool = False
    center: str = "mean"
    dt: float | None = None
    save: str | None = None
    report: str | None = None
    json: str | None = None
    chunk: int = 65_536
    start: float | str | None = None  # a number, or a date
    stop: float | str | None = None
    orders: str | None = None
    smooth: str | None = None
    model: str | None = None
    jumps: str | None = None
    raw: bool = False  # whether codes for a missing value are taken as they stand
    chosen: bool = False  # whether the order was chosen by its evidence

    @property
    def is_auto(self) -> bool:
        """Whether the order is to be chosen by its evidence."""
        return self.order == "auto"

    @property
    def candidates(self) -> list[int]:
        """Orders to compare; none unless asked for."""
        if self.orders is None:
            return orders(AUTO) if self.is_auto else []
        return orders(self.orders)

    @property
    def lag(self) -> int | None:
        """Samples that the smoother looks ahead; None: to the end."""
        if self.smooth in (None, "all"):
            return None
        if not str(self.smooth).isdecimal() or int(str(self.smooth)) < 1:
            raise InputError(
                f"--smooth must be all (the whole record) or a number of samples to look ahead, at least 1, "
                f"got {self.smooth!r}."
            )
        return int(str(self.smooth))

    @property
    def kept(self) -> str:
        """The word for the memory: that of --memory, else auto where a recursive model need not wait for --jumps."""
        return self.memory or ("constant" if self.model is None or self.jumps is not None else "auto")

    @property
    def policy(self) -> Any:
        """The memory, with the detector of --jumps."""
        return specs.policy(self.kept, self.jumps, self.model is None)

    def check(self) -> None:
        """Refuse wrong options before the table is read."""
        check_targets(self)
        if self.model is not None:
            self._check_model()
        _ = self.lag
        if self.is_auto and self.file == "-":
            raise InputError(
                "--order auto reads the table twice, and standard input can be read only once: put it into a file, or "
                f"look at --orders {self.orders or AUTO} first and then give --order."
            )
        dt = 1.0 if self.dt is None else self.dt
        if self.candidates:
            self.evidence(dt)
        for order in self.candidates:
            self._replace(order=order).estimator(dt)
        if not self.is_auto:
            self.estimator(dt)

    def evidence(self, dt: float) -> Any:
        """Return an `OrderEvidence` of the orders to compare; the gate is left out."""
        noise = self.noise
        if "," in self.kept:
            raise InputError(
                f"--memory {self.kept} lists one number for each parameter, and every order has another number of "
                "them: give one number for all while orders are compared."
            )
        return analysis.OrderEvidence(
            self.candidates,
            len(self.inputs),
            self.direct,
            noise=lambda order: _noise(noise, order),
            memory=self.policy,
            dt=dt,
        )

    def estimator(self, dt: float) -> Any:
        """Return the estimator; its prior is not yet in units of the data."""
        if self.center not in ("mean", "median", "none"):
            raise InputError(f"--center must be mean, median or none, got {self.center!r}.")
        if self.direct and not self.inputs:
            raise InputError("--direct says that an input acts at once, but there is no --input; which column is it?")
        gate = None
        if self.gate is not None:
            if not self.gate > 0:
                raise InputError(f"--gate must be a positive number of standard deviations, got {self.gate:g}.")
            gate = detect.InnovationGate(sigmas=self.gate)
        if self.model is not None:
            return self._recursive(gate, dt)
        if not isinstance(self.order, int):
            raise InputError(f"--order must be a whole number or auto, got {self.order!r}.")
        return families.Joint(
            self.order,
            len(self.inputs),
            self.direct,
            noise=_noise(self.noise, self.order),
            memory=self.policy,
            gate=gate,
            dt=dt,
        )

    def _check_model(self) -> None:
        """Refuse what only the joint filter has."""
        usual, kind = Plan._field_defaults, str(self.model).partition(":")[0]
        for option, is_given, instead in (
            ("--order", self.order != usual["order"], "the orders stand behind the colon"),
            ("--orders", self.orders is not None, "the orders stand behind the colon; compare runs by their fit"),
            ("--noise", self.noise != usual["noise"], "the model says what colours the noise"),
            ("--direct", self.direct, "nk = 0 acts at once"),
        ):
            if is_given:
                raise InputError(f"{option} is for the joint filter, without --model; with --model {kind}, {instead}.")
        if self.smooth is not None and kind not in SMOOTHED:
            raise InputError(
                f"--smooth is for {', '.join(SMOOTHED)}, whose regressors are data, and for the joint filter, without "
                f"--model (--noise unknown estimates the colour of the noise as well); --model {kind} is not smoothed."
            )

    def _recursive(self, gate, dt: float) -> Any:
        """Return the recursive estimator that --model names."""
        return specs.recursive(str(self.model), self.inputs, memory=self.policy, gate=gate, dt=dt)


def orders(text: str) -> list[int]:
    """Return the orders of a range such as 1-5 or a list such as 1,2,4."""
    found: set[int] = set()
    for part in text.split(","):
        low, dash, high = (piece.strip() for piece in part.partition("-"))
        if not low.isdecimal() or (dash and not high.isdecimal()):
            raise InputError(f"--orders takes a range or a list of orders, for example 1-5 or 1,2,4; got {text!r}.")
        first, last = int(low), int(high or low)
        if last < first:
            raise InputError(f"--orders {part.strip()} counts downwards; was {last}-{first} meant?")
        if first < 1 or last > LARGEST:
            raise InputError(f"--orders must lie between 1 and {LARGEST}, got {text!r}.")
        found.update(range(first, last + 1))
    return sorted(found)


def _noise(text: str, order):
    kind, _, numbers = text.partition(":")
    if kind == "output-error" and not numbers:
        return models.OutputError()
    if kind == "equation-error" and not numbers:
        return models.EquationError()
    if kind == "unknown" and not numbers:
        return models.UnknownPolynomial()
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
