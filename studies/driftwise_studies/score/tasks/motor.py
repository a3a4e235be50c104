"""A motor drive: its motion behind an encoder, its start, its parameters on line."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from scipy.signal import bilinear, butter, lfilter

import driftwise as dw

from ...papers.verdict import Verdict
from . import carriage
from .carriage import DT, ENCODER, FILE, FV, GAIN, LEARN, ROUNDED, M, Truth
from .verdicts import needs, verdict

PUBLISHED = np.array([M, FV, 20.3935, -3.1648])  # M, Fv, Fc, offset
NAMES = "M", "Fv", "Fc", "offset"
WITHIN = (2.0, 5.0, 4.0, 5.0)  # percent
BAND, EARLY, LATE = 20.0, 3.5, 12.0  # Hz of the filters; s
ENTANGLED = 10.0  # variance inflation above which a parameter is not told from the others
STARTS = 100


@needs(FILE, (13, "motor: motion, the model given"), (14, "motor: motion without a model"), (15, "motor: cold start"))
def motor_motion(where: Path) -> list[Verdict]:
    """Rows 13 to 15: velocity, acceleration and load; how long a start in mid-motion takes. Tuned on the first 10 s."""
    u, position = carriage.read(where)
    truth = carriage.reference(u, position)
    y, _ = carriage.encoder(position, ROUNDED)
    found = carriage.observer(ENCODER).tune(y[:LEARN], u[:LEARN], noise=True)
    v, a, load = carriage.score(carriage.read_out(found.scan(y, u)), truth)
    motor = verdict(
        13,
        "motor behind a 20 um encoder, walk and noise tuned on the first 10 s",
        f"v {v:.3f} mm/s, a {a:.4f} m/s2, load {load:.2f} N",
        "<= .35, .035, 3.2",
        v <= 0.35 and a <= 0.035 and load <= 3.2,
    )
    plain = [
        without_model(0.0, position, truth, (0.05, 0.04)),
        without_model(ROUNDED, position, truth, (1.0, 0.19)),
    ]
    ms = np.sort(cold_starts(found, y, u, truth))
    start = verdict(
        15,
        "motor: cold start in mid-motion, 20 um, no P0 and no noise stated, until right to 2 mm/s",
        f"median {np.median(ms):.0f} ms, 95 % within {ms[int(0.95 * STARTS) - 1]:.0f} ms",
        "median <= 25 ms",
        np.median(ms) <= 25,
    )
    return [motor, *plain, start]


def without_model(step, position, truth, most) -> Verdict:
    """Row 14: velocity and acceleration from the position alone; memory and noise are found on the first 10 s.

    The acceleration walks; how fast, against the noise, is the length of the memory. Beside it windows of fixed length.
    """
    y, _ = carriage.encoder(position, step)
    walking = dw.models.Polynomial([0, 1], np.inf, walk=1.0, name="acceleration")
    cart = dw.Plant([[0, 1], [0, 0]], states=("position", "velocity"))
    est = dw.WindowObserver(cart, math.inf, noise_std=ENCODER, disturbances=walking, dt=DT)
    trace = est.tune(y[:LEARN], noise=True).scan(y)
    v, a = errors(trace.of("velocity")[0], trace.of("acceleration")[0], truth)
    beside = []
    for degree in (2, 3):
        window = carriage.chain(None, degree, 0.03).tune(y[:LEARN])
        x = window.scan(y).x
        beside.append(
            f"{1e3 * window.window:.0f} ms, degree {degree}: "
            + "{:.3f}, {:.4f}".format(*errors(x[:, 1], x[:, 2], truth))
        )
    return verdict(
        14,
        f"motor, position alone, no noise stated, {f'{1e6 * step:.0f} um' if step else 'as recorded'}",
        f"v {v:.3f} mm/s, a {a:.4f} m/s2 (tuned windows: {'; '.join(beside)})",
        f"<= {most[0]:g}, {most[1]:g}",
        v <= most[0] and a <= most[1],
    )


def errors(v, a, truth) -> list[float]:
    """Return the errors of velocity (mm/s) and acceleration."""
    return carriage.score(Truth(v, a, truth.load), truth)[:2]


def cold_starts(est, y, u, truth) -> np.ndarray:
    """Return the milliseconds that each start takes."""
    times = []
    for k in carriage.beginnings(truth, STARTS):
        velocity = est.scan(y[k : k + 400], u[k : k + 400]).of("velocity")[0]
        error = np.where(np.isnan(velocity), np.inf, velocity) - truth.velocity[k : k + 400]
        times.append(1e3 * DT * carriage.settle(error))
    return np.array(times)


# --- parameters --------------------------------------------------------------------------------------------


def causal(x, hertz, derivative=0) -> np.ndarray:
    """Return x, or a derivative, through a causal fourth-order Butterworth filter that starts at rest."""
    b, a = butter(4, 2 * math.pi * hertz, analog=True)
    return lfilter(*bilinear([*b, *[0.0] * derivative], a, 1 / DT), x)


def equation(u, position) -> tuple[np.ndarray, np.ndarray]:
    """Return force, and [a, v, sign v], through the same filter, as often as it lets something new through."""
    moved = position - position[0]
    sign = np.sign(causal(moved, 5 * BAND, 1))
    columns = [causal(moved, BAND, 2), causal(moved, BAND, 1), causal(sign, BAND)]
    every = round(1 / (2 * BAND * DT))
    return causal(GAIN * u, BAND)[::every], np.column_stack(columns)[::every]


@needs(FILE, (16, "motor: parameters on line"))
def motor_parameters(where: Path) -> list[Verdict]:
    """Row 16: mass, frictions and offset on line, with bars, and a word while they cannot be told apart."""
    y, phi = equation(*carriage.read(where))
    est = dw.Regression(NAMES[:3], offset=True)
    seconds = np.arange(len(y)) * round(1 / (2 * BAND * DT)) * DT
    late = est.scan(y[seconds <= LATE], phi[seconds <= LATE])
    theta, std = late.parameters[-1], late.parameters_std[-1]
    off, z = 100 * (theta - PUBLISHED) / np.abs(PUBLISHED), (theta - PUBLISHED) / std
    flagged = entangled(est, y, phi, seconds)
    last = seconds[flagged].max() if flagged.any() else 0.0
    inflation = est.variance_inflation(late.state)
    return [
        verdict(
            16,
            "motor: M, Fv, Fc, offset after 12 s",
            ", ".join(f"{x:+.1f}" for x in off) + " %",
            "within 2, 5, 4, 5 %",
            np.all(np.abs(off) <= WITHIN),
        ),
        verdict(
            16,
            "motor: errors over standard deviations after 12 s",
            ", ".join(f"{x:+.1f}" for x in z),
            "inside their 95 % bands",
            np.all(np.abs(z) <= 1.96),
        ),
        verdict(
            16,
            "motor: while the carriage moves one way, friction and offset are not told apart, and this is said",
            f"variance inflation above {ENTANGLED:g} until {last:.1f} s; at {LATE:g} s at most {inflation.max():.1f}",
            f"said before {EARLY:g} s, not at {LATE:g} s",
            np.any(flagged & (seconds < EARLY)) and inflation.max() <= ENTANGLED,
        ),
    ]


def entangled(est, y, phi, seconds) -> np.ndarray:
    """Return after which samples the offset cannot be told from the others, (T,)."""
    state, flags = est.start(), np.zeros(len(y), bool)
    for t in range(np.count_nonzero(seconds <= LATE)):
        state, _ = est.update(state, y[t], phi[t])
        flags[t] = est.variance_inflation(state)[-1] > ENTANGLED
    return flags
