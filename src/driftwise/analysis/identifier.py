"""Which model, from the record alone: every candidate predicts, and the simplest of the best is taken."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..engine import validation
from ..engine.errors import InputError
from ..estimators.model_average.estimator import ModelAverage, levels
from ..estimators.model_average.step import NAIVE
from ..estimators.model_average.trace import AverageTrace
from ..memory.exponential_forgetting import ExponentialForgetting
from ..memory.restart_on_change import RestartOnChange
from .candidates import LEVEL, Candidate, candidates
from .delays import shown_delays
from .seasons import held

PILOT, MOVED = 200, 10  # samples that set the units, and how many of each column differ from its first; at most half
NARROW, KEEP = 16_384, 4  # samples after which so many structures go on
BASELINES = "last value", "mean"  # so far: what a model has to beat
AWAY = 10.0  # times the error of the mean: a member has run away
LEARNING = 1 / 3  # of the evidence of the first half counts: there the larger models learn, and are good afterwards
CLOSE = 0.5  # log odds below which the simpler model is taken
SEEN = math.log(20.0)  # log odds of forgetting over constant parameters from which the plant is taken to change


class Rival(NamedTuple):
    """How well a candidate predicted, with the memory that suited it best."""

    candidate: Candidate
    memory: Any
    evidence: float  # log density of the outputs, beside the best that has not run away; of the first half `LEARNING`
    rmse: float
    unknowns: int
    ran_away: bool = False  # its errors were ten times those of the mean of y: it forecasts no more

    @property
    def name(self) -> str:
        return self.candidate.name


class Identifier:
    """Candidates that compete on a record that comes piece by piece.

    ``add`` a piece and get its forecast, made by all of them from the samples before each. The model is chosen from the
    first piece (``chosen``), so that a record in one piece is judged as a whole.

    Parameters
    ----------
    inputs : int
    dt : float
        Seconds between samples.
    seasons : tuple of int
        Samples of each season that y may have; of those that the first piece holds three times, models compete.
    """

    def __init__(self, inputs: int = 0, dt: float = 1.0, seasons: tuple[int, ...] = ()):
        self.seasons = seasons
        self.inputs, self.dt = validation.count("inputs", inputs), validation.size("dt", dt)
        self.candidates: list[Candidate] = []
        self._members: list[tuple[Candidate, Any]] = []
        self._average: Any = None
        self._state: Any = None
        self._halfway = np.zeros(0)  # evidence of each member in the first half of the first piece
        self.samples = 0
        self.rivals: list[Rival] = []
        self.is_changing = False  # whether regressions that forget are likelier than those with constant parameters
        self.naive: dict[str, float] = {}

    def add(self, y, u=None, time=None) -> AverageTrace:
        """Take in the next piece, y (T,) and u (T, k), and return its forecast."""
        y, u = validation.record(y, u, self.inputs)
        is_first = self._average is None
        if is_first:
            self._begin(y, u)
        half = len(y) // 2 if is_first else 0
        begins = sorted({0, half, min(max(NARROW - self.samples, 0), len(y))})
        parts = []
        for begin, end in zip(begins, [*begins[1:], len(y)]):
            if is_first and begin == half:
                self._halfway = self._average.evidence(self._state)[: len(self._members)]
            parts.append(self._scan(y[begin:end], u[begin:end]))
            if self.samples == NARROW and end > begin:
                self._narrow()
        if is_first:
            self._judge()
        return joined(parts, time)

    def _begin(self, y, u):
        if not np.isfinite(y).any():
            raise InputError("y holds no number: nothing can be identified. Is it the right column?")
        pilot = slice(pilot_length(y, u))
        self.pilot = y[pilot].copy(), u[pilot].copy() if self.inputs else None
        half = slice(max(len(y) // 2, 1))  # what follows is forecast by who has not seen it
        measured = int(np.isfinite(y).sum())
        delays, seasons = shown_delays(y[half], u[half]), held(self.seasons, measured)
        self.candidates = candidates(self.inputs, self.dt, delays, measured, seasons)
        self._members = [(c, memory) for c in self.candidates for memory in c.memories]
        center, sizes = self._units()
        members = [c.estimator(memory, **sizes) for c, memory in self._members]
        self._halfway = np.zeros(len(members))
        names = [f"{c.name}, {memory_words(m)}" for c, m in self._members]
        settle = max(30, 2 * max(c.unknowns for c in self.candidates))
        self._average = ModelAverage(members, names=names, settle=settle, y_scale=sizes["y_scale"], center=center)
        self._state = self._average.start()

    def _units(self) -> tuple[list[float], dict[str, Any]]:
        """Return the point from which candidates see the data, and the typical sizes there, as options of theirs."""
        y, u = validation.record(*self.pilot, self.inputs)
        center = levels(y, u)
        return center, self.candidates[0].estimator().scales(y - center[0], u - center[1:] if self.inputs else None)

    def _scan(self, y, u) -> AverageTrace:
        trace = self._average.scan(y, u if self.inputs else None, state=self._state)
        self._state, self.samples = trace.state, self.samples + len(y)
        return trace

    def _narrow(self):
        """Go on with the best structures only, a regression and one without a season among them, with all memories."""
        evidence = self._average.evidence(self._state)
        order = sorted(range(len(self._members)), key=lambda i: -evidence[i])
        best = list(dict.fromkeys(self._members[i][0].name for i in order))[:KEEP]
        ranked = [self._members[i][0] for i in order]
        best.append(next(c.name for c in ranked if c.is_linear))
        best.append(next(c.name for c in ranked if not c.seasons))
        keep = [i for i, (c, _) in enumerate(self._members) if c.name in best]
        self._go_on(keep)

    def _go_on(self, keep):
        """Go on with some of the members."""
        self._average, self._state = self._average.narrowed(self._state, keep)
        self._members = [self._members[i] for i in keep]
        self._halfway = self._halfway[keep]

    def _judge(self):
        """Rank the candidates by the evidence of all samples so far; go on without members that have run away."""
        M, average = len(self._members), self._average
        evidence = average.evidence(self._state)[:M] - (1 - LEARNING) * self._halfway
        squares = average.squares(self._state)[:M]
        self.naive, count = self.baselines, self._judged
        found: dict[str, Rival] = {}
        for (c, memory), log, square in zip(self._members, evidence, squares):
            rmse = math.sqrt(square / count)
            rival = Rival(c, memory, float(log), rmse, c.unknowns, rmse > AWAY * self.naive["mean"])
            found[c.name] = max(found.get(c.name, rival), rival, key=lambda r: (not r.ran_away, r.evidence))
        ranked = sorted(found.values(), key=lambda r: (r.ran_away, -r.evidence))
        self.rivals = [rival._replace(evidence=rival.evidence - ranked[0].evidence) for rival in ranked]
        forgets = np.array([isinstance(memory, ExponentialForgetting) for _, memory in self._members])
        constant = np.array([c.is_linear for c, _ in self._members]) & ~forgets
        self.is_changing = bool(evidence[forgets].max() > evidence[constant].max() + SEEN)
        keep = [i for i, square in enumerate(squares) if not math.sqrt(square / count) > AWAY * self.naive["mean"]]
        if 0 < len(keep) < M:
            self._go_on(keep)

    @property
    def _judged(self) -> float:
        """How many samples count; NaN where they are too few to compare models by."""
        count = float(self._state["own"]["seen"]) - self._average.task.settle
        return count if count > 0 else math.nan

    @property
    def baselines(self) -> dict[str, float]:
        """Errors of last value and mean in all samples so far, as ``naive`` has them of the first piece."""
        squares = self._average.squares(self._state)[-len(NAIVE) :]
        found = dict(zip(NAIVE, np.sqrt(squares / self._judged).tolist()))
        return {name: found[name] for name in BASELINES}

    @property
    def chosen(self) -> Rival:
        """The candidate with the fewest parameters of those as likely as the best.

        Of a plant that is seen to change, only of those that can follow it: the others have constant parameters, and
        one that learns from the past as a whole may be likelier and yet lag from now on.
        """
        able = [r for r in self.rivals if not r.ran_away] or self.rivals
        able = [r for r in able if not self.is_changing or r.candidate.follows] or able
        close = [r for r in able if r.evidence > able[0].evidence - CLOSE]
        return min(close, key=lambda r: (r.unknowns, -r.evidence))

    @property
    def structure(self) -> tuple[int, tuple[int, ...], tuple[int, ...]]:
        """Orders (na, nb, nk) of the most likely regression: only an offset where a level is chosen."""
        if self.chosen.candidate.kind == LEVEL:
            return 0, (), ()
        orders = next(rival.candidate.orders for rival in self.rivals if rival.candidate.is_linear)
        return orders["na"], orders.get("nb", ()), orders.get("nk", ())

    @property
    def center(self) -> np.ndarray:
        """Means of y and of each input in the first samples, (1 + k,): models see the distance from there."""
        return self._average.center

    @property
    def estimator(self) -> Any:
        """The estimator of the chosen model, in units of the data about their ``center``."""
        return self._scaled(self.chosen.candidate.best)

    @property
    def steady(self) -> Any:
        """The same with the plainest memory of the candidate: constant parameters."""
        return self._scaled(self.chosen.candidate.estimator(self.chosen.candidate.memories[0]))

    def _scaled(self, estimator) -> Any:
        y, u = self.pilot
        return estimator.scaled_to(y - self.center[0], u if u is None else u - self.center[1:])


def pilot_length(y, u) -> int:
    """Return how many samples set the units: the first ones, and more until each column that moves has moved."""
    half = max(len(y) // 2, 1)
    found = min(PILOT, half)
    for column in (y[:half], *u[:half].T):
        known = np.flatnonzero(np.isfinite(column))
        moved = known[column[known] != column[known[0]]] if known.size else known
        if moved.size:
            found = max(found, int(moved[min(MOVED, moved.size) - 1]) + 1)
    return found


def memory_words(memory) -> str:
    """Return how fast a memory of the candidates forgets."""
    if isinstance(memory, RestartOnChange):
        return "until it jumps"
    return f"forgetting {memory.lam:g}" if isinstance(memory, ExponentialForgetting) else "constant"


def joined(parts, time) -> AverageTrace:
    """Return pieces as one trace; members that were left out after the first piece have weight zero then."""
    first, last = parts[0], parts[-1]
    outs = np.concatenate([widened(part, first.names) for part in parts])
    y, u = (np.concatenate([getattr(part, c) for part in parts]) for c in ("y", "u"))
    return AverageTrace(first.estimator, y, u, outs, "std", last.state, time=time)


def widened(part: AverageTrace, names) -> np.ndarray:
    """Return the columns of a piece with a weight for each of ``names``: zero for members that were left out."""
    head = part.estimator.columns["weights"].start
    outs = np.zeros((len(part), head + len(names)))
    outs[:, :head] = part.table[:, :head]
    outs[:, [head + names.index(name) for name in part.names]] = part.table[:, head:]
    return outs
