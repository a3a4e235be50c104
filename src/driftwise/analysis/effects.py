"""What the inputs of a plant do in the end: gains, how they bend, when a step is answered; how far that is known."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..models.quantities import NORMAL_95
from ..results.stable import is_endless, swings
from .response import Response
from .response_covariance import covariance, without_end
from .response_orders import raised
from .segmentation import Hindsight
from .step_response import DRAWS, StepResponse, answers, poles, step_responses

SEED = 0  # of the draws of parameters
BENT, CLEAR = 1.2, 1.5  # of the largest slope over the least: below is straight, above matters
HUGE = 1e9  # of slopes that differ in sign
AGREES = 0.15  # of the period, by which another order may differ
INNER, PLACES = (0.05, 0.95), 6  # quantiles of an input between which its slopes are told, at so many places


class Effect(NamedTuple):
    """The steady gain of an input with its deviation and 95 % interval; its slopes, least and most, where it bends."""

    gain: float
    std: float
    interval: tuple[float, float]
    bend: tuple[float, float] | None
    step: StepResponse | None
    is_open: bool = False  # whether it may bend as far as is known

    @property
    def is_known(self) -> bool:
        """Whether the gain is known to within half of it."""
        return is_known(self.interval)

    def held(self, wait: float) -> Effect:
        """Return the same where its input may have moved so many samples before it was seen to."""
        if not math.isfinite(wait):
            return self._replace(interval=(-math.inf, math.inf), step=None)
        if self.step is None:
            return self
        low, high = self.step.interval
        return self._replace(step=self.step._replace(time=self.step.time + wait / 2, interval=(low, high + wait)))


def is_known(ends) -> bool:
    """Say whether an interval is bounded, and no more than half of the number either side of it."""
    low, high = ends
    return bool(math.isfinite(high - low) and high - low <= abs(high + low) / 2)


UNKNOWN = Effect(math.nan, math.inf, (-math.inf, math.inf), None, None)


class Swing(NamedTuple):
    """A mode that swings: its period and time constant in samples, and the 95 % interval of the period."""

    period: float
    time: float
    interval: tuple[float, float]


class Effects(NamedTuple):
    """The effect of each input, how answers swing, and the error one step ahead of what this comes from."""

    of: tuple[Effect, ...]
    swing: Swing | None = None
    error: float = math.inf
    is_hindsight: bool = False
    is_endless: bool = False  # whether an input may be integrated: it has no gain, then
    about: float | None = None  # the output at which gains are these, where they grow in proportion to it

    def held(self, waits) -> Effects:
        """Return the same of inputs that are known at some rows only and held between them.

        ``waits`` (k,): samples for which each stood still on average, infinite where it moved at most rows: then it
        moved between them, too, and what it did is not known. Else it moved up to a row earlier than it was seen to.
        """
        return self._replace(of=tuple(effect.held(wait) for effect, wait in zip(self.of, waits)))

    def unknown(self) -> Effects:
        """Return the same of inputs that do nobody knows what."""
        return self._replace(of=(UNKNOWN,) * len(self.of), swing=None)

    def unending(self) -> Effects:
        """Return the same of answers that have no end."""
        return self.unknown()._replace(is_endless=True)


def of_model(model, inputs: int, count: int) -> Effects:
    """Return the effects that a model says, learnt from so many samples."""
    if not inputs:
        return Effects(())
    if any(is_endless(abs(p), std, count) for p, std in zip(model.poles, model.poles_std)):
        return Effects((UNKNOWN,) * inputs, is_endless=True)
    ends, steps = model.dc_gain_interval(), step_responses(model)
    if not model.is_stable:
        ends = [(-math.inf, math.inf)] * inputs
    found = [
        Effect(float(gain), float(std), (float(low), float(high)), None, step)
        for gain, std, (low, high), step in zip(model.dc_gain, model.dc_gain_std, ends, steps)
    ]
    whole = getattr(model, "common", model)
    drawn = whole.form.polynomials(np.vstack([whole.values, whole.samples[:DRAWS]]))[0]
    return Effects(tuple(found), swing(poles(drawn)))


def of_response(found: Hindsight) -> Effects:
    """Return the effects of a response that was fitted in hindsight, as they are at its end."""
    now, k = found.response, len(found.response.b)
    error = float(np.sqrt(np.mean((now.spread * found.units.at(now.expected)) ** 2)))
    if not k:
        return Effects((), None, error, True)
    P = covariance(now)
    if not np.isfinite(P).all():
        return Effects((UNKNOWN,) * k, None, error, True)
    endless = without_end(now, P)
    own = len(now.a) + now.b.size
    drawn = now.theta[:own] + np.vstack([np.zeros(own), deviations(P[:own, :own], DRAWS)])
    a, b = polynomials(now, drawn)
    steps = answers(a, b)
    gains = []
    for i in range(k):
        if endless[i]:
            gains.append(UNKNOWN)
            continue
        scale = found.units.y_scale / found.units.u_scale[i]
        slope = gain_slope(now, i)
        std = float(math.sqrt(max(float(slope @ P @ slope), 0.0)) * scale)
        gain = float(gain_of(now, i) * scale)
        gains.append(
            Effect(
                gain,
                std,
                (gain - NORMAL_95 * std, gain + NORMAL_95 * std),
                bend(now, i, gain),
                steps[i],
                may_bend(now, i),
            )
        )
    period = swing(poles(a))
    return Effects(tuple(gains), period and borne_out(now, period), error, True, any(endless), found.units.about)


def borne_out(now: Response, found: Swing) -> Swing | None:
    """Return a swing as a response of one order more has it; None where that has none of about the same period.

    Without a mode that the plant has, a period is wrong by more than its bars know: they take the order for the true
    one. With a mode too many it is right, and its bars are wider.
    """
    more = raised(now)
    if more is None:
        return found
    n, P = len(more.a), covariance(more)
    if not np.isfinite(P).all():
        return None
    drawn = more.theta[:n] + np.vstack([np.zeros(n), deviations(P[:n, :n], DRAWS)])
    again = swing(poles(np.insert(drawn, 0, 1.0, axis=1)), found.period)
    return again if again is not None and abs(again.period / found.period - 1) < AGREES else None


def swing(drawn, about: float | None = None) -> Swing | None:
    """Return the slowest pair of poles, or of about a period, that nearly all draws have, the likeliest first."""

    def rank(p) -> float:
        return abs(p) if about is None else -abs(math.log(2 * math.pi / np.angle(p) / about))

    pairs = [
        max((p for p in poles if swings(p) and p.imag > 0 and abs(p) < 1), key=rank, default=None) for poles in drawn
    ]
    periods = [2 * math.pi / float(np.angle(p)) for p in pairs if p is not None]
    if pairs[0] is None or len(periods) < 0.975 * len(pairs):
        return None
    low, high = np.quantile(periods, [0.025, 0.975])
    return Swing(periods[0], -1 / math.log(abs(pairs[0])), (float(min(low, periods[0])), float(max(high, periods[0]))))


def deviations(P, many: int) -> np.ndarray:
    """Return draws (many, N) of a normal law with covariance P, by its symmetric root in units of the deviations.

    Eigenvectors have no sign, and a small variance beside a large one no digits: what is drawn depends on neither.
    """
    size = np.sqrt(np.maximum(np.diag(P), 1e-300))
    value, vector = np.linalg.eigh(P / size / size[:, None])
    root = (vector * np.sqrt(np.maximum(value, 0.0))) @ vector.T
    return np.random.default_rng(SEED).standard_normal((many, len(P))) @ root * size


def polynomials(now: Response, theta) -> tuple[np.ndarray, np.ndarray]:
    """Return A (S, n + 1) and B of each input with its delay, (S, k, lags), of the first parameters of a response."""
    n, (k, m) = len(now.a), now.b.shape
    b = np.zeros((len(theta), k, max(now.nk) + m))
    for i, lag in enumerate(now.nk):
        b[:, i, lag : lag + m] = theta[:, n + i * m : n + (i + 1) * m]
    return np.insert(theta[:, :n], 0, 1.0, axis=1), b


def gain_of(now: Response, i: int) -> float:
    """Return the steady gain of an input at the end, in units of the response."""
    return float(now.b[i].sum() / now.denominator.sum() * now.factor(i)[-1])


def gain_slope(now: Response, i: int) -> np.ndarray:
    """Return its derivative by each parameter."""
    theta, found = now.theta, np.zeros(len(now.theta))
    for j in range(len(theta)):
        h = np.zeros(len(theta))
        h[j] = 1e-6 * max(abs(theta[j]), 1e-3)
        found[j] = (gain_of(now.at(theta + h), i) - gain_of(now.at(theta - h), i)) / (2 * h[j])
    return found


def may_bend(now: Response, i: int) -> bool:
    """Say whether an input that is not bent might be, by ``CLEAR`` or more, as far as the record tells."""
    if i in now.bent or not len(now.record.shapes[i]):
        return False
    other = now.with_bend(i).refined(2)
    shapes, at = now.record.shapes[i], other.placed()["bends"]
    own = slice(len(now.a) + now.b.size + at.stop - len(shapes), len(now.a) + now.b.size + at.stop)
    P = covariance(other)[own, own]
    if not np.isfinite(P).all():
        return True
    draws = other.theta[own] + deviations(P, DRAWS // 4)
    spreads = [ratio(slopes(now, i, now.record.u[:, i] + c @ shapes)) for c in draws]
    return float(np.quantile(spreads, 0.5)) > CLEAR


def slopes(now: Response, i: int, w) -> list[float]:
    """Return the slopes of a bent input between places from end to end of what it mostly did, or its gain is made of.

    The slope of a straight line through all samples is the mean of the slopes at x, each weighed by how far all that
    lies above x is from the middle: of a Gaussian input both are the same places, of rain few samples make the gain.
    """
    x = now.record.u[:, i]
    order = np.argsort(x, kind="stable")
    line, parts = x[order], np.linspace(*INNER, PLACES)
    above = np.cumsum((line - line.mean())[::-1])[::-1][1:] * np.diff(line)
    mass = np.cumsum(np.maximum(above, 0.0))
    made = line[1:][np.searchsorted(mass, parts * mass[-1])] if len(mass) and mass[-1] > 0 else line[:0]
    at = np.unique(np.concatenate([np.quantile(line, parts, method="nearest"), made]))
    value = w[order][np.searchsorted(line, at)]
    return [float(one) for one in np.diff(value) / np.diff(at)]


def ratio(found: list[float]) -> float:
    """Return the largest of some slopes over the least; `HUGE` where they differ in sign."""
    if not found:
        return 1.0
    return max(found) / min(found) if min(found) > 1e-9 * max(found) else HUGE


def bend(now: Response, i: int, gain: float) -> tuple[float, float] | None:
    """Return the slopes of a gain that bends, at the ends of what its input mostly did; None where it hardly does."""
    if i not in now.bent:
        return None
    found = slopes(now, i, now.moved(i))
    return (gain * min(found), gain * max(found)) if ratio(found) > BENT else None
