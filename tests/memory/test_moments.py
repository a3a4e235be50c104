"""A jump of one parameter at some moment of the last thirty-six samples, against its walking all the time."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from draws import slow
from oracle import auto

import driftwise as dw
from driftwise.memory.auto_constants import MOMENTS, STEP
from driftwise.memory.moments import COUNTED, moments_size, open_moments, ratio_of_walk, row_size

M, JUMP = 3, int(dw.Status.JUMP)


def drawn(seed, size, T=400):
    """Return regressors, outputs and when the first of two or three parameters jumps by so many deviations."""
    rng = np.random.default_rng([seed, 77])
    psi, at = rng.standard_normal((T, 2 + seed % 2)), int(rng.integers(250, 340))
    shift = np.where(np.arange(T) >= at, 0.3 * size, 0.0)
    return psi, psi.sum(axis=1) + shift * psi[:, 0] + 0.3 * rng.standard_normal(T), at


def jumps_of(psi, y):
    trace = dw.Regression(psi.shape[1], memory=dw.AutoMemory()).scan(y, psi)
    return np.flatnonzero(trace.status & JUMP), trace


@pytest.mark.parametrize("seed", [1, 2, slow(5), slow(10)])
def test_a_jump_told_by_its_moments_is_that_of_the_plain_twin(seed):
    """In these records no trial tells it."""
    psi, y, _ = drawn(seed, (0.9, 1.2, 1.5)[seed % 3])
    told, trace = jumps_of(psi, y)
    run = auto.run_auto(y[None], psi[None], np.ones(psi.shape[1]))
    assert [k for _, k, what in run.events if what == "jump"] == told.tolist()
    np.testing.assert_allclose(trace.parameters[20:], run.theta[0, 20:], rtol=1e-9, atol=1e-9)


def test_jumps_of_one_deviation_are_told_and_dated():
    """Of forty, thirty are; by trials alone twenty."""
    hits, early, dates = 0, 0, []
    for seed in range(40):
        psi, y, at = drawn(seed, 1.2)
        told, trace = jumps_of(psi, y)
        early += np.sum(told < at)
        hits += np.any((told >= at) & (told < at + 50))
        dates += [jump.since - at for jump in trace.jumps() if at <= jump.sample < at + 50]
    assert hits >= 28 and early == 0
    assert abs(np.median(dates)) <= 6


@pytest.mark.parametrize("count", [3 * STEP, (MOMENTS + 3) * STEP])
def test_the_evidence_of_a_walk_is_that_of_its_covariance(count):
    """Offsets of a walk have covariance q min(j, k) from the oldest moment on; a likelihood ratio of Gaussians."""
    rng, N, q, s2 = np.random.default_rng(count), 2, np.array([0.02, 0.3]), 1.7
    moments = open_moments(np.zeros(moments_size(N, M, MOMENTS)), N, M, MOMENTS)
    known = np.cumsum(rng.uniform(0.5, 2.0, (count // STEP, N)), axis=0)
    score = np.cumsum(rng.standard_normal((count // STEP, N)), axis=0)
    for k in range(count // STEP - 1):  # as they are kept, one after the other
        row = np.concatenate([np.zeros(3 + M), score[k], known[k], q])
        moments.kept[(k % MOMENTS) * row_size(N, M) :][: row.size] = row
    moments.score[:], moments.known[:], moments.head[COUNTED] = score[-1], known[-1], count
    memory = SimpleNamespace(learns=0.0, levels=np.zeros(M))
    own = np.array([1.0, 1.0, s2])
    first = max(count // STEP - 1 - MOMENTS, 0)
    for i in range(N):
        v, m = np.diff(score[first:, i]), np.diff(known[first:, i])
        j = np.arange(1.0, len(v) + 1)
        V, V0 = np.diag(m) + STEP * q[i] * np.minimum.outer(j, j) * np.outer(m, m), np.diag(m)
        expected = 0.5 * (v @ np.linalg.solve(V0, v) - v @ np.linalg.solve(V, v))
        expected += 0.5 * (np.linalg.slogdet(V0)[1] - np.linalg.slogdet(V)[1])
        assert math.isclose(math.log(ratio_of_walk(memory, moments, own, i)), expected, rel_tol=1e-9)


@pytest.mark.parametrize(("seed", "louder"), [(158, 4.0), slow(485, 4.0), slow(881, 4.0), slow(343, 5.0), (485, 5.0)])
def test_louder_noise_is_not_followed_for_long_as_a_jump_of_one_parameter(seed, louder):
    """Told by its moments, where a trial knows better; or taken back by the trial, which goes on beside it."""
    rng, T, theta = np.random.default_rng([seed, 4]), 460, np.array([1.0, -2.0, 0.5, 1.5])
    psi = rng.choice([-1.0, 1.0], (T, 4))
    y = psi @ theta + np.where(np.arange(T) < 300, 1.0, louder) * rng.standard_normal(T)
    told, trace = jumps_of(psi, y)
    assert [event.text for event in trace.events()][-1] == "noise level rose"
    assert np.abs(trace.parameters[-50:] - theta).mean() < 0.1
    run = auto.run_auto(y[None], psi[None], np.ones(4))
    assert [k for _, k, what in run.events if what == "jump"] == told.tolist()
    np.testing.assert_allclose(trace.parameters[40:], run.theta[0, 40:], rtol=1e-9, atol=1e-9)
