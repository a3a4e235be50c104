"""The structure is exploited: arithmetic per sample, counted by numbers that count.

One input, direct term, N = 3n + 1; multiplications, additions and divisions, exact 0 and 1 are free.
Reference counts: 22 n^2 + 36 n + 8 for the ARX case in U D U' form, against 4 N^3 + 7 N^2 + 6 N for dense matrices.
"""

import numpy as np
import pytest

import driftwise as dw
from bench.counting import Counted, counted, counting
from driftwise.engine import ud
from driftwise.estimators.joint import predict as joint_predict
from driftwise.estimators.joint import row as joint_row

FREE = {"sum": (0.0,), "product": (0.0, 1.0, -1.0), "division": (0.0, 1.0)}


def operations_of_one_step(n, noise):
    """Run one ordinary sample of the joint filter on counting numbers, book-keeping aside."""
    est = dw.Joint(n, inputs=1, direct=True, noise=noise, P0=10.0)
    rng = np.random.default_rng(n)
    y, u = dw.simulate(np.poly(np.linspace(0.3, 0.6, n))[1:], np.ones(n), samples=60, noise_std=0.1, seed=n)
    rows = est._rows(est.scan(y, u).state)
    form, kernel_noise = est.policies[0], est.policies[1]
    first = joint_row.JOINT.places(form).s
    rows[0, first : first + 2 * est.model.N] = rng.uniform(0.1, 2.0, 2 * est.model.N)  # nothing is zero by luck
    state = joint_row.JOINT.open(form, counted(rows[0]))
    work = joint_row.open_scratch(form, counted(est.scratch() * 0))
    state.held[0] = Counted(0.7)
    s, U, D = state.s, state.U, state.D
    with counting(free=FREE) as done:
        yhat = joint_row.predict_output(s, state.held, work.direct, work.offset)
        joint_row.project(U, D.size, state.held, work.direct, work.offset, work.f)
        e = Counted(0.3) - yhat
        T = ud.correct(U, D, work.f, Counted(kernel_noise.R), work.b)
        e = e / T
        for i in range(D.size):
            s[i] += work.b[i] * e
        R = Counted(kernel_noise.R)
        noise = kernel_noise._replace(R=R)
        joint_predict.propagate(noise, state, work, Counted(0.3), yhat, R, T, 1.0, True, False, 0.0, 0.0)
    return done.total() - done["comparison"]


@pytest.mark.parametrize("n", range(1, 7))
def test_arx_step_costs_what_theory_says(n):
    assert operations_of_one_step(n, dw.models.EquationError(0.01)) <= 22 * n * n + 36 * n + 8


@pytest.mark.parametrize("n", range(1, 7))
def test_correlated_step_stays_within_its_order(n):
    d = np.poly(np.full(n, 0.2))[:0:-1]
    got = operations_of_one_step(n, dw.models.NoisePolynomial(d, 0.01))
    assert got <= 2 * n**3 + 28.5 * n * n + 38.5 * n + 11


def test_growth_is_quadratic():
    counts = [operations_of_one_step(n, dw.models.EquationError(0.01)) for n in range(1, 8)]
    assert np.all(np.diff(counts, 3) == 0), "a third difference would be a hidden N^3"


if __name__ == "__main__":
    for n in range(1, 7):
        N = 3 * n + 1
        print(
            n,
            operations_of_one_step(n, dw.models.EquationError(0.01)),
            22 * n * n + 36 * n + 8,
            "dense",
            4 * N**3 + 7 * N**2 + 6 * N,
            "correlated",
            operations_of_one_step(n, dw.models.NoisePolynomial(np.poly(np.full(n, 0.2))[:0:-1], 0.01)),
            2 * n**3 + 28.5 * n * n + 38.5 * n + 11,
        )
