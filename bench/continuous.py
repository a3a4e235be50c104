"""Continuous time: ContinuousJoint(2) against Joint(2) on the same samples; one algebraic identification."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

import driftwise as dw

from .clock import ratio
from .verdicts import Verdict, at_most, for_information

SOURCE = "bench/continuous.py"


def verdicts(samples: int = 20_000) -> Iterator[Verdict]:
    """Yield the cost of a sample at regular and at irregular instants, and of a streaming update."""
    draw = np.random.default_rng(1)
    regular, irregular = 0.1 * np.arange(samples), np.cumsum(draw.uniform(0.02, 0.18, samples))
    ours, theirs = dw.ContinuousJoint(2, 1, dt=0.1), dw.Joint(2, 1, dt=0.1)
    for what, time in (("regular", regular), ("irregular", irregular)):
        y, u = dw.models.simulate_continuous([0.3, 1.0], [0.0, 2.0], time=time, noise_std=0.005, seed=1)
        value, mine, other = ratio(
            lambda: ours.scan(y, u, time=None if what == "regular" else time), lambda: theirs.scan(y, u), rounds=9
        )
        note = f"{mine / samples * 1e6:.2f} us a sample, Joint(2) {other / samples * 1e6:.2f} us; both 6 unknowns"
        yield for_information(f"continuous time, record, {what} instants", value, "x Joint(2)", SOURCE, note)

    few = 2_000
    triples = list(zip(y[:few].tolist(), u[:few].tolist(), irregular[:few].tolist()))

    def stream():
        state = ours.start()
        for value, input, instant in triples:
            state, _ = ours.update(state, value, input, time=instant)

    def discrete():
        state = theirs.start()
        for value, input, _ in triples:
            state, _ = theirs.update(state, value, input)

    value, mine, other = ratio(stream, discrete, rounds=9)
    note = f"{mine / few * 1e6:.1f} us a sample, Joint(2) {other / few * 1e6:.1f} us"
    yield for_information("continuous time, est.update with an instant", value, "x Joint(2)", SOURCE, note)

    few = 400
    options: dict[str, Any] = dict(order=2, dt=0.1, hold="zoh", disturbance=0)
    y, u = dw.models.simulate_continuous([0.3, 1.0], [0.0, 2.0], time=regular[:few], noise_std=0.005, seed=1)
    _, mine, other = ratio(
        lambda: dw.estimators.algebraic_identification(y, u, **options), lambda: theirs.scan(y, u), rounds=9
    )
    note = f"{mine * 1e3:.1f} ms of {few} samples; Joint(2) scans them in {other * 1e3:.2f} ms"
    yield at_most("algebraic identification, 400 samples, order 2", mine * 1e3, 50.0, "ms", SOURCE, note)
