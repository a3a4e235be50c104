"""Outliers of the sensor are told from those of the process by what follows, and only the first are replaced."""

from types import SimpleNamespace

import numpy as np
import pytest

import driftwise as dw
from driftwise.estimators.arx.gaps import tell_kind_of_last
from driftwise.memory.additive import exchange, open_past, pass_kinds, past_size, share_additive, weigh_kinds
from driftwise.memory.auto_state import open_parts

A, B, SIGMA = [-1.4, 0.64], [1.0], 0.3


def record(seed, kind, share=0.03, size=12.0, samples=1500):
    """Return y, u of an ARX(2, 1), ``share`` of whose outputs ("sensor") or innovations ("process") are off."""
    rng = np.random.default_rng(seed)
    u, e = rng.standard_normal(samples), SIGMA * rng.standard_normal(samples)
    off = SIGMA * size * rng.choice([-1.0, 1.0], samples) * (rng.random(samples) < share)
    off[:100] = 0.0
    y = np.zeros(samples)
    e += off * (kind == "process")
    for t in range(2, samples):
        y[t] = -A[0] * y[t - 1] - A[1] * y[t - 2] + B[0] * u[t - 1] + e[t]
    return y + off * (kind == "sensor"), u, off != 0.0


def share_of(trace, N=3):
    """Return how many outliers in one the memory of an estimator takes for additive."""
    return share_additive(open_parts(None, np.ravel(trace.state["memory_state"]), N).past)


def test_odds_and_shares_are_those_of_their_definition():
    """AR(2) by hand: log odds of two predictions, nine of a square at most, and Bayes' rule once an output leaves."""
    memory, N, theta = SimpleNamespace(past=2.0), 2, np.array([-1.2, 0.5])
    past = open_past(np.zeros(past_size(N)), N)
    rng = np.random.default_rng(3)
    measured, expected, rhos, odds, additive, count = [0.0] * 2, [0.0] * 2, [0.0] * 2, [0.0] * 2, 0.0, 0.0
    for k in range(60):
        psi, e, V = rng.normal(0, 2, 2), rng.normal(0, 2), rng.uniform(0.5, 2)
        rho = rng.uniform(0.5, 1) * (k % 3 == 0)
        y = psi @ theta + e
        for i in range(2):
            if rhos[i]:
                z2 = [
                    min((e + theta[i] * (psi[i] + was)) ** 2 / V, 9.0) for was in (measured[i], expected[i])
                ]  # replaced, the regressor is psi = -was: so much is expected besides
                odds[i] += (z2[0] - z2[1]) / 2
        weigh_kinds(memory, past, psi, theta, e, V, y)
        if rhos[1]:
            share = (additive + 1.6) / (count + 2)
            ratio = np.exp(odds[1]) * share / (1 - share)
            additive, count = additive + rhos[1] * ratio / (1 + ratio), count + rhos[1]
        pass_kinds(memory, past, rho)
        measured, expected = [y, measured[0]], [y - e, expected[0]]
        rhos, odds = [rho, rhos[0]], [0.0, odds[0]]
        assert share_additive(past) == pytest.approx((additive + 1.6) / (count + 2))
    assert count > 10


def test_who_thinks_of_a_jump_regresses_on_what_was_measured():
    """Since the trial began, that is; the innovation is of that row; a second call leaves all as it was."""
    memory, N, theta = SimpleNamespace(past=2.0), 3, np.array([-1.2, 0.5, 1.0])
    past = open_past(np.zeros(past_size(N)), N)
    past.measured[:2], past.rho[:2] = [7.0, 9.0], [0.9, 0.8]
    psi, y = np.array([-2.0, -3.0, 0.5]), 4.0
    e = y - psi @ theta
    for age, row in ((0, [-2.0, -3.0, 0.5]), (1, [-7.0, -3.0, 0.5]), (2, [-7.0, -9.0, 0.5]), (5, [-7.0, -9.0, 0.5])):
        found = exchange(memory, past, psi, theta, e, age)
        assert psi.tolist() == row and found == pytest.approx(y - psi @ theta)
        exchange(memory, past, psi, theta, e, age)
        assert psi.tolist() == [-2.0, -3.0, 0.5] and past.measured[:2].tolist() == [7.0, 9.0]
    past.rho[0] = 0.0  # this one was none
    exchange(memory, past, psi, theta, e, 2)
    assert psi.tolist() == [-2.0, -9.0, 0.5]


@pytest.mark.parametrize("kind", ["sensor", "process"])
def test_either_kind_is_found_out_and_costs_little(kind):
    errors, known, shares, recognised = [], [], [], []
    for seed in range(40):
        y, u, off = record(seed, kind)
        clean, _, _ = record(seed, "none")
        trace = dw.ARX(2, 1, memory=dw.AutoMemory()).scan(y, u)
        told = dw.ARX(2, 1, memory=dw.AutoMemory()).scan(clean, u)
        errors.append(np.mean((trace.parameters[200:] - [*A, *B]) ** 2))
        known.append(np.mean((told.parameters[200:] - [*A, *B]) ** 2))
        shares.append(share_of(trace))
        found = trace.status & int(dw.Status.OUTLIER) != 0
        recognised.append(np.mean(found[off]))
        assert np.mean(found[~off]) < 0.01
        assert not any(event.kind == "JUMP" for event in trace.events())
    assert np.mean(recognised) > 0.95
    assert np.sum(np.array(recognised) <= 0.8) <= (kind == "sensor")  # of which two at once may look like louder noise
    assert np.all(np.array(shares) > 0.9) if kind == "sensor" else np.all(np.array(shares) < 0.1)
    assert np.sqrt(np.mean(errors) / np.mean(known)) < 1.25


def test_before_anything_followed_most_are_of_the_sensor():
    y, u, _ = record(0, "none")
    trace = dw.ARX(2, 1, memory=dw.AutoMemory()).scan(y[:300], u[:300])
    assert share_of(trace) == pytest.approx(0.8, abs=0.1)


@pytest.mark.parametrize("options", [dict(missing="hold"), dict(missing="skip")])
def test_where_nothing_replaces_outputs_all_outliers_are_additive(options):
    y, u, _ = record(1, "process", samples=400)
    trace = dw.ARX(2, 1, memory=dw.AutoMemory(), **options).scan(y, u)
    assert np.isfinite(trace.parameters[-1]).all() and share_of(trace) == 0.8  # none was counted


def test_gaps_do_not_mix_up_the_kinds():
    """One in ten outputs is missing: what is kept of the past keeps step with the samples."""
    for kind, least, most in (("sensor", 0.85, 1.0), ("process", 0.0, 0.15)):
        y, u, off = record(5, kind)
        y[(np.random.default_rng(1).random(len(y)) < 0.1) & ~off] = np.nan
        assert least < share_of(dw.ARX(2, 1, memory=dw.AutoMemory()).scan(y, u)) < most


@pytest.mark.parametrize("measured", [3.0, -3.0])
@pytest.mark.parametrize("follows", ["expected", "measured"])
def test_the_kind_of_an_outlier_is_told_by_what_follows_before_anything_is_learnt_of_it(measured, follows):
    """By Bayes' rule, dense; a kind that is improbable is left out, and the regressor then is known."""
    rng = np.random.default_rng(7)
    theta, P, R, s2, expected, wrong, own = np.array([-0.9, 0.3, 0.5]), 0.02 * np.eye(3), 1.0, 0.09, 0.2, 0.7, 0.1
    off, rest = measured - expected, rng.normal(0, 0.3, 2)
    ys, S = np.array([measured - wrong * off, -rest[0]]), np.zeros(4)
    S[0] = wrong * ((1 - wrong) * off**2 + own)
    mean = {what: np.array([-v, *rest]) @ theta for what, v in (("expected", expected), ("measured", measured))}
    y = mean[follows] + 0.1

    def likelihood(what, noise):
        psi = np.array([-dict(expected=expected, measured=measured)[what], *rest])
        T = psi @ P @ psi + noise
        return np.exp(-((y - psi @ theta) ** 2) / (2 * s2 * T)) / np.sqrt(T) + 0.01 / np.sqrt(T + 400 * noise)

    each = wrong * likelihood("expected", R + own * theta[0] ** 2 / s2), (1 - wrong) * likelihood("measured", R)
    after = each[0] / sum(each)
    assert min(after, 1 - after) < 0.1
    psi, scratch = np.array([-ys[0], *rest]), np.zeros((2, 3))
    U, D = np.zeros(3), np.full(3, 0.02)
    assert tell_kind_of_last(S, ys, measured, expected, y, theta, U, D, psi, *scratch, R, s2)
    assert ys.tolist() == pytest.approx([expected if follows == "expected" else measured, -rest[0]])
    assert S.tolist() == pytest.approx([own if follows == "expected" else 0.0, 0.0, 0.0, 0.0])
    assert not tell_kind_of_last(S, ys, np.nan, np.nan, y, theta, U, D, psi, *scratch, R, s2)


@pytest.mark.parametrize(("kind", "most"), [("process", 1.15), ("sensor", 1.15)])
def test_rows_behind_an_outlier_are_learnt_from(kind, most):
    """The plant is known as well as by least squares that are told which outputs were wrong, or nearly so."""
    ours, told = [], []
    for seed in range(20):
        y, u, off = record(seed, kind, size=30.0)
        found = dw.ARX(2, 1, memory=dw.AutoMemory()).scan(y, u).parameters[-1]
        psi = np.column_stack([-y[1:-1], -y[:-2], u[1:-1]])
        right = ~off[2:] if kind == "process" else ~(off[2:] | off[1:-1] | off[:-2])
        least = np.linalg.lstsq(psi[right], y[2:][right], rcond=None)[0]
        ours.append(found - [*A, *B])
        told.append(least - [*A, *B])
    assert np.sqrt(np.mean(np.square(ours)) / np.mean(np.square(told))) < most
