"""`ARXMIMO`: equations side by side against batch least squares, against `ARX`, with gaps, and as a user meets it."""

import numpy as np
import pytest
from draws import slow

import driftwise as dw
from driftwise.analysis.laws import LAWS, example, same

NA, NB, NK = [[2, 1], [0, 3]], [[1, 2], [2, 0]], [[1, 0], [2, 1]]

ESTIMATORS = {
    "default": dw.ARXMIMO(2, 1),
    "orders, delays, offset": dw.ARXMIMO(2, 2, NA, NB, NK, offset=True),
    "weighted": dw.ARXMIMO(2, 1, memory=dw.ExponentialForgetting(0.98)),
    "limited gain": dw.ARXMIMO(2, 1, memory=dw.memory.GainFloor(50)),
    "walk": dw.ARXMIMO(2, 1, [[2, 0], [1, 1]], memory=dw.RandomWalk(1e-5)),
    "known noise, gate": dw.ARXMIMO(2, 1, 1, 1, variance=(0.01, 0.04), gate=dw.InnovationGate(), P0=10.0),
    "until a jump": dw.ARXMIMO(
        2, 1, memory=dw.RestartOnChange(dw.PageHinkley(threshold=4.0), dw.memory.GainReset(10), settle=10)
    ),
    "variable forgetting": dw.ARXMIMO(2, 1, memory=dw.memory.VariableForgetting(50)),
    "window": dw.ARXMIMO(2, 1, [[2, 0], [1, 1]], memory=dw.memory.Window(30)),
    "run lengths": dw.ARXMIMO(2, 1, [[2, 0], [1, 1]], memory=dw.memory.BayesianChangePoint(0.3, 50, 5)),
    "missing held": dw.ARXMIMO(2, 1, missing="hold"),
    "missing skipped": dw.ARXMIMO(2, 1, missing="skip", memory=dw.ExponentialForgetting(0.95)),
    "no input": dw.ARXMIMO(3, 0, 1, offset=True),
    "one output": dw.ARXMIMO(1, 1),
    "proper scale": dw.ARXMIMO(2, 1, scale=dw.models.InverseGamma(2.0, 0.1), P0=1e3),
}


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
@pytest.mark.parametrize("name", ESTIMATORS)
def test_law(name, law):
    est = ESTIMATORS[name]
    law(est, *example(est))


# --- oracles -----------------------------------------------------------------------------------------------


def regressors(y, u, i, na, nb, nk, offset=False):
    """The regressor of output i at every sample, (T, N_i), from its definition."""
    T, columns = len(y), []

    def lagged(x, lag):
        return np.concatenate([np.zeros(lag), x])[:T]

    for j, count in enumerate(na[i]):
        columns += [-lagged(y[:, j], lag) for lag in range(1, count + 1)]
    for l, (count, first) in enumerate(zip(nb[i], nk[i])):
        columns += [lagged(u[:, l], lag) for lag in range(first, first + count)]
    return np.column_stack(columns + [np.ones(T)] * offset)


def plain(y, u, na, nb, nk, P0=1e4):
    """Equation after equation in full matrices; what is not known of all outputs so far has one covariance E."""
    p, seen = y.shape[1], []
    filled, E, names = np.nan_to_num(y), np.zeros((y.size, y.size)), range(y.shape[1])
    sizes = [sum(na[i]) + sum(nb[i]) for i in names]
    theta, P = [np.zeros(n) for n in sizes], [P0 * np.eye(n) for n in sizes]
    count, chi2 = [1.0 - n for n in sizes], [2e-20 for _ in names]
    for t in range(len(y)):
        filled[t] = 0.0
        line, told = [], []
        for i in names:
            psi = regressors(filled[: t + 1], u[: t + 1], i, na, nb, nk)[t]
            lags = [((t - lag) * p + j, lag <= t) for j, n in enumerate(na[i]) for lag in range(1, n + 1)]
            at, own = [m for m, is_there in lags if is_there], [k for k, (_, is_there) in enumerate(lags) if is_there]
            S, a = E[np.ix_(at, at)], theta[i][own]
            s2 = chi2[i] / 2 / max(count[i] / 2, 0.5)
            s2 = max(s2, 1.0) if count[i] < 1 else s2  # not known yet
            R = 1 + (a @ S @ a + s2 * np.sum(P[i][np.ix_(own, own)] * S)) / s2
            T = psi @ P[i] @ psi + R
            yhat, variance, e = psi @ theta[i], s2 * T, y[t, i] - psi @ theta[i]
            line += [yhat, variance]
            if np.isnan(e):
                top = 100 * np.nanmax(np.append(abs(y[:t, i]), 0)) ** 2
                if variance > max(top, 100 * s2) or count[i] == 1 - sizes[i]:  # absurd, or nothing learnt yet
                    yhat, variance = 0.0, max(top, 1e-300)
            else:
                gain = P[i] @ psi / T
                theta[i], P[i] = theta[i] + gain * e, P[i] - np.outer(gain, psi @ P[i])
                count[i], chi2[i] = count[i] + 1, chi2[i] + e * e / T
            c = np.zeros(y.size)
            c[at] = -theta[i][own]
            told.append((yhat, variance, e, c, c @ E @ c))
        seen.append(line)
        moved = np.zeros(y.size)
        for _, variance, e, c, share in told:
            if not np.isnan(e):
                g = E @ c
                T = variance - share + c @ g
                E, moved = E - np.outer(g, g) / T, moved + g * (e - c @ moved) / T
        filled += moved.reshape(y.shape)
        errors = np.zeros((p, y.size))
        for i, (yhat, _, e, c, _) in enumerate(told):
            filled[t, i] = y[t, i]
            if np.isnan(e):
                filled[t, i] = yhat
                if yhat != 0.0:
                    filled[t, i], errors[i] = yhat + c @ moved, c
        here = slice(t * p, t * p + p)
        E[here] = errors @ E
        E[:, here] = E[here].T
        E[here, here] = errors @ E @ errors.T
        for i, (_, variance, e, c, share) in enumerate(told):
            if np.isnan(e):
                E[t * p + i, t * p + i] = variance - share + c @ E @ c if errors[i].any() else variance
    return np.array(seen), np.concatenate(theta), P


# --- against them ------------------------------------------------------------------------------------------


def test_equals_batch_least_squares():
    """Every equation with orders and delays of its own: theta, P and sigma^2 of the stacked regression."""
    rng = np.random.default_rng(1)
    y, u = rng.standard_normal((200, 2)), rng.standard_normal((200, 2))
    est = dw.ARXMIMO(2, 2, NA, NB, NK, offset=True, P0=100.0, at_rest=True)
    state = est.scan(y, u).state
    at, P = 0, est.covariance(state)
    for i in range(2):
        psi = regressors(y, u, i, NA, NB, NK, offset=True)
        n = psi.shape[1]
        information = np.eye(n) / 100 + psi.T @ psi
        theta = np.linalg.solve(information, psi.T @ y[:, i])
        np.testing.assert_allclose(state["theta"][at : at + n], theta, rtol=0, atol=1e-12)
        np.testing.assert_allclose(P[at : at + n, at : at + n], np.linalg.inv(information), rtol=0, atol=1e-12)
        s2 = (y[:, i] @ y[:, i] - theta @ information @ theta) / (
            1 + 200 - n
        )  # 2 alpha of the reference prior is 1 - n
        assert est.sigma2(state)[i] == pytest.approx(s2, rel=1e-12)
        at += n
    assert at == est.model.N and np.all(P[:7, 7:] == 0)


@pytest.mark.parametrize(
    "options",
    [{}, dict(memory=dw.ExponentialForgetting(0.98), gate=dw.InnovationGate(3.0)),
     dict(missing="hold", memory=dw.RandomWalk(1e-5)),
     dict(missing="skip", offset=True, variance=0.01, P0=10.0)],
    ids=str,
)  # fmt: skip
def test_one_output_is_arx_bit_for_bit(options):
    y, u = example(dw.ARX(2, (2, 1), (1, 0)), samples=300)
    for keep in ("innovations", "means", "std", "covariance"):
        one = dw.ARX(2, (2, 1), (1, 0), **options).scan(y, u, keep=keep)
        got = dw.ARXMIMO(1, 2, 2, [[2, 1]], [[1, 0]], **options).scan(y[:, None], u, keep=keep)
        assert got.names == one.names
        assert same(got.table, one.table)
        assert same(got.dof[:, 0], one.dof)
    for name in ("theta", "D", "U", "ys", "ys_covariance", "us", "us_variance", "steps"):
        assert same(got.state[name].ravel(), one.state[name].ravel()), name


@pytest.mark.parametrize("lost", [0.0, 0.3])
def test_follows_full_matrices_through_gaps(lost):
    est = dw.ARXMIMO(2, 1, [[2, 1], [1, 1]], [[1], [2]], at_rest=True)
    y, u = example(est, samples=150, missing=lost)
    u = np.nan_to_num(u)
    expected, theta, P = plain(y, u, est.model.na, est.model.nb, est.model.nk)
    trace = est.scan(y, u, keep="covariance")
    for i in range(2):
        np.testing.assert_allclose(trace.prediction[:, i], expected[:, 2 * i], rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(trace.variance[20:, i], expected[20:, 2 * i + 1], rtol=1e-7)
    np.testing.assert_allclose(trace.state["theta"], theta, rtol=1e-8, atol=1e-10)
    n = len(P[0])
    scaled = est.sigma2(trace.state)[1] * P[1]
    np.testing.assert_allclose(trace.covariance[-1][n:, n:], scaled, rtol=1e-6, atol=1e-12)


def test_a_missing_output_skips_its_own_equation_only():
    est = dw.ARXMIMO(2, 1)
    y, u = example(est, missing=0.0)
    gap = y.copy()
    gap[60, 1] = np.nan
    whole, got = est.scan(y, u), est.scan(gap, u)
    n = est.model.sizes[0]
    assert same(got.table[:61, 0::2][:, :4], whole.table[:61, 0::2][:, :4])  # y1's columns, sample 60 included
    assert same(got.parameters[60, :n], whole.parameters[60, :n])
    assert same(got.parameters[60, n:], got.parameters[59, n:])
    assert got.status[60].tolist() == [0, dw.Status.MISSING_OUTPUT]
    assert got.status[61, 0] & dw.Status.FILLED and got.variance[61, 0] > whole.variance[61, 0]


TRUTH = [-1.2, 0.5, -0.1, 1.0, 0.5, 0.2, -0.8, 0.3, 0.0]  # (2, 1), one input, nothing at once
ORDERS = dict(na=[[2, 2], [1, 1]], nb=[2, 1])


@pytest.mark.parametrize("missing, low, high", [slow(0.0, 0.97, 1.03), (0.3, 0.93, 1.07)])
def test_error_bars_of_predictions_hold(missing, low, high):
    """NIS after 300 samples, 40 records of 1500: its standard error is about .008 for each output."""
    found = []
    for seed in range(40):
        y, u = dw.models.simulate_mimo(
            (2, 1), TRUTH, samples=1500, inputs=1, noise_std=(0.1, 0.3), missing=missing, seed=seed
        )
        trace = dw.ARXMIMO(2, 1, **ORDERS).scaled_to(y, u).scan(y, u, keep="innovations")
        found.append(np.nanmean(trace.innovation[300:] ** 2 / trace.variance[300:], axis=0))
    nis = np.mean(found, axis=0)
    print(f"lost {missing:.0%}: NIS {nis.round(3)}")
    assert np.all((low < nis) & (nis < high))


@pytest.mark.slow
def test_error_bars_of_parameters_hold():
    """Mean squared error over covariance of nine parameters, 200 complete records: 1 with standard error .033."""
    found = []
    truth = np.array([-1.2, 0.5, 0.0, -0.1, 1.0, 0.5, 0.2, -0.8, 0.3])
    for seed in range(200):
        y, u = dw.models.simulate_mimo((2, 1), TRUTH, samples=400, inputs=1, noise_std=(0.1, 0.3), seed=seed)
        m = dw.ARXMIMO(2, 1, **ORDERS).scaled_to(y, u).scan(y, u, keep="innovations").model()
        error = m.values - truth
        found.append(error @ np.linalg.solve(m.covariance, error) / 9)
    print(f"per parameter {np.mean(found):.3f}")
    assert 0.9 < np.mean(found) < 1.13


def test_covariance_of_the_noises():
    """Lambda: the weighed sums exactly under Constant; near the truth with gaps and forgetting."""
    R = np.array([[0.01, 0.018], [0.018, 0.09]])
    noise = dw.models.NoiseCovariance(np.zeros((3, 3)), np.zeros((3, 2)), R)
    y, u = dw.models.simulate_mimo((2, 1), TRUTH, samples=4000, inputs=1, noise=noise, seed=3)
    est = dw.ARXMIMO(2, 1, **ORDERS, at_rest=True).scaled_to(y, u)
    trace = est.scan(y, u)
    np.testing.assert_allclose(est.noise_covariance(trace.state), R, rtol=0.06)
    assert trace.summary().notes == [
        "the noises of y1 and y2 are linked (r = 0.61): each equation is right, but the bars of poles and gains leave "
        "the link out"
    ]
    known = dw.ARXMIMO(2, 1, **ORDERS, variance=np.diag(R), at_rest=True)
    e = known.scan(y, u)
    w = np.diag(R) / e.variance
    products = np.prod(e.innovation * w, axis=1).sum() / np.prod(w, axis=1).sum()
    assert known.noise_covariance(e.state)[0, 1] == pytest.approx(products, rel=1e-9)
    y[np.random.default_rng(0).random(y.shape) < 0.2] = np.nan
    fading = dw.ARXMIMO(2, 1, **ORDERS, memory=dw.ExponentialForgetting(0.999)).scaled_to(y, u)
    state = fading.scan(y, u).state
    np.testing.assert_allclose(fading.noise_covariance(state), R, rtol=0.15)
    assert 500 < state["weights"][0, 0] < 1000  # a memory of 1000 samples, less what gaps cost


# --- as a user meets it ------------------------------------------------------------------------------------


def test_the_model_is_the_equations():
    est = dw.ARXMIMO(2, 2, NA, NB, NK, offset=True)
    rng = np.random.default_rng(4)
    theta = 0.3 * rng.standard_normal(est.model.N)
    m = est.model_at(theta, 1e-4 * np.eye(est.model.N))
    assert m.names == [name for name in est.names if not name.startswith("offset")]
    w = np.array([0.1, 1.0, 2.5])
    value = dict(zip(est.names, theta))
    for k, z in enumerate(np.exp(1j * w)):
        A, B = np.eye(2, dtype=complex), np.zeros((2, 2), complex)
        for i, j in np.ndindex(2, 2):
            A[i, j] += sum(value[f"a{h}.{i + 1}{j + 1}"] * z**-h for h in range(1, NA[i][j] + 1))
            B[i, j] += sum(value[f"b{h}.{i + 1}{j + 1}"] * z**-h for h in range(NK[i][j], NK[i][j] + NB[i][j]))
        G = np.linalg.solve(A, B)
        np.testing.assert_allclose(m.frequency_response(w)[0][:, :, k], G, rtol=1e-12)
        np.testing.assert_allclose(m.to_control()(z), G, rtol=1e-9)
    u = rng.standard_normal((50, 2))
    y, _ = dw.models.simulate_mimo(m.form, m.values, samples=50, u=u)
    np.testing.assert_allclose(y[:, 0], regressors(y, u, 0, NA, NB, NK) @ theta[: est.model.sizes[0] - 1], atol=1e-12)


def test_trace_summary_and_picture(tmp_path):
    import matplotlib

    matplotlib.use("Agg")
    y, u = dw.models.simulate_mimo((2, 1), TRUTH, samples=600, inputs=1, noise_std=(0.1, 0.3), missing=0.05, seed=1)
    trace = dw.ARXMIMO(2, 1, **ORDERS, dt=0.5, at_rest=True).scaled_to(y, u).scan(y, u)
    assert trace.x.shape == (600, 0) and trace.parameters_std.shape == (600, 9)
    assert {"prediction.2", "a2.12", "a2.12_std", "weight.1"} <= set(trace.columns())
    assert trace.weight[-1].tolist() == (~np.isnan(y)).sum(axis=0).tolist()
    assert trace.events()[0].text.startswith("output")
    assert same(trace.state_before(300), dw.ARXMIMO(**trace.estimator.options).scan(y[:300], u[:300]).state)
    assert trace.plot().shape == (2, 3)
    summary = trace.summary()
    assert [one.noise_std for one in summary.outputs] == pytest.approx([0.1, 0.3], rel=0.1)
    assert "the error bars can be believed" in summary.words and summary.as_dict()["loglik"] is not None
    trace.save(tmp_path / "run")
    again = dw.Trace.load(tmp_path / "run")
    assert same(again.table, trace.table) and again.summary().words == summary.words
    assert trace.model(at=300).values[0] == trace.parameters[300, 0]


def test_each_equation_has_a_detector_of_its_own():
    """y2's equation changes: its detector says so, y1's says nothing."""
    changed = [*TRUTH[:7], 0.9, 0.0]
    theta = np.repeat([TRUTH, changed], [700, 300], axis=0)
    y, u = dw.models.simulate_mimo((2, 1), theta, samples=1000, inputs=1, noise_std=0.1, seed=5)
    memory = dw.RestartOnChange(dw.detect.ScoreCUSUM("1 per 1_000_000", jump=0.3), dw.memory.GainReset(5))
    trace = dw.ARXMIMO(2, 1, **ORDERS, memory=memory).scaled_to(y, u).scan(y, u)
    first, *_ = (event for event in trace.events() if event.kind == "JUMP")
    assert 700 <= first.sample < 720 and first.text.startswith("output 2: jump: ")
    assert not np.any(trace.status[:, 0] & dw.Status.JUMP)
    assert trace.parameters[-1, -1] == pytest.approx(0.9, abs=0.05)


def test_evidence_is_the_sum_over_equations():
    y, u = dw.models.simulate_mimo((2, 1), TRUTH, samples=300, inputs=1, noise_std=0.1, seed=2)
    prior = dict(scale=dw.models.InverseGamma(2.0, 0.1), P0=10.0)
    one = dw.ARX(2, (2, 2), **prior).scan(y[:, 0], np.column_stack([-y[:, 1], u])).summary()
    two = dw.ARX(1, (1, 1), **prior).scan(y[:, 1], np.column_stack([-y[:, 0], u])).summary()
    est = dw.ARXMIMO(2, 1, **ORDERS, **prior)
    assert est.loglik(est.scan(y, u).state) == pytest.approx(one.loglik + two.loglik, rel=1e-9)


BAD = {
    "has no regressor": lambda: dw.ARXMIMO(2, 1, [[0, 0], [1, 1]], [[0], [1]]),
    "na must be a whole number, 2 of them": lambda: dw.ARXMIMO(2, 1, [[1, 1]]),
    "nk must be a whole number of at least 0": lambda: dw.ARXMIMO(2, 1, nk=-1),
    "P0 links parameters": lambda: dw.ARXMIMO(2, 0, 1, P0={"a1.11": {"a1.11": 1.0, "a1.22": 0.1}}),
    "one column per output": lambda: dw.ARXMIMO(2).scan(np.zeros((5, 3))),
    "variance must be positive": lambda: dw.ARXMIMO(2, variance=(1.0, 0.0)),
    "theta0 must be a finite vector of 4": lambda: dw.ARXMIMO(2, 0, 1, theta0={"a1.11": np.inf}),
    "theta0 of several outputs is given by name": lambda: dw.ARXMIMO(2, 0, 1, theta0=[0.0] * 4),
    "memory must be": lambda: dw.ARXMIMO(2, memory=3),
}


@pytest.mark.parametrize("words", BAD)
def test_what_does_not_fit_is_said(words):
    with pytest.raises(dw.InputError, match=words):
        BAD[words]()
