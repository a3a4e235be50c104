"""The records that estimators are run over, and what is done with an estimator: the numbers of it."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

import driftwise as dw

SAMPLES = 200


# --- records ---------------------------------------------------------------------------------------------------


@functools.cache
def record(inputs=1, outputs=1, samples=SAMPLES, missing=0.08, wild=True):
    """Return y (T,) or (T, p) and u (T,) or (T, k): a plant whose gain jumps half-way, gaps in both, two outliers."""
    rng = np.random.default_rng(19)
    p, k = outputs, max(inputs, 1)
    A, B = np.full((p, p), -0.1) + 0.8 * np.eye(p), 1.0 + rng.random((p, k))
    y, u, e = np.zeros((samples, p)), rng.standard_normal((samples, k)), 0.2 * rng.standard_normal((samples, p))
    for t in range(2, samples):
        y[t] = A @ y[t - 1] - 0.3 * y[t - 2] + (B if t < samples // 2 else 0.5 * B) @ u[t - 1] + e[t] + 0.4 * e[t - 1]
    if wild:
        y[samples // 4], y[samples // 3] = 30.0, -25.0
    y[rng.random(y.shape) < missing], u[rng.random(u.shape) < missing / 4] = np.nan, np.nan
    return y[:, 0] if p == 1 else y, None if inputs == 0 else u[:, 0] if k == 1 else u


@functools.cache
def motion(samples=SAMPLES, missing=0.05):
    """Return instants that are no clock's, a position that swings, and the force on it."""
    rng = np.random.default_rng(7)
    at = np.cumsum(rng.uniform(0.5, 1.5, samples))
    y = 3 * np.sin(0.3 * at) + 0.05 * rng.standard_normal(samples)
    y[rng.random(samples) < missing] = np.nan
    return at, y, np.sign(np.sin(0.1 * at))


def plots(samples=40, objects=2):
    """Return the columns of a table of plots: objects that turn, one without an address, one plot that is wild."""
    rng, k, rows = np.random.default_rng(3), np.arange(samples), []
    for i in range(objects + 1):
        course = i + np.cumsum(np.where((k > 15) & (k < 31), np.radians(1.5) * 4, 0.0))
        path = np.cumsum(600 * np.stack([np.sin(course), np.cos(course)], axis=1), axis=0) + 9000 * i
        path = path + 20 * rng.standard_normal((samples, 2))
        rows += [(1.7e9 + 0.3 * i + 4 * j, *path[j], f"AB000{i}" if i < objects else "") for j in k]
    rows[20] = (rows[20][0], 9e5, 9e5, "AB0000")
    return dict(zip(("time", "east", "north", "icao24"), map(list, zip(*sorted(rows)))))


# --- what is done with an estimator ----------------------------------------------------------------------------


def seen(trace) -> dict[str, Any]:
    """Return the numbers of a trace."""
    return {"state": trace.state, "table": trace.table, "columns": list(trace.columns().values())}


def ways(est, inputs=1, outputs=1, samples=SAMPLES, few=6, **options) -> dict[str, Any]:
    """Return the numbers of an estimator along a record, a few more samples one by one, and two series at once."""
    y, u = record(inputs, outputs, samples)
    found = seen(trace := est.scan(y, u, **options))
    state, steps = trace.state, []
    for t in range(few):
        state, step = est.update(state, y[t], None if u is None else u[t])
        steps.append(step)
    two = [np.stack([c[:few], c[few : 2 * few]]) for c in (y, u) if c is not None]
    return found | {"stream": [state, steps], "fleet": list(est.update_batch(est.start(2), *two))}


def halves(est, inputs=1, outputs=1, samples=SAMPLES):
    """Return the numbers of the second half of a record, gone on with from a file."""
    (y, u), cut = record(inputs, outputs, samples), samples // 2
    first = est.scan(y[:cut], None if u is None else u[:cut])
    dw.save_state(est, first.state, "state.json")
    est, state = dw.load_state("state.json")
    return seen(est.scan(y[cut:], None if u is None else u[cut:], state=state))


def kept(est, inputs=1, outputs=1):
    """Return the numbers of a trace with covariances, and again from its file."""
    trace = est.scan(*record(inputs, outputs), keep="covariance")
    trace.save("trace.npz")
    again = type(trace).load("trace.npz")
    return seen(trace) | {"again": seen(again), "P": [trace.covariance, est.covariance(trace.state)]}


def boxed(plant="battery", noise=1e-3, **options):
    """Return the numbers of a plant in formulas: a record, samples one by one, two series, and the other half."""
    est = dw.GreyBox(plant, start=None, **options)
    _, _, u = motion()
    y = est.simulate(0.02 + 0.01 * u, noise=noise, seed=3)
    found, half = seen(trace := est.scan(y, u, time=np.cumsum(0.5 + abs(u)))), len(y) // 2
    state, step = est.update(trace.state, y[0], u[0])
    two = [np.stack([c[:30], c[30:60]]) for c in (y, u)]
    rest = est.scan(y[half:], u[half:], state=est.scan(y[:half], u[:half]).state)
    return found | {"stream": [state, step], "fleet": list(est.update_batch(est.start(2), *two)), "rest": seen(rest)}


def observed(est, inputs=1, outputs=1, **options):
    """Return the numbers of an observer of a known plant."""
    _, y, u = motion()
    y = y if outputs == 1 else np.stack([y] * outputs, axis=1)
    u = u if inputs else None
    found = seen(trace := est.scan(y, u, **options))
    if options:
        return found
    state, step = est.update(trace.state, y[0], None if u is None else u[0])
    two = [np.stack([c[:30], c[30:60]]) for c in (y, u) if c is not None]
    return found | {"stream": [state, step], "fleet": list(est.update_batch(est.start(2), *two))}


def herd(est, series=5, inputs=1, outputs=1, samples=40):
    """Return the numbers of a fleet: a long table in any order, then one sample of some of its series."""
    y, u = record(inputs, outputs, series * samples)
    keys = np.random.default_rng(5).permutation(np.repeat(np.arange(series), samples))
    fleet = dw.Fleet(est, threads=1)
    step = fleet.scan(keys, y, u)
    some = fleet.update_batch([3, 1], y[:2], None if u is None else u[:2])
    fleet.save("fleet.parquet")
    return {"states": fleet.states, "steps": [step, some], "again": dw.Fleet.load("fleet.parquet").states}


def alarms(detector, slopes=0):
    """Return what a detector says of a shift, and one sample at a time."""
    rng = np.random.default_rng(11)
    z, c = rng.standard_normal(3 * SAMPLES), rng.standard_normal((3 * SAMPLES, slopes))
    z[150:], z[50] = z[150:] * 1.5 + 1.0, np.nan
    found = detector.scan(z, c) if slopes else detector.scan(z)
    monitor = dw.detect.Monitor(detector, parameters=slopes) if slopes else dw.detect.Monitor(detector)
    state, signs = monitor.start(), []
    for t in range(100, 170):
        state, sign = monitor.update(state, z[t], *([c[t]] if slopes else []))
        signs.append(sign)
    return {
        "alarms": [found.samples, found.changes, found.directions, found.which, found.statistic, found.state],
        "monitor": [state, signs],
    }


def smoothed(est, **options):
    """Return a smoothed record of the joint filter."""
    found = est.smooth(*record(samples=60), **options)
    return {"state": found.state, "table": found.table, "bars": [found.x_std, found.parameters_std]}


def hindsight(est, inputs=1, **options):
    """Return parameters in hindsight."""
    found = est.smooth(*record(inputs, samples=80, missing=0.05), **options)
    return {"columns": list(found.columns().values()), "found": [found.nvr, found.q, found.sigma2, found.loglik]}


def readings(est, inputs=1, outputs=1):
    """Return what else a state can be asked."""
    y, u = record(inputs, outputs)
    trace = est.scan(y, u)
    return {
        "state": [
            est.loglik(trace.state),
            est.sigma2(trace.state),
            est.covariance(trace.state),
            est.mean(trace.state),
            est.information_ratio(trace.state),
            est.prior_covariance,
        ],
        "model": [trace.model().poles],
        "band": trace.band(0.9),
    }


def irregular(est):
    """Return the numbers of a continuous filter at instants that are no clock's."""
    at, y, u = motion()
    found = seen(trace := est.scan(y[:-1], u[:-1], time=at[:-1]))
    return found | {"stream": list(est.update(trace.state, y[-1], u[-1], time=float(at[-1])))}


def tracked(est, covariance=None):
    """Return the numbers of one object's track: a record of it, and its last plots one by one."""
    at, C = 4.0 * np.arange(36), est.coordinates
    turn = np.clip(at - 60, 0, 60) * np.radians(3)
    path = np.cumsum(600 * np.stack([np.sin(turn), np.cos(turn)], axis=1), axis=0)
    place = (path + 50 * np.random.default_rng(1).standard_normal(path.shape))[:, :C]
    place[7] = np.nan
    R = None if covariance is None else np.broadcast_to(covariance, (36, C, C))
    found, steps = seen(trace := est.scan(at[:32], place[:32], None if R is None else R[:32])), []
    state = trace.state
    for t in range(32, 36):
        state, step = est.update(state, at[t], place[t], None if R is None else R[t])
        steps.append(step)
    return found | {"stream": [state, steps], "ahead": list(est.predict(state, at[-1] + 10))}


def flown(*args, **options):
    """Return the numbers of all tracks in a table of plots."""
    tracks = dw.track(plots(24), *args, **options)
    return {"tracks": [[t.state, t.trace.table, t.plots.position] for t in tracks]}


def named_jump():
    """Return the memory that frees only the parameter that jumped."""
    return dw.RestartOnChange(
        dw.detect.ScoreCUSUM(jump=0.5, threshold=2.0), dw.memory.CovarianceInflation(0.5, only_named=True), settle=12
    )


def column():
    """Return a record whose outputs are a table of one column."""
    y, u = record()
    return y[:, None], u


def growing():
    """Return the observer of a tank with a leak, by all samples so far."""
    leak = dw.models.Polynomial([1.0], np.inf)
    return dw.WindowObserver(dw.Plant([[-1.0]]), np.inf, noise_std=0.05, disturbances=leak, dt=0.1)


def normal(*shape):
    """Return Gaussian numbers."""
    return np.random.default_rng(2).standard_normal(shape)


def jumped():
    """Return what the score test says of the first jump of a record."""
    trace = dw.ARX(2, 2, memory=dw.RestartOnChange()).scan(*record())
    found = trace.what_changed(trace.jumps()[0])
    return [found.statistic, found.scores, trace.state_before(50)]


def found_out():
    """Return the numbers of what is found out about a record without a word about it."""
    y, u = record(samples=120, missing=0.02)
    found = dw.identify({"heater": u, "temperature": y})
    return {"trace": seen(found.trace), "forecast": seen(found.forecast)}


def algebraic():
    """Return the numbers of an algebraic identification."""
    t = 0.02 * np.arange(151)
    y, u = dw.models.simulate_continuous(
        [0.8, 4.0], [0.0, 3.0], time=t, u=1 - 2.0 * (t // 1 % 2), noise_std=0.01, seed=1
    )
    found = dw.estimators.algebraic_identification(y, u, order=2, zeros=0, dt=0.02, hold="zoh", disturbance=0)
    return [found.values, found.covariance]
