"""Order by evidence: against a multivariate t that shares no code, on the theory's experiment, and at its limits."""

import json

import numpy as np
import pytest
import scipy.stats

import driftwise as dw
from driftwise.estimators.joint.estimator import Joint

A, B = [-1.5, 0.7], [1.0, 0.5]


def records(count, std=0.5, samples=300):
    return [dw.simulate(A, B, samples=samples, noise_std=std, seed=s) for s in range(count)]


def criteria(y, u, orders, skip=5):
    """BIC and AIC of least squares on the samples that every order can use."""
    found = []
    for n in orders:
        rows = [np.r_[-y[t - n : t][::-1], u[t - n : t][::-1]] for t in range(skip, len(y))]
        e = y[skip:] - rows @ np.linalg.lstsq(np.array(rows), y[skip:], rcond=None)[0]
        N, size = len(e), 2 * n + 1
        found.append((N * np.log(e @ e / N) + size * np.log(N), N * np.log(e @ e / N) + 2 * size))
    return [orders[int(np.argmin(c))] for c in np.array(found).T]


def multivariate_t(y, u, est):
    """Log density of y = M s0 + e with [s0; e] normal-inverse-gamma: the evidence of an ARX model in one piece."""
    n, T = est.model.n, len(y)
    lagged = [np.r_[np.zeros(k), v[: T - k]] for v, s in ((y, -1), (u, 1)) for k in range(1, n + 1)]
    M = np.column_stack([np.eye(T)[:, :n], *lagged])
    M[:, n : 2 * n] *= -1
    P = np.asarray(est.options["P0"]).reshape(-1, n)[:, ::-1].ravel()  # Salut's order: every block reversed
    alpha, beta = est.scale
    shape = beta / alpha * (est.y_scale**2 * np.eye(T) + (M * P) @ M.T)
    return scipy.stats.multivariate_t(shape=shape, df=2 * alpha).logpdf(y)


def test_evidence_is_the_marginal_density():
    y, u = dw.simulate(A, B, samples=60, noise_std=0.5, seed=3)
    found = dw.analysis.choose_order(y, u, range(1, 4))
    for value, s in zip(found.log_evidence, found.summaries.values()):
        assert value == pytest.approx(multivariate_t(y, u, s.estimator), rel=1e-9)
    known = dw.analysis.choose_order(y, u, [2], noise=dw.models.EquationError(0.25))
    est = known.summaries[2].estimator
    assert np.diag(est.prior_covariance)[2:4].tolist() == [10.0, 10.0]  # a's, in their own unit


def counts(count, orders=range(1, 6), data=None, **options):
    best = [dw.analysis.choose_order(y, u, orders, **options).best for y, u in (data or records(count))]
    return np.bincount(best, minlength=8)


def test_right_order_of_forty_records():
    assert counts(40)[2] >= 39


@pytest.mark.slow
@pytest.mark.parametrize("P0", [1.0, 100.0, 1e6])
def test_right_order_of_two_hundred_records_at_any_prior(P0):
    found = counts(200, P0=P0)
    print(f"P0 = {P0:g}: orders 1 to 5 chosen {found[1:6]} times")
    assert found[2] >= 195


@pytest.mark.slow
def test_bic_and_aic_beside_it():
    data = [(y, u) for y, u in records(200)]
    bic, aic = np.array([criteria(y, u, range(1, 6)) for y, u in data]).T
    right = counts(200, data=data)[2], np.sum(bic == 2), np.sum(aic == 2)
    print("right out of 200: evidence {}, BIC {}, AIC {}".format(*right))
    assert right[0] >= 195
    assert right[1] >= 190
    assert right[2] < right[0]  # AIC does not settle


@pytest.mark.parametrize("alpha, factor", [(0.1, 1.0), (2.0, 1.0), (0.5, 1e-3), (0.5, 1e3), (0.5, 1e-12)])
def test_prior_of_the_scale_matters_little(alpha, factor):
    for y, u in records(8):
        plain = dw.analysis.choose_order(y, u)
        beta = plain.summaries[2].estimator.scale.beta
        other = dw.analysis.choose_order(y, u, scale=dw.models.InverseGamma(alpha, beta * factor))
        assert other.best == plain.best == 2
        change = other.log_evidence - plain.log_evidence
        if factor <= 1:  # 1e3 outweighs the data: the choice stays, the odds do not
            assert abs(change[2] - change[1]) < 1.0  # odds of 3 against 2, in nats


@pytest.mark.parametrize("P0", [1.0, 1e6])
def test_prior_of_the_parameters_matters_little(P0):
    assert counts(20, P0=P0)[2] >= 19


def test_why_ten():
    """A prior of 1 overfits large coefficients, one of 100 misses what shows weakly; 10 lies between."""
    large = np.real(np.poly([0.98, 0.95 + 0.1j, 0.95 - 0.1j, 0.93 + 0.2j, 0.93 - 0.2j]))[1:]  # up to 9
    data = [dw.simulate(large, [0.1, 0.05, 0, 0, 0], samples=300, noise_std=0.1, seed=s) for s in range(20)]
    weak = [dw.simulate([-0.8, 0.12], B, samples=100, noise_std=1.0, seed=s) for s in range(20)]
    right = {
        P0: (counts(20, range(1, 8), data=data, P0=P0)[5], counts(20, data=weak, P0=P0)[2]) for P0 in (1.0, 10.0, 100.0)
    }
    print("right of 20, large coefficients of fifth order and weak ones of second, by P0:", right)
    assert right[10.0][0] == right[100.0][0] == 20 > right[1.0][0]
    assert right[1.0][1] > right[10.0][1] > right[100.0][1]


@pytest.mark.parametrize("std", [2.0, 1e-2, 1e-4, 1e-6, 0.0])
def test_clean_and_noisy_records(std):
    for orders in (range(1, 6), [1, 2, 3]):  # the highest sets the level
        data = records(6, std)
        found = [dw.analysis.choose_order(y, u, orders) for y, u in data]
        assert [e.best for e in found] == [2] * 6
        assert not any("noise is not what" in e.words for e in found) or std == 0
        runner_up = [max(set(e.orders) - {2}, key=lambda n: e.log_evidence[n - 1]) for e in found]
        assert all(f"against order {n}" in e.words for n, e in zip(runner_up, found))


def test_a_relative_prior_would_choose_wrongly_on_clean_records():
    """Why P0 is absolute: with P0 relative to a small sigma^2 the smallest theta wins, not the lowest order."""
    y, u = records(1, 1e-5)[0]
    found = []
    for n in range(1, 6):
        est = Joint(n, inputs=1, scale=dw.models.InverseGamma(0.5, 1e-12)).scaled_to(y, u)
        found.append(est.loglik(est.scan(y, u, keep="innovations").state))
    assert np.argmax(found) + 1 > 2
    assert dw.analysis.choose_order(y, u).best == 2


def test_pieces_and_scales_do_not_matter():
    y, u = dw.simulate(A, B, samples=2500, noise_std=0.3, seed=3, missing=0.1)
    whole = dw.analysis.choose_order(y, u, range(1, 4))
    for cut in (7, 999, 1000, 1001):
        pieces = dw.analysis.OrderEvidence(range(1, 4))
        for k in range(0, 2500, cut):
            pieces.add(y[k : k + cut], u[k : k + cut])
        assert np.array_equal(pieces.log_evidence, whole.log_evidence)
        np.testing.assert_allclose(pieces.nis, whole.nis, rtol=1e-9)
    assert pieces.samples == 2500
    scaled = dw.analysis.choose_order(y * 2.0**20, u * 2.0**-7, range(1, 4))
    np.testing.assert_allclose(scaled.probability, whole.probability, rtol=1e-6)
    np.testing.assert_array_equal(scaled.fit, whole.fit)


def test_memory_does_not_grow():
    """What is kept after the pilot is one state and one summary per order."""
    y, u = dw.simulate(A, B, samples=3000, noise_std=0.3, seed=3)
    e = dw.analysis.OrderEvidence(range(1, 4)).add(y[:500], u[:500])
    assert sum(len(y) for y, _ in e._pilot) == 500
    e.add(y[500:], u[500:])
    assert not e._pilot
    assert sum(v.nbytes for v in e._states.values()) < 2000


def test_missing_samples():
    for seed in range(5):
        y, u = dw.simulate(A, B, samples=600, noise_std=0.5, missing=0.3, seed=seed)
        assert dw.analysis.choose_order(y, u).best == 2
    late = np.concatenate([np.full(1500, np.nan), y])
    found = dw.analysis.choose_order(late, np.concatenate([np.ones(1500), u]))
    np.testing.assert_allclose(found.log_evidence, dw.analysis.choose_order(y, u).log_evidence, rtol=1e-12)
    assert {s.observed for s in found.summaries.values()} == {np.isfinite(y).sum()}


def test_no_input_two_inputs_direct_and_other_noises():
    y, _ = dw.simulate([-1.2, 0.7, -0.4], samples=800, noise_std=1.0, seed=1)
    assert dw.analysis.choose_order(y).best == 3
    y, u = dw.simulate(A, [B, [0.2, -0.3]], direct=[0.4, 0.1], samples=500, noise_std=0.2, seed=2)
    assert dw.analysis.choose_order(y, u, direct=True).best == 2
    y, u = dw.simulate(A, B, samples=600, noise_std=0.3, noise="output", seed=3)
    assert dw.analysis.choose_order(y, u, range(1, 4), noise=dw.models.OutputError()).best == 2
    y, u = dw.simulate(A, B, samples=600, noise_std=0.3, d=[0.3, 0.0], seed=4)

    def noise(n):
        return dw.models.NoisePolynomial([0.0] * (n - 1) + [0.3])

    assert dw.analysis.choose_order(y, u, range(1, 4), noise=noise).best == 2


def test_words_and_tables():
    y, u = dw.simulate(A, B, samples=300, noise_std=0.5, seed=1)
    found = dw.analysis.choose_order(y, u, range(1, 4))
    assert found.words.startswith("order 2, odds ")
    assert found.notes == []
    assert found.probability.sum() == pytest.approx(1)
    assert found.odds(2, 3) == pytest.approx(found.probability[1] / found.probability[2])
    table = found.to_frame()
    assert table["order"].tolist() == [1, 2, 3] and table["log_evidence"].tolist() == found.log_evidence.tolist()
    assert json.loads(json.dumps(found.as_dict(), allow_nan=False))["best"] == 2
    assert np.all((found.nis > 0.8) & (found.nis < 1.4))  # short: above 1 by N / T and more
    assert found.fit[1] == found.fit.max() or found.fit[2] == found.fit.max()
    assert found.rmse[1] == pytest.approx(0.5, rel=0.15)


def test_it_warns():
    y, u = dw.simulate(A, B, samples=300, noise_std=0.5, seed=1)
    assert "order 2 is the largest tried: try more" in dw.analysis.choose_order(y, u, [1, 2]).words
    assert "order 3 is the smallest tried: try fewer" in dw.analysis.choose_order(y, u, [3, 4]).words
    short = dw.analysis.choose_order(y[:6], u[:6])
    assert "fewer than the unknowns of order" in short.words
    assert dw.analysis.choose_order(np.full(9, np.nan)).notes == [
        "no output was measured: every order is as probable as before"
    ]
    assert dw.analysis.choose_order([]).probability == pytest.approx(np.full(5, 0.2))
    weak = [
        dw.analysis.choose_order(*dw.simulate([-0.8, 0.3], [0.1, 0.0], samples=100, noise_std=1.0, seed=s))
        for s in range(20)
    ]
    is_near = [np.divide(*np.sort(e.probability)[:-3:-1]) < 3 for e in weak]
    assert 0 < sum(is_near) < 20
    assert is_near == ["nearly as probable" in e.words for e in weak]


def test_it_says_when_the_noise_is_another():
    """Noise that stands still for 1000 samples and then roars: the odds are not what they seem."""
    rng = np.random.default_rng(1)
    y, u = dw.simulate(A, B, samples=3000, noise_std=0.01, seed=1)
    y[1000:] += 3 * rng.standard_t(1.5, 2000).clip(-50, 50)
    assert "the noise is not what the model says" in dw.analysis.choose_order(y, u).words


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda y, u: dw.analysis.choose_order(y, u, []), "orders is empty"),
        (lambda y, u: dw.analysis.choose_order(y, u, 3), r"for one order n give \[n\]"),
        (lambda y, u: dw.analysis.choose_order(y, u, [0, 1]), "at least 1"),
        (
            lambda y, u: dw.analysis.choose_order(y, u, gate=dw.InnovationGate()),
            "takes no gate: it rejects other samples",
        ),
        (lambda y, u: dw.analysis.choose_order(y, u, scale=dw.models.InverseGamma(-1.0, 1.0)), "proper prior"),
        (lambda y, u: dw.analysis.choose_order(y, u, P0=0.0), "P0 must be a positive"),
        (lambda y, u: dw.analysis.choose_order(y, u[:-1]), "they must be simultaneous"),
        (lambda y, u: dw.analysis.choose_order(y, u).odds(2, 9), "must be among those compared"),
        (lambda y, u: dw.analysis.OrderEvidence(inputs=2).add(y, u), r"u must have shape \(T, 2\)"),
        (lambda y, u: dw.analysis.choose_order(y, u, noise=dw.models.NoisePolynomial([0.1, 0.2])), "d must list"),
    ],
)
def test_wrong_input_is_explained(call, words):
    y, u = dw.simulate(A, B, samples=40, noise_std=0.5, seed=1)
    with pytest.raises(dw.InputError, match=words):
        call(y, u)
