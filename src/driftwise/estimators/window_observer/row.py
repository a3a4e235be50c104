"""What the forms of the observer of a known plant share: the head of a row, its columns, one sample's bookkeeping.

A form (`fir`, `queue`, `growing`) is a NamedTuple that begins with the fields `common` lists. Its row begins with the
fields of `COMMON`, its `Work` with the names used here. Its step reads

    seconds = elapse(form, state, u, t)                        irregular time only
    predict z and the variance of each output into work.z, work.ahead; status = take_inputs(state, u, t) on the way
    alarm = observe(form, scale, detector, state, work, y, out, t)
    take work.y (NaN: missing) in: state.z, state.std, head[DETERMINED]
    report(form, scale, state, out, t, status, alarm)
"""

import math
from typing import NamedTuple

import numpy as np

from ...engine.dispatch import Vector, choice, kernel, watch
from ...engine.elementary import log
from ...engine.layout import Field, numbers, policy
from ...engine.status import BAD_VALUE, JUMP, MISSING_OUTPUT, NOT_READY
from ...models.scale import InverseGamma, KnownScale
from ..arx.row import HUGE

SAMPLES, OBSERVED, STATUS, CHI2, SCORE, TIME, DETERMINED, READY = range(8)  # of the head of a row
HEAD = numbers(
    "head",
    samples="samples taken",
    observed="outputs that had a prediction",
    status="bits of the last one",
    chi2="sum of e^2/T over them",
    score="sum of log p(y)",
    time="of the last sample",
    determined="whether z has a finite covariance",
    ready="whether its deviations meet the tolerance, too",
)
SETTLED = 10.0  # innovations that a noise learnt from them takes before its deviations are worth telling


class Common(NamedTuple):
    """The fields every form begins with."""

    n: float  # states of the plant
    m: float  # with those of the disturbances
    inputs: float
    outputs: float
    dt: float  # seconds between samples that come without an instant
    settle: float  # innovations before the detector watches
    H: Vector  # (p, m)
    D: Vector  # (p, k)
    r: Vector  # (p,) noise variances, relative to sigma^2 where that is learnt
    rows: Vector  # (derived, m): further outputs, of z
    feeds: Vector  # (derived, k): and of u
    tolerance: Vector  # (m + derived,)
    detector_size: float  # numbers the detector keeps


COMMON = (
    *HEAD,
    Field("z", ("m",), "state and disturbances; only what determined vouches for", trace="their names"),
    Field("std", ("len(form.tolerance)",), "deviations of z and of the derived outputs, relative to sigma"),
    Field("ahead", ("outputs",), "free for the form: variance of the next prediction, relative to sigma^2"),
    Field("held", ("inputs",), "each input: its last known value"),
    policy("detector_state", of="detector"),
)  # what every row begins with; a form's own fields follow


@choice
def unit(scale, head):
    """Return sigma^2, infinite where it is yet to be learnt (1 where the noise is known)."""


@unit.on(KnownScale)
def unit_known_scale(scale, head):
    return 1.0


@unit.on(InverseGamma)
def unit_inverse_gamma(scale, head):
    return head[CHI2] / head[OBSERVED] if head[OBSERVED] >= SETTLED else math.inf


@kernel
def along(row, at, x):
    """Return the product of row[at : at + x.size] and x."""
    s = 0.0
    for i in range(x.size):
        s += row[at + i] * x[i]
    return s


@kernel
def products(rows, at, x):
    """Return the products of x with two rows that begin at ``at``: two samples at a time, so four sums side by side."""
    size = x.size
    g, h = rows[at : at + size], rows[at + size : at + 2 * size]
    a = b = c = d = 0.0
    for j in range(size // 2):
        even, odd = x[2 * j], x[2 * j + 1]
        a += g[2 * j] * even
        b += h[2 * j] * even
        c += g[2 * j + 1] * odd
        d += h[2 * j + 1] * odd
    if size % 2 == 1:
        a += g[size - 1] * x[size - 1]
        b += h[size - 1] * x[size - 1]
    return a + c, b + d


@kernel
def elapse(form, state, u, t):
    """Advance the clock to sample t, whose instant stands behind the inputs; return the seconds since the last one."""
    head, k = state.head, state.held.size
    before, stamp = head[TIME], u[t, k] if u.shape[1] > k else np.nan
    if head[SAMPLES] == 0.0:
        head[TIME] = 0.0 if stamp != stamp else stamp
        return 0.0
    head[TIME] = before + form.dt if stamp != stamp else max(stamp, before)
    return form.dt if stamp != stamp else head[TIME] - before


@kernel
def observe(form, scale, detector, state, scratch, y, out, t):
    """Compare each output with its prediction H work.z + D u; return 1 where the detector alarms, else 0.

    ``scratch.y`` takes the outputs, NaN where missing; ``scratch.ahead`` has the variances of the predictions,
    relative.
    """
    head, m, k, p = state.head, state.z.size, state.held.size, scratch.y.size
    s2, alarm, statistic = unit(scale, head), 0.0, 0.0
    for i in range(p):
        value, status, yhat, T = y[t, i], 0, np.nan, np.inf
        if not abs(value) < HUGE:
            status = MISSING_OUTPUT if value != value else MISSING_OUTPUT | BAD_VALUE
            value = np.nan
        scratch.y[i] = value
        if head[DETERMINED] > 0.0:
            yhat = along(form.H, i * m, scratch.z) + along(form.D, i * k, state.held)
            T = s2 * scratch.ahead[i]
        e = value - yhat
        if e == e:
            head[OBSERVED] += 1.0
            head[CHI2] += e * e / scratch.ahead[i]
            if T < np.inf:
                head[SCORE] -= 0.5 * (log(2.0 * math.pi * T) + e * e / T)
                if head[OBSERVED] > form.settle:
                    found = watch(detector, state.detector_state, e / math.sqrt(T), state.detector_state[:0])
                    alarm = 1.0 if found != 0.0 else alarm
                    statistic = max(statistic, state.detector_state[0])
        out[t, i], out[t, p + i], out[t, 2 * p + i], out[t, 3 * p + i] = yhat, e, T, status
    out[t, 4 * p] = statistic
    return alarm


@kernel
def report(form, scale, state, out, t, status, alarm):
    """Decide whether the estimate is ready, and write it with its deviations; close the sample."""
    head, z, std, m, k = state.head, state.z, state.std, state.z.size, state.held.size
    p, N = int(form.outputs), state.std.size
    s2 = unit(scale, head)
    sigma, is_ready = math.sqrt(s2), head[DETERMINED] > 0.0 and s2 < np.inf
    if is_ready:
        for i in range(N):
            if not sigma * std[i] <= form.tolerance[i]:
                is_ready = False
    status |= 0 if is_ready else NOT_READY
    status |= JUMP if alarm != 0.0 else 0
    for i in range(p):
        own = int(out[t, 3 * p + i]) | status
        out[t, 3 * p + i] = own
        head[STATUS] = own
    C, at = out.shape[1], 4 * p + 1
    if C >= at + N:
        for i in range(N):
            if i < m:
                value = z[i]
            else:
                value = along(form.rows, (i - m) * m, z) + along(form.feeds, (i - m) * k, state.held)
            out[t, at + i] = value if is_ready else np.nan
    if C >= at + 2 * N:
        for i in range(N):
            out[t, at + N + i] = sigma * std[i] if is_ready else np.inf
    head[READY] = 1.0 if is_ready else 0.0
    head[SAMPLES] += 1.0
