"""Predictions of mixtures: bands are their quantiles. Events: what happened, told apart and in words."""

import re

import numpy as np
import pytest
from draws import slow
from driftwise_studies.papers.abid.systems import system
from scipy import integrate, stats

import driftwise as dw
from driftwise.results.bands import half_width


@pytest.mark.parametrize("dof", [3.0, slow(40.0), np.inf])
def test_the_band_holds_what_it_says(dof):
    """By numerical integration of the density over the band."""
    rng, law = np.random.default_rng(2), stats.norm if np.isinf(dof) else stats.t(dof)
    weight = rng.dirichlet([0.3, 0.3, 0.3], 6)
    offset, scale = rng.standard_normal((6, 3)), np.exp(2 * rng.standard_normal((6, 3)))
    offset -= (weight * offset).sum(axis=1, keepdims=True)
    for level in (0.5, 0.95, 0.999):
        for w, m, s, h in zip(weight, offset, scale, half_width(level, weight, offset, scale, np.full(6, dof))):

            def density(x, w=w, m=m, s=s):
                return float(np.sum(w * law.pdf((x - m) / s) / s))

            at = [p for p in (*m, *(m - s), *(m + s)) if -h < p < h]
            inside, _ = integrate.quad(density, -h, h, points=at, limit=500, epsabs=1e-9)
            assert inside == pytest.approx(level, abs=1e-6)


def mixture_of(trace):
    """Weights, offsets and squared scales of the modes, as the trace has them."""
    return trace.table[:, 9 : trace.estimator.n_columns].reshape(len(trace), -1, 3).transpose(2, 0, 1)


def test_a_trace_tells_the_mixture_behind_its_band():
    """The variance it publishes, about its mean; by drawing from it, as many in the band as it says; Student's t.

    The mean that is published is slower to believe in drift, and in what a trial shows, than the probabilities are, so
    that the mixture is off it; a bank of given speeds publishes its own mean. While a trial shows something what is
    published drifts by the bank's Q, not by the trial's.
    """
    s = system("d", 1)
    trace = dw.ARX(2, 2, memory=dw.AutoMemory(), at_rest=True).scan(s.y[0], s.u[0])
    w, m, v = mixture_of(trace)
    is_calm = w[:, 3:].sum(axis=1) == 0
    assert 580 < np.count_nonzero(is_calm) < 600
    np.testing.assert_allclose(w.sum(axis=1), 1, rtol=1e-12)
    off = (w * m).sum(axis=1)
    assert 1e-4 < np.std(off[is_calm] / np.sqrt(trace.variance[is_calm])) < 0.1
    plain = dw.ARX(2, 2, memory=dw.memory.MultipleModel(), at_rest=True).scan(s.y[0], s.u[0])
    np.testing.assert_allclose(np.sum(np.prod(mixture_of(plain)[:2], axis=0), axis=1), 0, atol=1e-9)
    variance = (w * (v + m**2)).sum(axis=1)
    is_calm[:10] = False
    np.testing.assert_allclose(variance[is_calm], trace.variance[is_calm], rtol=1e-9)
    beside = abs(variance / trace.variance - 1)[10:]
    assert np.sum(beside > 1e-3) <= 1 and beside.max() < 5e-3  # while a trial shows something
    k = np.arange(20, 200)  # one for each sample, which fade, less four parameters; less what looks like outliers
    assert np.all(trace.dof[:4] == 1) and np.all(abs(trace.dof[k] - (200 - 203 * 0.995**k)) < 1.5)
    rng = np.random.default_rng(0)
    for k in (50, 203, 599):
        pick = rng.choice(6, 200_000, p=w[k] / w[k].sum())
        drawn = m[k, pick] + np.sqrt(v[k, pick]) * rng.standard_t(trace.dof[k], 200_000)
        assert np.mean(abs(drawn) < trace.band(0.9)[k]) == pytest.approx(0.9, abs=0.003)


@pytest.mark.parametrize(
    "memory", [dw.AutoMemory(), dw.memory.MultipleModel(), dw.memory.IMM()], ids=lambda m: type(m).__name__
)
def test_bands_cover_what_comes(memory):
    s, inside = system("c", 40), []
    for y, psi in zip(s.y, s.psi):
        trace = dw.Regression(4, memory=memory, at_rest=True).scan(y, psi)
        w, m, v = mixture_of(trace)
        is_calm = w[:, 3:].sum(axis=1) == 0  # no trial shows anything
        is_calm[:10] = False
        np.testing.assert_allclose((w * (v + m**2)).sum(axis=1)[is_calm], trace.variance[is_calm], rtol=1e-9)
        inside.append(abs(trace.innovation[50:]) < trace.band(0.95)[50:])
    assert 0.93 <= np.mean(inside) <= 0.97


# --- events -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def plant():
    """The plant of the tests, its input and its noise, and what `AutoMemory` tells of a record."""
    rng = np.random.default_rng(11)
    u, e = rng.choice([-1.0, 1.0], 600), 0.1 * rng.standard_normal(600)

    def told(b1=1.0, louder=1.0, glitch=0.0, quiet=False):
        theta = np.tile([-1.2, 0.5, 1.0, 0.5], (600, 1))
        theta[300:, 2] = b1
        noise, inputs, y = e.copy(), u.copy(), np.zeros(600)
        noise[300:] *= louder
        if quiet:
            inputs[300:500], noise[300:500] = 0.0, 1e-3 * noise[300:500]
        for k in range(2, 600):
            y[k] = theta[k] @ [-y[k - 1], -y[k - 2], inputs[k - 1], inputs[k - 2]] + noise[k]
        y[300] += glitch
        return dw.ARX(2, 2, memory=dw.AutoMemory()).scan(y, inputs)

    return told


def kinds(trace):
    """What was told, beside the first samples, which only fill the lags."""
    return [e for e in trace.events() if e.kind in ("JUMP", "NOISE", "OUTLIER", "AT_REST") and e.sample > 10]


def test_a_jump_is_told_with_its_parameter_and_odds(plant):
    """At odds of 100:1, which take a jump of four deviations a dozen samples: fast drift explains much of it, too."""
    (event,) = [e for e in kinds(plant(b1=1.4)) if e.kind == "JUMP"]
    assert 300 <= event.sample <= 315 and 299 <= event.since <= 302
    assert event.parameter == "b1" and event.direction == 1 and event.odds > 100
    assert re.fullmatch(
        r"b1 jumped from (0\.99|1)\S* to 1\.[34]\S*, it began about \d+ samples ago \(odds \d+:1\)", event.text
    )
    assert not [e for e in kinds(plant(b1=1.4)) if e.kind == "NOISE"]


def test_louder_noise_is_told_once(plant):
    found = [e for e in kinds(plant(louder=3.0)) if e.kind in ("JUMP", "NOISE")]
    assert [e.kind for e in found] == ["NOISE"] and 300 < found[0].sample < 340


def test_a_glitch_is_no_jump(plant):
    assert {e.kind for e in kinds(plant(glitch=5.0))} <= {"OUTLIER"}


def test_a_glitch_is_told_as_an_outlier(plant):
    (event,) = kinds(plant(glitch=5.0))
    assert event.kind == "OUTLIER" and event.sample == 300


@pytest.fixture(scope="module")
def plants():
    """Sixty records of that plant, a glitch or a jump of b1 at 300, sizes in deviations: what is told, and errors."""

    def told(glitch=0.0, jump=0.0):
        rng = np.random.default_rng(12)
        for sign in rng.choice([-1.0, 1.0], 60):
            u, y, theta = rng.choice([-1.0, 1.0], 400), np.zeros(400), np.tile([-1.2, 0.5, 1.0, 0.5], (400, 1))
            theta[300:, 2] += 0.1 * jump * sign
            for k in range(2, 400):
                y[k] = theta[k] @ [-y[k - 1], -y[k - 2], u[k - 1], u[k - 2]] + 0.1 * rng.standard_normal()
            y[300] += 0.1 * glitch * sign
            trace = dw.ARX(2, 2, memory=dw.AutoMemory()).scan(y, u)
            yield [e.kind for e in kinds(trace) if e.sample >= 300], trace.parameters[300:] - theta[300:]

    return told


@pytest.mark.parametrize("size", [20, 50, 100])
def test_glitches_of_every_size_are_told_and_move_little(plants, size):
    """Half a deviation on average over the first five samples; who thinks of a jump moves by five times that."""
    found, errors = zip(*plants(glitch=size))
    assert np.mean([each == ["OUTLIER"] for each in found]) >= 0.95
    assert np.sqrt(np.mean(np.array(errors)[:, :5] ** 2)) <= 0.08


@pytest.mark.parametrize("size", [10, 30, 100])
def test_large_jumps_are_told_and_followed(plants, size):
    found, errors = zip(*plants(jump=size))
    assert np.mean(["JUMP" in each for each in found]) >= 0.95
    assert np.sqrt(np.median(np.array(errors)[:, 20:] ** 2)) <= 0.03


def test_rest_is_told(plant):
    found = kinds(plant(quiet=True))
    rest = [e for e in found if e.kind == "AT_REST"]
    assert rest and 300 < rest[0].sample < 340 and not [e for e in found if e.kind == "JUMP"]
    assert not [e for e in kinds(plant()) if e.kind in ("JUMP", "NOISE", "AT_REST")]
