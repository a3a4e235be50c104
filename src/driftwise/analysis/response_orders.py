"""Which response: its order and delays, found by linear least squares at poles that are tried, then refined."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..models.filtering import filter_rows, linear_filter
from ..models.regression import robustly_fitted
from .copies import Copies
from .delays import DelayScan, best_delay, lagged
from .response import Response
from .response_record import HUBER, Record
from .speeds import passed

ORDERS = (0, 1, 2, 3)
HIGHEST = 8  # order that a response is raised to at its end, while each is clearly likelier
TIMES = (0.7, 2.0, 5.0, 12.0, 30.0, 80.0)  # samples, of real poles that are tried
SWINGS = ((3.0, 8.0), (8.0, 16.0), (8.0, 36.0), (20.0, 40.0), (20.0, 84.0))  # time constant and period of pairs
LATEST, PART = 64, 6  # samples of delay that are looked at, at most, and as a part of those measured
MORE = 6.0  # by which the criterion of a higher order must be smaller
ENOUGH = 6  # measured outputs for each parameter


def plainest(record: Record) -> Response:
    """Return what comes before any response: a level with a trend, and white noise."""
    T, k = record.u.shape
    columns = np.array([np.ones(T), np.arange(T) / T - 0.5])
    used = np.isfinite(record.y)
    return Response(
        record=record, a=np.zeros(0), b=np.zeros((k, 0)), nk=(0,) * k, columns=columns, more=np.zeros(2),
        f=np.zeros(0), sigma=np.ones(T), used=used,
    )  # fmt: skip


def respond(plain: Response, is_again: bool = False) -> Response | None:
    """Return the response that Schwarz's criterion prefers; None where too few outputs were measured for any.

    What moves the level, which inputs bend and whose gains change is taken from ``plain``. Where a response is there
    already, ``is_again``, each order begins under the noise of the one below alone.
    """
    many, k = int(plain.used.sum()), len(plain.b)
    if many < ENOUGH * (4 + 2 * k):
        return None
    if not k:
        return cleaned(plain.settled())
    found = orders(plain, is_again)
    return cleaned(likeliest(found)) if found else None


def orders(plain: Response, is_again: bool = False) -> list[Response]:
    """Return a response of each order that there are outputs enough for, the lowest first."""
    found: list[Response] = []
    for n in ORDERS[1 if plain.speeds else 0 :]:
        if not is_enough(plain, n):
            break
        noises = (found[-1],) if found and is_again else (plain, *found[-1:])
        more = fitted(plain, noises, n, lags(n))
        if len(noises) > 1:
            found[-1].cache["raised"] = more
        found.append(more)
    return found


def lags(n: int) -> int:
    """Return how many coefficients B has for each input beside A of order n."""
    return max(2, n)


def is_enough(plain: Response, n: int) -> bool:
    """Say whether there are outputs enough for a response of order n with the same parts."""
    return int(plain.used.sum()) >= ENOUGH * (n + len(plain.b) * lags(n) + len(plain.more))


def raised(now: Response) -> Response | None:
    """Return the response of one order more with the same parts; None of the highest, or of too few outputs."""
    if "raised" in now.cache:
        return now.cache["raised"]
    plain, n = stripped(now), len(now.a) + 1
    if now.speeds or n > HIGHEST or not is_enough(plain, n):
        return None
    now.cache["raised"] = fitted(plain, (plain, now), n, lags(n))
    return now.cache["raised"]


def grown(now: Response) -> Response:
    """Return the same of a higher order where that is clearly likelier, until two orders were in vain.

    Changes are looked for beside an order of three at most; a plant of many modes needs more for its gains. Each order
    is begun under white noise, too: the colour of the one below has part of what the inputs do.
    """
    found = [now]
    while len(now.b) and any(now is one for one in found[-2:]) and (more := raised(found[-1])) is not None:
        found.append(min(more, anew(more), key=lambda one: one.criterion))
        now = likeliest(found)
    return now


def anew(now: Response) -> Response:
    """Return the same, begun as if the noise was white."""
    return replace(now, f=np.zeros(0), cache=now.of_mean()).refined().coloured().settled(2)


def likeliest(found: list[Response]) -> Response:
    """Return the response that Schwarz's criterion prefers, a higher order where that is clear."""
    best = found[0]
    for one in found[1:]:
        if one.criterion < best.criterion - MORE:
            best = one
    return best


def begin(record: Record) -> Response | None:
    """Return the response of a record, none of whose parts change, without outliers."""
    plain = without_outliers(plainest(record))
    return None if plain is None else respond(plain)


def without_outliers(plain: Response) -> Response | None:
    """Return the same without the outliers of a first response; None where too few outputs were measured for any."""
    if plain.used.sum() < ENOUGH * (4 + 2 * len(plain.b)):
        return None
    found = first(plain) if len(plain.b) else plain.settled(1)
    bare = replace(found, f=np.zeros(0), sigma=np.ones(len(found.sigma)), cache={})
    used = bare.without_outliers().used
    return plain if used is bare.used else replace(plain, used=used, cache={})


def cleaned(found: Response) -> Response:
    """Return the same without outliers, fitted again, where that is likelier; what once stood out may do so no more."""
    less = replace(found, used=np.isfinite(found.record.y), cache=found.of_mean()).without_outliers()
    if np.array_equal(less.used, found.used):
        return found
    return min(found, less.coloured().settled(2), key=lambda one: one.criterion)


def fitted(plain: Response, noises, n: int, m: int) -> Response:
    """Return a response of order n: begun under the noise of others, white or of a lower order, and as an equation.

    Each is begun at the poles that leave least, those of the last beside others; the likeliest is taken. Of scattered
    samples it is begun once more as if the noise was white: slow noise between them has parts of the answer.
    """
    found = [first(plain)] if n == 1 else [begun(start, starts(noises[-1], n), n, m) for start in noises]
    if (start := equation(plain, n, m)) is not None:
        found.append(begun(start, [np.roots(np.append(1.0, start.f))], n, m))
    best = min(found, key=lambda one: one.criterion).settled(2)
    return min(best, anew(best), key=lambda one: one.criterion) if plain.record.is_scattered else best


def first(plain: Response) -> Response:
    """Return the response of first order that is begun under white noise."""
    if "first" not in plain.cache:
        plain.cache["first"] = begun(plain, starts(plain, 1), 1, lags(1))
    return plain.cache["first"]


def begun(start: Response, poles, n: int, m: int) -> Response:
    """Return the response of order n that follows from the noise of another one and from poles to try."""
    found = min((tried_at(start, some, m) for some in poles), key=lambda one: one.loss())
    best: Response | None = None
    for _ in range(2):
        now = found.refined(3).coloured().refined(3)
        if best is None or now.criterion < best.criterion:
            best = now
        late = delays(now, now.a, now.nk, m)
        if late == found.nk:
            break
        found = linear(now, now.a, late, m)
    assert best is not None
    return best


def equation(plain: Response, n: int, m: int) -> Response | None:
    """Return a start at the poles of the likeliest difference equation, as if its errors were white."""
    if plain.record.is_scattered or not n:
        return None
    y, x = levelled(plain), moving(plain)
    scan = DelayScan(y, x, n, (m,) * x.shape[1], max(latest(y), 1), is_costly=True)
    if not scan.is_enough:
        return None
    nk = scan.best((0,) * x.shape[1], (0,) * x.shape[1])
    X = np.hstack(
        [lagged(y, range(1, n + 1)), *(lagged(v, range(d, d + m)) for v, d in zip(x.T, nk)), np.ones((len(y), 1))]
    )
    use = np.isfinite(X).all(axis=1) & np.isfinite(y)
    a = -np.linalg.lstsq(X[use], y[use], rcond=None)[0][:n]
    if not np.all(abs(np.roots(np.append(1.0, a))) < 0.999):
        return None
    return replace(plain, f=a, nk=nk, cache={})


def latest(y) -> int:
    """Return the longest delay that is looked at, in samples; y (T,) is NaN where missing."""
    return min(LATEST, int(np.isfinite(y).sum()) // PART)


def levelled(now: Response) -> np.ndarray:
    """Return the outputs that count, less what moves their level by itself; NaN for the others."""
    y, level = np.where(now.used, now.record.y, np.nan), now.beside
    value = now.more[now.placed()["columns"].start :]
    if not len(now.a):
        seen = np.isfinite(y)
        value = np.linalg.lstsq(level[:, seen].T, y[seen], rcond=None)[0]
    return y - value @ level


def moving(now: Response) -> np.ndarray:
    """Return the inputs with their bends and factors, (T, k)."""
    return np.array([now.factor(i) * now.moved(i) for i in range(len(now.b))]).T


def starts(last: Response, n: int) -> list[np.ndarray]:
    """Return sets of n poles: those of a response of lower order and others beside them, and pairs."""
    if n == 0:
        return [np.zeros(0)]
    single = [np.array([math.exp(-1 / tau)]) for tau in TIMES]
    if n == 1:
        return single
    old = np.roots(last.denominator)
    found = [np.concatenate([old, p]) for p in single[:-1]]
    if n == 2:
        return found + pairs()
    is_real = abs(old.imag) < 1e-9
    kept = np.delete(old, np.flatnonzero(is_real)[np.argmin(abs(old[is_real]))]) if is_real.any() else lessened(old)
    return found + [np.concatenate([kept, p]) for p in pairs()]


def pairs() -> list[np.ndarray]:
    """Return the pairs of poles that are tried."""
    return [np.exp(np.array([-1 / tau + 2j * np.pi / p, -1 / tau - 2j * np.pi / p])) for tau, p in SWINGS]


def lessened(poles) -> np.ndarray:
    """Return pairs of poles with a real one in place of the fastest pair."""
    return np.append(poles[np.argsort(-abs(poles), kind="stable")][:-2], 0.8)


def begun_at(plain: Response) -> list[Response]:
    """Return responses of one pole and of pairs that are tried, none fitted: without delays, with the likeliest."""
    found = list[Response]()
    for poles in (*starts(plain, 1), *pairs()):
        a, m = polynomial(poles), lags(len(poles))
        late = sorted({plain.nk, delays(plain, a, plain.nk, m)})
        found += [linear(plain, a, nk, m) for nk in late]
    return found


def tried_at(start: Response, poles, m: int) -> Response:
    """Return the best response with such poles; its delays are looked for where ``start`` has no dynamics."""
    a = polynomial(poles)
    return linear(start, a, start.nk if len(start.a) else delays(start, a, start.nk, m), m)


def polynomial(poles) -> np.ndarray:
    """Return a1, .. of the polynomial with such roots, (n,)."""
    a = [1.0 + 0.0j]
    for pole in poles.tolist():
        a = [now - pole * before for now, before in zip([*a, 0.0], [0.0, *a])]
    return np.real(a[1:])


def linear(start: Response, a, nk, m: int) -> Response:
    """Return the response with A and delays as given, all else by least squares under the noise of ``start``.

    Bends, and gains that change, stay as they were.
    """
    k, at = len(start.b), start.placed()
    more = np.concatenate([start.more[: at["start"].start], np.zeros(len(a)), start.more[at["start"].stop :]])
    found = replace(start, a=np.asarray(a), b=np.ones((k, m)), nk=tuple(nk), more=more, cache=start.of_noise())
    size, first = found.b.size, found.placed()["start"].start
    X = in_stretches(found) if found.speeds else found.regressors(driving(start, found), whitened_before(start))
    value, left = robustly_fitted(X, HUBER)
    now = found.at(np.concatenate([found.a, value[:size], found.more[:first], value[size:]]))
    if not found.gains:  # what the level moved with one is in the mean, too
        now.cache["left"] = left
    return now


def in_stretches(found: Response) -> np.ndarray:
    """Return the slopes of B, the start and the level, (rows, m), of a plant that was faster or slower, and outputs."""
    n, size, first = len(found.a), found.b.size, found.placed()["start"].start
    X = found.steep(1)
    X[:, -1] = found.whitened(np.where(found.used, found.record.y, 0.0))
    return np.ascontiguousarray(np.delete(X, [*range(n), *range(n + size, n + size + first)], axis=1))


def driving(start: Response, found: Response) -> Copies:
    """Return what passes through 1/A for B and the start of ``found``, through the noise of ``start``."""
    if found.moving:
        every, first = found.before, found.placed()["start"].start
        own = every.only(every.places[: found.b.size] + every.places[found.b.size + first :])
        return own.filtered(found.white, np.ones(1))
    if "driving" not in start.cache:  # the same for all poles that are tried
        T, k = start.record.u.shape
        signals = np.vstack([*(start.moved(i) for i in range(k)), np.eye(1, T, start.record.first)])
        start.cache["driving"] = filter_rows(start.white, np.ones(1), signals)
    lags = [(i, late) for i, d in enumerate(found.nk) for late in range(d, d + found.b.shape[1])]
    return Copies(start.cache["driving"], (*lags, *((len(found.nk), late) for late in range(len(found.a)))))


def whitened_before(start: Response) -> np.ndarray:
    """Return what moves the level and, last, the outputs, zero where not used, filtered by the noise, (m + 1, T)."""
    if "whitened" not in start.cache:
        signals = np.vstack([start.beside, np.where(start.used, start.record.y, 0.0)])
        start.cache["whitened"] = filter_rows(start.white, np.ones(1), signals)
    return start.cache["whitened"]


def delays(now: Response, a, nk, m: int) -> tuple[int, ...]:
    """Return the delays that leave least with such poles, under the noise of ``now``, one input after the other."""
    white = now.white
    if "levelled" not in now.cache:  # the same for all poles that are tried
        y = levelled(now)
        late = lagged(y, range(len(white)))
        now.cache["levelled"] = late @ white, latest(y), moving(now)
    y, most, x = now.cache["levelled"]
    if most < 1:
        return tuple(nk)
    driven = linear_filter(white, np.append(1.0, a), x)
    if now.speeds:
        stretches = now.stretched(np.append(1.0, a), now.more[now.placed()["speeds"]])
        driven = linear_filter(white, np.ones(1), passed(stretches, x.T).T)
    if len(nk) == 1 and (found := best_delay(y, driven[:, 0], m, most)) is not None:
        return (found,)
    scan = DelayScan(y, driven, 0, (m,) * x.shape[1], most, is_costly=True)
    return scan.best(tuple(min(d, most) for d in nk), (0,) * len(nk)) if scan.is_enough else tuple(nk)


def stripped(now: Response) -> Response:
    """Return a response without its dynamics and its noise, with all that changes in it: to be begun anew."""
    T, k = now.record.u.shape
    return replace(
        now, a=np.zeros(0), b=np.zeros((k, 0)), nk=(0,) * k, more=np.delete(now.more, now.placed()["start"]),
        f=np.zeros(0), sigma=np.ones(T), cache={},
    )  # fmt: skip
