"""One sample at a time, and fleets."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .clock import alternate
from .plant import joint, record
from .verdicts import Verdict, at_least, at_most

SOURCE = "bench/calls.py"
SERIES = 10_000


def verdicts() -> Iterator[Verdict]:
    """Yield the budgets of streaming calls, of forecasts and of fleets."""
    yield from _streaming()
    yield _ahead()
    yield from _fleet("N = 6, no input", inputs=0, direct=False)
    yield from _fleet("N = 10, input and direct term")


def _streaming(samples: int = 10_000) -> Iterator[Verdict]:
    y, u = record(samples)
    pairs = list(zip(y.tolist(), u.tolist()))
    for noise in ("EquationError", "OutputError"):
        est = joint(noise)
        rows, spec, scratch, drive = est.start(1).view("f8").reshape(1, -1), est.spec, est.scratch(), est.drive
        one_y, one_u, out = np.empty((1, 1, 1)), np.empty((1, 1, 1)), np.empty((1, 1, 4))

        def raw():
            for value, input in pairs:
                one_y[0, 0, 0], one_u[0, 0, 0] = value, input
                drive(rows, one_y, one_u, out, spec, scratch)

        def friendly():
            state = est.start()
            for value, input in pairs:
                state, _ = est.update(state, value, input)

        raw_us, friendly_us = np.median(alternate(raw, friendly, rounds=7), axis=0) / samples * 1e6
        yield at_most(f"one sample, raw call, {noise}", raw_us, 0.5, "us", SOURCE)
        yield at_most(f"one sample, est.update, {noise}", friendly_us, 2.5, "us", SOURCE)


def _ahead(calls: int = 500) -> Verdict:
    import driftwise as dw

    est, (y, u) = dw.ARX(2, 2), record(1000)
    state, inputs = est.scan(y, u).state, np.ones(24)

    def forecasts():
        for _ in range(calls):
            est.predict(state, inputs)

    us = np.median(alternate(forecasts, rounds=7)) / calls * 1e6
    return at_most("24 samples ahead with bands, ARX(2, 2).predict", us, 100, "us", SOURCE)


def _fleet(what: str, **options) -> Iterator[Verdict]:
    est = joint("EquationError", **options)
    draw = np.random.default_rng(0)
    y = draw.standard_normal((20, SERIES))
    u = draw.standard_normal((20, SERIES)) if est.model.inputs else [None] * 20
    states = [est.start(SERIES)]

    def ticks():
        for t in range(20):
            states[0], _ = est.update_batch(states[0], y[t], u[t])

    rows, out, scratch = est.start(SERIES).view("f8").reshape(SERIES, -1), np.empty((SERIES, 1, 4)), est.scratch()
    inputs = np.zeros((SERIES, 1, est.model.inputs))

    def raw():
        for t in range(20):
            est.drive(rows, y[t].reshape(-1, 1, 1), inputs, out, est.spec, scratch)

    rates = 20 * SERIES / np.median(alternate(ticks, raw, rounds=7), axis=0) / 1e6
    yield at_least(
        f"fleet, est.update_batch, {what}", rates[0], 5, "million/s", SOURCE, f"raw call {rates[1]:.1f} million/s"
    )
