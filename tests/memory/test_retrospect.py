"""Jumps that the bank has followed, told afterwards: the evidence, dense; what it adds; told once; the laws."""

import math

import numpy as np
from oracle import auto

import driftwise as dw
from driftwise.engine import compile
from driftwise.memory.auto_constants import ALL_JUMP, OF_JUMPS
from driftwise.memory.retrospect import weigh_moment

SIGMA, AT = 0.3, 500
JUMP = int(dw.Status.JUMP)
TWINS = 100, 108, 137  # seeds


def record(seed, samples=AT + 100, at=AT):
    """Four parameters that jump by six tenths of what a sample tells of each."""
    rng = np.random.default_rng([seed, 22])
    psi, theta = rng.standard_normal((samples, 4)), np.ones((samples, 4))
    theta[at:] += 0.6 * SIGMA * rng.choice([-1.0, 1.0], 4)
    return (psi * theta).sum(axis=1) + SIGMA * rng.standard_normal(samples), psi


def test_the_evidence_of_a_jump_is_that_of_its_covariance():
    """One parameter or all jump by a normal amount: the likelihood ratio of Gaussians, from score and information."""
    rng, N, rows = np.random.default_rng(3), 3, 20
    psi, unit = rng.standard_normal((rows, N)), np.array([0.5, 1.0, 2.0])
    y = rng.standard_normal(rows) + psi[:, 1]
    M, r = psi.T @ psi, psi.T @ y
    packed = np.array([M[i, j] for j in range(N) for i in range(j + 1)])

    def ratio(V):
        S = np.eye(rows) + psi @ np.diag(V) @ psi.T
        return math.exp(0.5 * (y @ y - y @ np.linalg.solve(S, y)) - 0.5 * np.linalg.slogdet(S)[1])

    sizes = [size * unit for size in OF_JUMPS]
    one = np.mean([ratio(wide * here) for wide in sizes for here in np.eye(N)])
    expected = (1 - ALL_JUMP) * one + ALL_JUMP * np.mean([ratio(wide) for wide in sizes])
    found = weigh_moment(packed, packed.copy(), r, np.zeros(N), unit, 0.0, 1.0)
    assert math.isclose(found, expected, rel_tol=1e-9)


def test_a_jump_that_was_followed_is_told_late_and_once():
    """Trials and moments alone tell 24 of 60 within fifty samples."""
    est, told, again, before = dw.Regression(4, memory=dw.AutoMemory()), 0, 0, 0
    for seed in range(60):
        jump = est.scan(*record(seed)).status & JUMP != 0
        told, again = told + jump[AT : AT + 50].any(), again + max(jump[AT:].sum() - 1, 0)
        before += jump[:AT].sum()
    assert told >= 40 and again <= 1 and before <= 1


def walking(seed, samples=AT + 60):
    """Four parameters that walk, and one of them jumps by three times what a sample tells of it."""
    rng = np.random.default_rng([seed, 23])
    psi = rng.standard_normal((samples, 4))
    theta = 1.0 + np.cumsum(0.1 * SIGMA * rng.standard_normal((samples, 4)), axis=0)
    theta[AT:, 0] += 3.0 * SIGMA
    return (psi * theta).sum(axis=1) + SIGMA * rng.standard_normal(samples), psi


def test_a_jump_of_three_deviations_is_told_while_all_parameters_walk():
    """Within fifty samples: 48 of 60; 26 where late ones are small, as rare as fast drift, and looked for once."""
    est, told, before = dw.Regression(4, memory=dw.AutoMemory()), 0, 0
    for seed in range(60):
        jump = est.scan(*walking(seed)).status & JUMP != 0
        told, before = told + jump[AT : AT + 50].any(), before + jump[:AT].sum()
    assert told >= 42 and before <= 2


def late_jumps(trace):
    """Where a jump is told below the odds at which trials tell one."""
    return np.flatnonzero((trace.status & JUMP != 0) & (trace.columns()["statistic"] < 1.0))


def test_it_is_the_plain_twin():
    y, psi = (np.stack(each) for each in zip(*(record(seed, 400, 330) for seed in TWINS)))
    y[0, 300:310:3] = np.nan
    run = auto.run_auto(y, psi, np.ones(4), P0=1e4)
    est = dw.Regression(4, memory=dw.AutoMemory(), at_rest=True, P0=1e4)
    traces = [est.scan(*each) for each in zip(y, psi)]
    for s, trace in enumerate(traces):
        jumps = [k for series, k, kind in run.events if kind == "jump" and series == s]
        assert np.flatnonzero(trace.status & JUMP).tolist() == jumps
        seen = np.isfinite(y[s])
        np.testing.assert_allclose(trace.columns()["statistic"][seen], run.odds[s, seen], rtol=1e-7, atol=1e-7)
    assert sum(len(late_jumps(trace)) for trace in traces) >= 2


def test_halves_a_saved_state_a_fleet_and_no_compiler_tell_the_same(tmp_path):
    y, psi = record(TWINS[0], 400, 330)
    y[[40, 333, 334, 350]] = np.nan
    psi[290:296] = 0.0  # at rest
    est = dw.Regression(4, memory=dw.AutoMemory(), at_rest=True)
    whole = est.scan(y, psi)
    assert len(late_jumps(whole)) == 1
    for cut in (295, 345):
        first = est.scan(y[:cut], psi[:cut])
        dw.save_state(est, first.state, tmp_path / "state.json")
        again, state = dw.load_state(tmp_path / "state.json")
        second = again.scan(y[cut:], psi[cut:], state=state)
        assert np.array_equal(np.r_[first.status, second.status], whole.status)
        assert second.state.tobytes() == whole.state.tobytes()
    state, told = est.start(3), []
    for k in range(len(y)):
        state, out = est.update_batch(state, np.full(3, y[k]), np.tile(psi[k], (3, 1)))
        told.append(out.status)
    assert np.array_equal(np.array(told), np.tile(whole.status, (3, 1)).T)
    rows, outs = est._rows(est.start(1), is_one=False), np.empty((1, len(y), est.n_columns + 8))
    run = compile.plain_driver(*map(type, est.policies))
    run(rows, y[None, :, None].copy(), psi[None].copy(), outs, est.spec, est.scratch())
    assert np.array_equal(outs[0, :, 3].astype(int), whole.status)
