"""The models that compete when nothing is said: structures, delays and orders, simplest first.

All have an offset, so that where y and u are measured from does not decide. `Joint` of order n with an unknown noise
polynomial is an ARMAX(n, n, n, 1) by another filter: whichever predicts better.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ..detect.self_starting import SelfStarting
from ..estimators.armax.estimator import ARMA, ARMAX, OE
from ..estimators.arx.estimator import AR, ARX
from ..estimators.joint.estimator import Joint
from ..estimators.seasonal.estimator import SeasonalARX
from ..memory.auto import AutoMemory
from ..memory.constant import Constant
from ..memory.exponential_forgetting import ExponentialForgetting
from ..memory.restart_on_change import RestartOnChange
from ..models.noise import UnknownPolynomial
from ..models.scale import InverseGamma

FORGETTING = (
    Constant(),
    ExponentialForgetting(0.999),
    ExponentialForgetting(0.995),
    ExponentialForgetting(0.98),
)  # speeds of change that compete
JOINT, LEVEL, JUMPS = (
    "Joint",
    "level",
    RestartOnChange(SelfStarting("1 per 1500")),
)  # a constant that jumps now and then
FAINT = 0.5e-4  # beside 1e4, the prior variance of a state relative to sigma^2: y is first expected as large as it is
ONE = [(1, 1, 0), (1, 1, 1), (2, 2, 0), (2, 2, 1), (2, 2, 2), (2, 2, 3), (3, 3, 0), (3, 3, 1), (4, 4, 0), (4, 4, 1),
       (4, 4, 2), (2, 6, 0), (8, 8, 0)]  # na, nb, nk with one input  # fmt: skip
SEVERAL = [(1, 1, 0), (2, 2, 0), (2, 2, 1), (3, 3, 0), (4, 4, 0), (6, 3, 0)]  # with several
LONG = [(8, 4, 0), (8, 8, 0)]  # and where the record has rows enough for them
ROWS, WIDEST = (
    20,
    64,
)  # measured outputs for each unknown that these take; the most unknowns, which bounds what they cost
NONE = [1, 2, 3, 5, 8]  # na with none
COLOURED = [1, 2, 3]  # orders of ARMAX, OE and Joint
SEASONAL = "SeasonalARX"
LAST, MEAN = 1.0, 0.1  # gain of a profile that is the last season, and of one that is the mean of about ten
BESIDE = [1, 3]  # na and nb beside a season
DELAYED = [(1, 1, 0), (2, 2, 0), (3, 3, 0), (4, 4, 0), (4, 8, 3)]  # na, nb, and how much before a delay that was found


class Candidate(NamedTuple):
    """One structure: what it is called, its kind, and its orders as keyword arguments."""

    kind: str  # level, AR, ARX, SeasonalARX, ARMA, ARMAX, OE or Joint
    orders: dict[str, Any]
    inputs: int
    dt: float

    @property
    def name(self) -> str:
        """What to call it: ARX(2,2,1)."""
        if self.kind == LEVEL:
            return LEVEL
        if self.kind == SEASONAL:
            return _seasonal_name(**self.orders)
        return f"{self.kind}({','.join(map(_written, self.orders.values()))})"

    @property
    def is_linear(self) -> bool:
        """Whether its regressors are data, so that any memory fits it at little cost."""
        return self.kind in ("AR", "ARX", SEASONAL)

    @property
    def seasons(self) -> tuple[int, ...]:
        """The seasons it knows of, in samples."""
        return self.orders.get("season", ())

    @property
    def follows(self) -> bool:
        """Whether it is shown with a memory that follows a plant as it changes."""
        return self.is_linear or self.kind == LEVEL

    def estimator(self, memory: Any = Constant(), **sizes) -> Any:
        """Return its estimator with a memory, in units of one or of such sizes: y_scale and u_scale."""
        if self.kind == LEVEL:
            return AR(0, memory=JUMPS, offset=True, dt=self.dt, **sizes)
        if self.kind == JOINT:
            return self._joint(memory, **sizes)
        kinds: dict[str, Any] = {"AR": AR, "ARX": ARX, SEASONAL: SeasonalARX, "ARMA": ARMA, "ARMAX": ARMAX, "OE": OE}
        return kinds[self.kind](**self.orders, memory=memory, offset=True, dt=self.dt, **sizes)

    def _joint(self, memory, **sizes) -> Joint:
        """Return the joint filter; by the reference prior of sigma^2 its first predictions would claim to be exact."""
        settings = dict(**self.orders, inputs=self.inputs, noise=UnknownPolynomial(), offset=True, dt=self.dt)
        unknowns = Joint(**settings).model.N
        return Joint(**settings, memory=memory, scale=InverseGamma(0.5 - unknowns / 2, FAINT), **sizes)

    @property
    def memories(self) -> tuple[Any, ...]:
        """The memories it competes with."""
        return (JUMPS,) if self.kind == LEVEL else FORGETTING if self.is_linear else (Constant(),)

    @property
    def best(self) -> Any:
        """Its estimator as a user is shown it: with `AutoMemory`, where it can."""
        return self.estimator(AutoMemory() if self.is_linear else Constant())

    @property
    def reach(self) -> int:
        """The most past outputs, or coefficients of an input."""
        return max((max(v, default=0) if isinstance(v, tuple) else v for v in self._lags.values()), default=0)

    @property
    def unknowns(self) -> int:
        """How many parameters it has, the offset among them; a state is none."""
        if self.kind == JOINT:  # a, b of each input, c
            return self.orders["order"] * (self.inputs + 2) + 1
        own = sum(sum(v) if isinstance(v, tuple) else v for v in self._lags.values())
        return 1 + own + self.orders.get("lags", 0) * len(self.seasons)

    @property
    def _lags(self) -> dict[str, Any]:
        """How many past outputs, coefficients of each input, .. there are, without delays and what is of a season."""
        return {name: v for name, v in self.orders.items() if name not in ("nk", "season", "gain", "lags")}


def _written(orders) -> str:
    """Return a number, or those of several inputs where they differ: 2/1."""
    if not isinstance(orders, tuple):
        return str(orders)
    return str(orders[0]) if len(set(orders)) == 1 else "/".join(map(str, orders))


def _seasonal_name(na, nb, nk, season, gain, lags) -> str:
    """Return SeasonalARX(3; 24, 168): past outputs, coefficients and delay of inputs; seasons, or the last of each."""
    orders = [str(na), *map(_written, (nb, nk) if nb else ())]
    return f"{SEASONAL}({','.join(orders)}; {'last ' * (gain == LAST)}{', '.join(map(str, season))})"


def candidates(
    inputs: int,
    dt: float = 1.0,
    delays: tuple[int, ...] = (),
    samples: int = 0,
    seasons: tuple[int, ...] = (),
) -> list[Candidate]:
    """Return the structures that compete for a record with so many inputs, those with fewer parameters first.

    ``delays`` (k,) are those that the record shows, where the usual ones do not hold them: models with them compete
    as well. ``samples`` are the measured outputs to learn from: the longest equations of several inputs need many.
    ``seasons`` are those to look for, in samples, all in one model.
    """
    k, found = inputs, []

    def add(kind, **orders):
        found.append(Candidate(kind, orders, k, dt))

    if not k:
        add(LEVEL)
        for na in NONE:
            add("AR", na=na)
        for n in COLOURED:
            add("ARMA", na=n, nc=n)
    long = [orders for orders in LONG if k > 1 and orders[0] + k * orders[1] + 1 <= min(samples / ROWS, WIDEST)]
    for na, nb, nk in (ONE if k == 1 else SEVERAL + long) if k else []:
        add("ARX", na=na, nb=(nb,) * k, nk=(nk,) * k)
    for n in BESIDE if seasons else []:
        for gain in (LAST, MEAN):
            add(SEASONAL, na=n, nb=(n,) * k, nk=(0,) * k, season=seasons, gain=gain, lags=n + 1)
    if delays:
        for na, nb, before in DELAYED:
            add("ARX", na=na, nb=(nb,) * k, nk=tuple(max(d - before, 0) for d in delays))
    near = [tuple(max(d + by, 0) for d in delays) for by in (0, -1, 1) if delays]
    for late in dict.fromkeys([(1,) * k, *near]) if k else []:
        for n in COLOURED:
            add("ARMAX", na=n, nb=(n,) * k, nc=n, nk=late)
            add("OE", nb=(n,) * k, nf=(n,) * k, nk=late)
    for n in COLOURED if k else []:
        add(JOINT, order=n)
    return sorted(found, key=lambda c: c.unknowns)
