"""Delay at a matched rate of false alarms, and cost, against the detectors of river; where we lose is here too.

Ours are the designed thresholds and exact delays (the tests hold both to simulation); river's thresholds are matched by
simulation, and a run of river that alarms before the change does not count. One rate is not one hazard: with alpha =
.9999 river alarms half as often as on average in the first 100 samples after a start and twice as often after 2000,
which at 1 per 1000 makes it 2 % sooner than the best possible test of an even rate (jump 1 sd at sample 1000).
"""

from __future__ import annotations

from collections.abc import Iterator

import numba
import numpy as np

import driftwise as dw
from driftwise.detect.alarms import simulated_delay
from driftwise.detect.average_run_length import run_length

from .clock import cpu
from .verdicts import Verdict, at_most, for_information, not_measured

SOURCE = "bench/detectors.py"
RUNS = 20_000  # standard errors of 1 % and less
SAMPLES = 3e7  # simulated for a threshold
FIRST = 30  # river's min_instances
ALPHAS = (1 - 1e-4, 1.0)  # river's default, and without fading
COMPILED = dict(cache=True, nogil=True)


def verdicts() -> Iterator[Verdict]:
    """Yield delays at a matched run length, what is lost where the mean is not known, and microseconds."""
    try:
        from river import drift
    except ImportError:
        yield not_measured("detectors against river", "equal or better", SOURCE, "river is not installed")
        return
    _check_clone(drift)
    for every in (1000, 10_000):
        for jump in (0.3, 0.5, 1.0):
            yield from _against_page_hinkley(every, jump)
    yield from _against_adwin(drift)
    yield from _where_the_mean_is_unknown()
    yield from _costs(drift)


def _against_page_hinkley(every: int, jump: float) -> Iterator[Verdict]:
    ours = dw.PageHinkley(every, jump=jump)
    glr = dw.detect.GLR(every, window=200)
    thresholds = [_threshold(every, jump / 2, alpha) for alpha in ALPHAS]
    for before in (1000, 100):
        mine = ours.delay(jump)
        theirs = [
            float(np.mean(_delays(RUNS, before, jump, jump / 2, h, a, np.random.default_rng(7))))
            for h, a in zip(thresholds, ALPHAS, strict=True)
        ]
        note = f"ours {mine:.1f} samples, river {theirs[0]:.1f} (alpha = .9999), {theirs[1]:.1f} (alpha = 1)"
        if before == 1000:
            any_size, _ = simulated_delay(glr.resolve(), jump, 500, 300)
            note += f"; GLR, jump not known, {any_size:.1f}"
        name = f"delay, 1 false alarm per {every}, jump {jump:g} sd at sample {before}: PageHinkley over river's"
        value = mine / min(theirs)
        yield at_most(name, value, 1.0, "x", SOURCE, note).beside(
            "river", value, "the same test; our threshold comes from a formula, theirs was simulated"
        )


def _against_adwin(drift) -> Iterator[Verdict]:
    rng = np.random.default_rng(5)
    every = float(np.mean([_first(drift.ADWIN(delta=0.3), rng.standard_normal(30_000)) for _ in range(60)]))
    for jump in (0.5, 1.0):
        delays = []
        while len(delays) < 60:
            detector, z = drift.ADWIN(delta=0.3), rng.standard_normal(6000)
            z[1000:] += jump
            at = _first(detector, z)
            if at > 1000:
                delays.append(at - 1000)
        mine = dw.PageHinkley(every, jump=jump).delay(jump)
        note = f"ours {mine:.1f} samples, ADWIN(delta=.3) {np.mean(delays):.1f}, at its own run length of {every:.0f}"
        name = f"delay, jump {jump:g} sd at sample 1000: PageHinkley over ADWIN"
        value = mine / float(np.mean(delays))
        yield at_most(name, value, 1.0, "x", SOURCE, note).beside("river", value)


def _where_the_mean_is_unknown() -> Iterator[Verdict]:
    detector = dw.PageHinkley(10_000, jump=1.0).resolve()
    h, k = float(detector.h[0]), float(detector.k[0])
    off = 0.25
    left = 1 / (1 / run_length(h, k, mean=off) + 1 / run_length(h, k, mean=-off))
    why = "PageHinkley takes the mean before the change for known; PageHinkley learns it, as an estimator would"
    name = f"samples between false alarms, promised 10000, where the mean is wrong by {off:g} sd"
    yield for_information(name, left, "samples", SOURCE, why).beside("river", 10_000 / left, why)


def _costs(drift, samples: int = 20_000) -> Iterator[Verdict]:
    z = np.random.default_rng(0).standard_normal(samples)
    detectors = {
        "PageHinkley": dw.PageHinkley(),
        "VarianceCUSUM": dw.detect.VarianceCUSUM(),
        "GLR, window 200": dw.detect.GLR(),
    }
    river = _microseconds(lambda: [_first(d, z) for d in [drift.PageHinkley(threshold=1e9)]], samples)
    for name, detector in detectors.items():
        value = _microseconds(lambda d=detector: d.scan(z), samples)
        note = f"{1e3 * value:.0f} ns a sample, river's PageHinkley one by one {1e3 * river:.0f} ns"
        yield at_most(
            f"a record through {name}, over river's PageHinkley", value / river, 1.0, "x", SOURCE, note
        ).beside("river", value / river)
    monitor, few = dw.detect.Monitor(dw.PageHinkley(threshold=1e9)), z[:2000].tolist()

    def one_by_one():
        state = monitor.start()
        for value in few:
            state, _ = monitor.update(state, value)

    value = _microseconds(one_by_one, len(few))
    note = f"{value:.1f} us, river {river:.2f}"
    why = "a call into compiled code and a copy of the state; inside an estimator, detection is compiled with it"
    name = "one sample at a time: Monitor.update over river's"
    yield for_information(name, value / river, "x", SOURCE, note).beside("river", value / river, why)


def _microseconds(function, samples: int) -> float:
    function()
    return float(np.median([cpu(function) for _ in range(5)])) / samples * 1e6


def _first(detector, z) -> int:
    """Return after how many samples a river detector alarms first."""
    for t, x in enumerate(z.tolist()):
        detector.update(x)
        if detector.drift_detected:
            return t + 1
    return len(z)


# --- river's PageHinkley, compiled: state n, mean, two sums, their extremes ------------------------------------


def _check_clone(drift) -> None:
    z = np.random.default_rng(1).standard_normal(20_000) + np.repeat([0.0, 0.5, 0.0, -0.5], 5000)
    for alpha in ALPHAS:
        theirs = drift.PageHinkley(delta=0.1, threshold=9.0, alpha=alpha, min_instances=FIRST)
        alarms = []
        for t, x in enumerate(z.tolist()):
            theirs.update(x)
            if theirs.drift_detected:
                alarms.append(t)
        ours = _alarms(z, 0.1, 9.0, alpha)
        if len(alarms) < 20 or ours.tolist() != alarms:
            raise RuntimeError("the compiled copy of river's PageHinkley does not give its alarms: delays mean nothing")


@numba.njit(**COMPILED)
def _fresh(state):
    state[:4] = 0.0
    state[4], state[5] = np.inf, -1.0


@numba.njit(**COMPILED)
def _take(state, x, delta, alpha):
    """Return the larger of the two statistics, -1 while there are too few samples."""
    state[0] += 1.0
    state[1] += (x - state[1]) / state[0]
    dev = x - state[1]
    state[2] = alpha * state[2] + dev - delta
    state[3] = alpha * state[3] + dev + delta
    state[4], state[5] = min(state[4], state[2]), max(state[5], state[3])
    return max(state[2] - state[4], state[5] - state[3]) if state[0] >= FIRST else -1.0


@numba.njit(**COMPILED)
def _alarms(z, delta, threshold, alpha):
    state, found = np.empty(6), []
    _fresh(state)
    for t in range(z.size):
        if _take(state, z[t], delta, alpha) > threshold:
            found.append(t)
            _fresh(state)
    return np.array(found)


@numba.njit(**COMPILED)
def _first_times(runs, thresholds, most, delta, alpha, rng):
    """Return the samples before each threshold is first exceeded (runs, thresholds), at most ``most``."""
    times, state = np.full((runs, thresholds.size), float(most)), np.empty(6)
    for r in range(runs):
        _fresh(state)
        g, t = 0, 0
        while t < most and g < thresholds.size:
            t += 1
            level = _take(state, rng.standard_normal(), delta, alpha)
            while g < thresholds.size and level > thresholds[g]:
                times[r, g] = t
                g += 1
    return times


@numba.njit(**COMPILED)
def _delays(runs, before, jump, delta, threshold, alpha, rng):
    """Return delays (runs,) of a change at sample ``before``; runs that alarm sooner are begun again."""
    found, state = np.empty(runs), np.empty(6)
    for r in range(runs):
        t = 0
        while t < before:
            _fresh(state)
            t = 0
            while t < before:
                t += 1
                if _take(state, rng.standard_normal(), delta, alpha) > threshold:
                    t = before + 1
            t = before if t == before else 0
        while t - before < 100_000:
            t += 1
            if _take(state, jump + rng.standard_normal(), delta, alpha) > threshold:
                break
        found[r] = t - before
    return found


def _threshold(every: int, delta: float, alpha: float) -> float:
    """Return the threshold of a mean run length, by simulation: all times over all alarms, runs cut at 3 times it."""
    grid = np.geomspace(3.0, 150.0, 120)
    times = _first_times(int(SAMPLES / every), grid, 3 * every, delta, alpha, np.random.default_rng(3))
    with np.errstate(divide="ignore"):
        mean = times.sum(axis=0) / np.count_nonzero(times < 3 * every, axis=0)
    inside = np.isfinite(mean)
    return float(np.interp(np.log(every), np.log(mean[inside]), grid[inside]))
