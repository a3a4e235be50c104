"""Ljung-Box and NIS: level, power, gaps, and what other libraries say."""

import numpy as np
import pytest
import scipy.stats

import driftwise as dw
from driftwise.results.whiteness import Correlations


def rejections(records):
    return int(sum(not dw.results.ljung_box(z).is_white for z in records))


def binomial(count, p):
    """Interval that holds a binomial count 999 times in 1000."""
    return scipy.stats.binom.ppf([0.0005, 0.9995], count, p)


@pytest.mark.parametrize("gaps", [0.0, 0.3])
def test_level_is_one_percent(gaps):
    rng = np.random.default_rng(1)
    z = rng.standard_normal((2000, 600))
    z[rng.random(z.shape) < gaps] = np.nan
    low, high = binomial(2000, 0.01)
    found = rejections(z)
    print(f"gaps {gaps}: {found} of 2000 white records rejected at 1 %, allowed {low:.0f} to {high:.0f}")
    assert low <= found <= high


def test_power_on_coloured_noise():
    rng = np.random.default_rng(2)
    v = rng.standard_normal((200, 401))
    coloured = v[:, 1:] + 0.4 * v[:, :-1]
    assert rejections(coloured) >= 195
    coloured[rng.random(coloured.shape) < 0.2] = np.nan
    assert rejections(coloured) >= 180
    late = v[:, 18:] + 0.5 * v[:, :-18]  # lag 18 only
    assert rejections(late) >= 190


@pytest.mark.parametrize("samples, lags", [(400, 20), (400, 5), (60, 12)])
def test_statsmodels_says_the_same(samples, lags):
    from statsmodels.stats.diagnostic import acorr_ljungbox

    z = np.random.default_rng(3).standard_normal(samples)
    z -= z.mean()  # statsmodels takes the mean off; the mean of an innovation is zero
    table = acorr_ljungbox(z, lags=[lags])
    found = dw.results.ljung_box(z, lags)
    assert found.statistic == pytest.approx(table["lb_stat"].iloc[0], rel=1e-10)
    assert found.p_value == pytest.approx(table["lb_pvalue"].iloc[0], rel=1e-8)
    assert found.lags == lags


def test_a_gap_is_a_gap_in_time():
    rng = np.random.default_rng(4)
    z = rng.standard_normal(300)
    z[rng.random(300) < 0.25] = np.nan
    n, q = np.isfinite(z).sum(), 0.0
    for k in range(1, 21):
        pairs = z[k:] * z[:-k]
        n_k = np.isfinite(pairs).sum()
        q += n * (n + 2) * (np.nansum(pairs) / np.nansum(z**2)) ** 2 / n_k
    assert dw.results.ljung_box(z).statistic == pytest.approx(q, rel=1e-12)
    every_other = np.full(400, np.nan)
    every_other[::2] = z[np.isfinite(z)][:200]
    assert dw.results.ljung_box(every_other).lags == 10  # odd lags have no pairs


def test_variance_of_a_correlation_with_gaps():
    """n_k / (n (n + 2)) for Gaussian white noise whatever the gaps: 20 000 records, one percent standard error."""
    rng = np.random.default_rng(5)
    known = rng.random(40) > 0.4
    z = np.where(known, rng.standard_normal((20_000, 40)), 0.0)
    n = known.sum()
    for k in (1, 3, 9):
        r = np.sum(z[:, k:] * z[:, :-k], axis=1) / np.sum(z**2, axis=1)
        n_k = np.sum(known[k:] & known[:-k])
        assert np.mean(r**2) == pytest.approx(n_k / (n * (n + 2)), rel=0.05)


def test_pieces_are_the_whole():
    z = np.random.default_rng(6).standard_normal(500)
    z[[3, 77, 78]] = np.nan
    c = Correlations()
    for part in np.array_split(z, 41):
        c.add(part)
    assert c.whiteness.statistic == pytest.approx(dw.results.ljung_box(z).statistic, rel=1e-12)


def test_too_little_gives_no_verdict():
    for z in ([], [1.0] * 5, [np.nan] * 50, np.zeros(50)):
        found = dw.results.ljung_box(z)
        assert np.isnan(found.p_value) and found.is_white


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: dw.results.ljung_box(np.ones((3, 2))), r"z must be one-dimensional"),
        (lambda: dw.results.ljung_box(["a", "b"]), "z must hold real numbers"),
        (lambda: dw.results.ljung_box([1.0, np.inf]), "z is infinite at index 1"),
        (lambda: dw.results.ljung_box(np.ones(9), lags=0), "lags must be a whole number"),
        (lambda: dw.results.nis([1.0, 2.0], [1.0, 2.0, 3.0]), r"numbers or \(2,\) like the innovations"),
        (lambda: dw.results.nis([1.0], 1.0, level=95), "in percent"),
    ],
)
def test_wrong_input_is_explained(call, words):
    with pytest.raises(dw.InputError, match=words):
        call()


@pytest.mark.parametrize("dof", [np.inf, 12.0])
def test_nis_interval_holds_its_level(dof):
    rng = np.random.default_rng(7)
    e = 3 * (rng.standard_normal((2000, 300)) if np.isinf(dof) else rng.standard_t(dof, (2000, 300)))
    inside = sum(dw.results.nis(row, 9.0, dof).is_consistent for row in e)
    low, high = binomial(2000, 0.95)
    assert low <= inside <= high
    assert not dw.results.nis(1.3 * e[0], 9.0, dof).is_consistent


def test_nis_interval_is_chi_square():
    found = dw.results.nis(np.ones(50), np.ones(50))
    assert (found.low, found.high) == pytest.approx(scipy.stats.chi2.ppf([0.025, 0.975], 50) / 50)
    assert dw.results.nis([np.nan], 1.0).is_consistent and np.isnan(dw.results.nis([], 1.0).value)


def test_summary_uses_them():
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=800, noise_std=0.2, seed=8, missing=0.1)
    trace = dw.Joint(2, inputs=1).scan(y, u)
    s = trace.summary()
    late = np.cumsum(trace.is_used) > s.settle
    z = np.where(trace.is_used & late & (trace.dof >= 10), trace.innovation / np.sqrt(trace.variance), np.nan)
    assert s.whiteness == dw.results.ljung_box(z.clip(-4, 4))
    expected = dw.results.nis(np.where(np.isfinite(z), trace.innovation, np.nan), trace.variance, trace.dof)
    assert s.nis_interval == pytest.approx(expected)
    assert s.nis == expected.value
    assert expected.is_consistent


def test_the_variance_of_a_students_square():
    """Sum of variances of (1 - 2/dof) t^2, from the fourth moment of Student's law."""
    from scipy.stats import t

    from driftwise.results.whiteness import score

    dof = np.array([11.0, 14.0, 60.0])
    expected = sum((1 - 2 / v) ** 2 * t(v).moment(4) - 1 for v in dof)
    assert np.isclose(score(np.ones(3), np.ones(3), dof)[1], expected, rtol=1e-9)
