"""Several outputs: JointMIMO((2, 1)) against two Joints fed the same data, and against a dense filter in NumPy."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import driftwise as dw

from .clock import ratio
from .opponents import DenseMIMO
from .verdicts import Verdict, for_information

SOURCE = "bench/outputs.py"
TRUTH = [-1.2, 0.5, -0.1, 1.0, 0.5, 0.2, -0.8, 0.3, 0.4]
VARIANCE = 0.01
PRIOR = 1e4


def verdicts() -> Iterator[Verdict]:
    """Yield the cost of a split filter (7 + 5 unknowns) and of a coupled one (12)."""
    yield from _split()
    yield from _coupled()


def _record(samples: int):
    y, u = dw.models.simulate_mimo((2, 1), TRUTH, samples=samples, inputs=1, noise_std=VARIANCE**0.5, seed=1)
    return y, u[:, 0]


def _joints() -> tuple[dw.Joint, dw.Joint]:
    """Return what one would have used: the other output as an input, what `JointMIMO` leaves out known to be zero."""
    one, other = np.full(8, PRIOR), np.full(6, PRIOR)
    one[-1] = other[-2] = 0.0  # b of y_2 at lag 1 (in Salut's order: last), and u at once
    noise = dw.models.EquationError(VARIANCE)
    return dw.Joint(2, 2, noise=noise, P0=one), dw.Joint(1, 2, True, noise=noise, P0=other)


def _split(samples: int = 10_000) -> Iterator[Verdict]:
    y, u = _record(samples)
    est = dw.JointMIMO((2, 1), 1, noise=dw.models.EquationError(VARIANCE), P0=PRIOR)
    first, second = _joints()
    inputs = np.column_stack([u, y[:, 1]]), np.column_stack([u, y[:, 0]])

    def together():
        return est.scan(y, u)

    def apart():
        return first.scan(y[:, 0], inputs[0]), second.scan(y[:, 1], inputs[1])

    theirs = np.column_stack([trace.prediction for trace in apart()])
    np.testing.assert_allclose(together().prediction, theirs, rtol=1e-9, atol=1e-9)
    value, ours_s, theirs_s = ratio(together, apart)
    note = (
        f"{ours_s / samples * 1e6:.2f} us a sample, two Joints {theirs_s / samples * 1e6:.2f} us (of 8 and 6 unknowns)"
    )
    yield for_information("two outputs, split, record, keep std", value, "x two Joints", SOURCE, note)

    few = 2_000
    pairs = list(zip(y[:few], u[:few].tolist()))
    one, other = (list(zip(y[:few, i].tolist(), inputs[i][:few])) for i in (0, 1))

    def stream():
        state = est.start()
        for value, input in pairs:
            state, _ = est.update(state, value, input)

    def two_streams():
        for joint, samples in ((first, one), (second, other)):
            state = joint.start()
            for value, input in samples:
                state, _ = joint.update(state, value, input)

    value, ours_s, theirs_s = ratio(stream, two_streams, rounds=9)
    note = f"{ours_s / few * 1e6:.1f} us a sample, two Joints {theirs_s / few * 1e6:.1f} us"
    yield for_information("two outputs, split, est.update", value, "x two Joints", SOURCE, note)


def _coupled(samples: int = 1_000) -> Iterator[Verdict]:
    y, u = _record(samples)
    R = VARIANCE * np.array([[1.0, 0.5], [0.5, 1.0]])
    noise = dw.models.NoiseCovariance(np.zeros((3, 3)), np.zeros((3, 2)), R)
    est = dw.JointMIMO((2, 1), 1, noise=noise, P0=10.0)
    opponent, last = DenseMIMO(est, y, u, R), est.scan(y, u).state
    np.testing.assert_allclose(np.concatenate([last["x"], last["theta"]]), opponent.run(), atol=1e-6)
    value, theirs_s, ours_s = ratio(opponent.run, lambda: est.scan(y, u), rounds=9)
    note = f"NumPy {theirs_s / samples * 1e6:.0f} us a sample, ours {ours_s / samples * 1e6:.2f} us; 12 unknowns"
    yield for_information("two outputs, coupled, record: NumPy's time over ours", value, "x", SOURCE, note).beside(
        "NumPy", 1 / value
    )

    pairs = list(zip(y, u.tolist()))

    def stream():
        state = est.start()
        for value, input in pairs:
            state, _ = est.update(state, value, input)

    value, theirs_s, ours_s = ratio(opponent.run, stream, rounds=9)
    note = f"NumPy {theirs_s / samples * 1e6:.0f} us a sample, ours {ours_s / samples * 1e6:.1f} us"
    yield for_information("two outputs, coupled, est.update: NumPy's time over ours", value, "x", SOURCE, note).beside(
        "NumPy", 1 / value
    )
