"""Jumps of a parameter by an unknown size: the mixture is its definition, keeps its promise, and finds jumps soon."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.detect.size_mixture import SMALL, WIDE, SizeMixture, far_ratios, near_ratios
from driftwise.engine import compile
from driftwise.engine.dispatch import flatten

SIZES = 0.13 * 3.0 ** np.arange(4)


def definition(z, slopes):
    """Return log of the mean ratio and, at the end, (parameter, sign, start): every start, size, parameter and sign."""
    T, m = slopes.shape
    mean = np.cumsum(np.abs(slopes), axis=0) / np.arange(1, T + 1)[:, None]
    s = np.divide(slopes, mean, out=np.zeros((T, m)), where=mean > 0)
    a = np.clip(s[:, :, None, None] * SIZES * np.array([1.0, -1.0])[:, None], -2.0, 2.0)  # (T, m, sign, size)
    ratio = a * np.clip(z, -3.0, 3.0)[:, None, None, None] - 0.5 * a * a
    total = np.concatenate([np.zeros((1, *ratio.shape[1:])), np.cumsum(ratio, axis=0)])
    levels = []
    for t in range(1, T + 1):
        since = np.exp(total[t] - total[:t])  # (start, m, sign, size)
        R = (np.abs(s[:t])[:, :, None, None] * since).sum(axis=0)
        levels.append(np.log(R.sum() / len(SIZES)))
    which, sign = np.unravel_index(np.argmax(R.sum(axis=2)), (m, 2))
    size = np.argmax(R[which, sign])
    return np.array(levels), (which, 1 - 2 * sign, int(np.argmax(since[:, which, sign, size])))


def test_it_is_its_definition():
    rng, told = np.random.default_rng(4), 0
    for which in (0, 1, 2):
        slopes = np.array([5.0, 0.01, 1.0]) * rng.standard_normal((160, 3))
        slopes[:20, 1] = 0.0
        z = rng.standard_normal(160)
        z[100:] -= 1.5 * slopes[100:, which] / np.abs(slopes[:, which]).mean()
        found = dw.detect.ScoreCUSUM(threshold=9.0).scan(z, slopes)
        at = found.samples[0]
        level, (parameter, sign, start) = definition(z[: at + 1], slopes[: at + 1])
        np.testing.assert_allclose(found.statistic[: at + 1], np.maximum(level, 0.0) / 9.0, atol=1e-12)
        assert level[-1] >= 9.0 and np.all(level[:-1] < 9.0)
        assert (found.which[0], found.directions[0], found.changes[0]) == (parameter, sign, start)
        told += parameter == which and sign == -1 and abs(start - 100) < 15
    assert told == 3


def alarms_of(false_alarms, m, make, samples, seed=0):
    detector = dw.detect.ScoreCUSUM(false_alarms).resolve(m)
    rng, state, found, block = np.random.default_rng(seed), np.zeros((1, detector.state_size(m))), 0, 100_000
    for _ in range(samples // block):
        z, slopes = make(rng, block)
        outs = np.empty((1, block, 1))
        compile.watcher(SizeMixture)(state, z[None], np.ascontiguousarray(slopes)[None], outs, flatten((detector,)))
        found += np.count_nonzero(outs)
    return found


NOISES = {
    "normal": lambda rng, T: rng.standard_normal(T),
    "Student, 8": lambda rng, T: rng.standard_t(8, T) * 0.75**0.5,
    "Laplace": lambda rng, T: rng.laplace(0.0, 0.5**0.5, T),
    "skewed": lambda rng, T: (rng.gamma(16.0, size=T) - 16.0) / 4.0,
}
SLOPES = {
    "constant": lambda rng, T: np.full((T, 1), 7.0),
    "white": lambda rng, T: rng.standard_normal((T, 3)),
    "steps, of very different size": lambda rng, T: (
        np.repeat(rng.choice([-1.0, 0.6, 1.0], (T // 20, 2)), 20, axis=0) * [1e6, 1e-6]
    ),
}


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("slopes", SLOPES)
def test_false_alarms_are_as_often_as_promised(noise, slopes):
    """600 are promised: the mean time between them is .9 to 1.3 of it, two standard errors (8 %) beside."""
    found = alarms_of(1000, 2 if "steps" in slopes else 1 + 2 * (slopes == "white"),
                      lambda rng, T: (NOISES[noise](rng, T), SLOPES[slopes](rng, T)), 600_000)  # fmt: skip
    assert 600 / (1.3 * 1.08) < found < 600 / (0.9 * 0.92)


def test_slopes_that_follow_from_the_innovations_change_no_rate():
    """As in a loop: the slopes are the outputs that the innovations made."""

    def make(rng, T):
        from scipy.signal import lfilter

        z = rng.standard_normal(T)
        y = lfilter([1.0], [1.0, -0.9], z)
        return z, np.column_stack([np.r_[0.0, y[:-1]], np.r_[0.0, 0.0, y[:-2]]])

    assert 600 / (1.3 * 1.08) < alarms_of(1000, 2, make, 600_000) < 600 / (0.9 * 0.92)


def test_no_single_outlier_alarms():
    rng = np.random.default_rng(0)
    z, slopes = rng.standard_normal(4000), rng.standard_normal((4000, 2))
    z[500::500] = 1e9
    assert len(dw.detect.ScoreCUSUM("1 per 100_000").scan(z, slopes)) == 0


@pytest.mark.parametrize("size, most", [(0.2, 400), (0.5, 90), (1.0, 30), (3.0, 7)])
def test_jumps_are_found_sooner_than_by_sums_that_are_told_half_or_twice_the_size(size, most):
    rng, delays = np.random.default_rng(8), np.zeros((3, 60))
    detectors = [dw.detect.ScoreCUSUM(), *(dw.detect.ScoreCUSUM(jump=k * size) for k in (0.5, 2.0))]
    for i in range(60):
        z, slopes = rng.standard_normal(6000), rng.standard_normal((6000, 2))
        z[300:] += size * slopes[300:, 1]
        for j, detector in enumerate(detectors):
            found = detector.scan(z, slopes)
            late = found.samples[found.samples >= 300]
            delays[j, i] = (late[0] if len(late) else 6000) - 300
    mixture, small, large = delays.mean(axis=1)
    assert mixture < most
    assert size > 2 or (mixture < small and mixture < large)


def test_gaps_resuming_and_one_sample_at_a_time():
    rng = np.random.default_rng(3)
    z, slopes = rng.standard_normal(400), rng.standard_normal((400, 2))
    z[200:] += 1.2 * slopes[200:, 0]
    z[50:60] = slopes[70, 1] = np.nan
    detector = dw.detect.ScoreCUSUM(1000)
    whole, first = detector.scan(z, slopes), detector.scan(z[:205], slopes[:205])
    second = detector.scan(z[205:], slopes[205:], state=first.state)
    assert len(whole) >= 1
    assert np.array_equal(whole.statistic, np.r_[first.statistic, second.statistic], equal_nan=True)
    assert np.array_equal(whole.state, second.state)
    monitor = dw.detect.Monitor(detector, parameters=2)
    state, signs = monitor.start(), []
    for t in range(400):
        state, sign = monitor.update(state, z[t], slopes[t])
        signs.append(sign.alarm)
    assert np.array_equal(np.flatnonzero(signs), whole.samples) and np.array_equal(state, whole.state)
    with pytest.raises(dw.InputError, match="slopes must be finite"):
        monitor.update(state, 0.0, [np.inf, 1.0])


def test_slopes_of_very_different_size():
    rng = np.random.default_rng(9)
    z, slopes = 2.0 * rng.standard_normal(160), rng.standard_normal((160, 3)) ** 5
    found = dw.detect.ScoreCUSUM(threshold=600.0).scan(z, slopes)
    np.testing.assert_allclose(found.statistic, np.maximum(definition(z, slopes)[0], 0.0) / 600.0, atol=1e-14)


def test_ratios_of_usual_slopes_are_those_of_exponentials():
    rng = np.random.default_rng(10)
    for v in (0.0, 1e-9, 0.3, -1.0, 2.0, -3.0):
        a = min(SMALL, WIDE / max(abs(v), 1e-3)) * np.r_[-1.0, 1.0, 0.0, rng.uniform(-1.0, 1.0, 50)]
        up, down = np.empty_like(a), np.empty_like(a)
        far_ratios(a, up, down, 1.0, v)
        near = np.array([near_ratios(x, v) for x in a])
        np.testing.assert_allclose(near, np.column_stack([up, down]), rtol=5e-15)
        np.testing.assert_allclose(up, np.exp(a * v - a * a / 2), rtol=1e-15)


def test_compiled_and_plain_agree(monkeypatch):
    rng = np.random.default_rng(5)
    z, slopes = rng.standard_normal(300), rng.standard_normal((300, 2)) * [1e3, 1e-3]
    z[100:] -= 2.0
    slopes[:40, 0] = 0.0
    compiled = dw.detect.ScoreCUSUM(500).scan(z, slopes)
    monkeypatch.setenv("DRIFTWISE_ENGINE", "python")
    plain = dw.detect.ScoreCUSUM(500).scan(z, slopes)
    assert np.array_equal(compiled.state, plain.state)
    assert np.array_equal(compiled.statistic, plain.statistic, equal_nan=True)


def test_a_rest_is_no_evidence():
    """Without excitation nothing is asked, so nothing adds up, however long it takes."""
    rng = np.random.default_rng(6)
    slopes = rng.standard_normal((30_000, 1))
    slopes[2000:] = 0.0
    found = dw.detect.ScoreCUSUM(1e6).scan(rng.standard_normal(30_000), slopes)
    assert len(found) == 0
    assert np.ptp(found.statistic[2000:]) == 0.0


def test_what_is_promised_in_words():
    words = dw.detect.ScoreCUSUM(1000).words
    assert "one false alarm per 1 000 samples on average (by simulation" in words and "any size" in words
    assert np.isclose(dw.detect.ScoreCUSUM("1 per 5000").run_length(4), 5000)
    assert np.isclose(dw.detect.ScoreCUSUM("1 per 5000").typical_run_length([1.0, 2.0]), 5000)
    with pytest.raises(dw.InputError, match="jump of a given size"):
        dw.detect.ScoreCUSUM().calibrated_to([1.0])


def test_a_threshold_that_no_double_reaches_never_alarms():
    z = np.full(3000, 3.0)
    found = dw.detect.ScoreCUSUM(threshold=1e12).scan(z, np.ones((3000, 1)))
    assert np.all(np.isfinite(found.statistic))
