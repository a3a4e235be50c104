"""Several outputs: the tables, recovery, both ways of running, models out, what is refused."""

import numpy as np
import pytest
import scipy.signal
from oracle.by_name import by_name

import driftwise as dw
from driftwise.detect.watch import OWN
from driftwise.models.convert_mimo import ModelMIMO
from driftwise.models.structure import Structure

THETA = [-1.2, 0.5, -0.1, 1.0, 0.5, 0.2, -0.8, 0.3, 0.4]  # (2, 1), one input
DIRECT = [-1.2, 0.5, -0.1, 1.0, 0.5, 0.7, 0.2, -0.8, 0.3, 0.4, -0.6]


def test_tables_are_those_of_the_form():
    form = Structure((2, 1), 1, True)
    assert form.names == [
        "a1.11", "a2.11", "a2.12", "b1.11", "b2.11", "b0.11", "a1.21", "a1.22", "b1.21", "a0.21", "b0.21",
    ]  # fmt: skip
    assert form.state_names == ["x2.1", "x1.1", "x1.2"]
    assert Structure((1, 2)).names == ["a1.11", "a1.12", "a1.21", "a2.21", "a1.22", "a2.22"][:2] + [
        "a2.21", "a1.22", "a2.22",
    ]  # fmt: skip
    assert Structure((1,) * 10).names[9] == "a1.1,10"
    for n, k, direct in [(1, 0, False), (3, 2, True)]:
        one, joint = Structure((n,), k, direct), dw.Joint(n, k, direct).model
        assert (one.names, one.N, one.salut.tolist()) == (joint.names, joint.N, joint.salut.tolist())
    for nu in [(2, 1), (1, 3, 2), (2, 2)]:
        form, p, n = Structure(nu, 2, True), len(nu), sum(nu)
        sizes = sum(form.length(i, j) for i in range(p) for j in range(p))
        assert form.N == n + sizes + 2 * (n + p)  # section 7.3
        assert np.array_equal(np.sort(form.salut), np.arange(form.N))


@pytest.mark.parametrize("split", [True, False])
@pytest.mark.parametrize("nu", [(2, 1), (1, 3, 2), (1, 1)])
def test_noise_free_data_are_recovered(nu, split):
    rng = np.random.default_rng(3)
    form = Structure(nu, 1, True)
    theta = np.where(form.sources < form.outputs, 0.2, 1.0) * rng.standard_normal(form.N - form.n)
    y, u = dw.models.simulate_mimo(nu, theta, samples=80, inputs=1, direct=True, u=rng.standard_normal(80), seed=1)
    est = dw.JointMIMO(nu, 1, True, noise=dw.models.EquationError(0.0), P0=100.0, split=split)
    trace = est.scan(y, u)
    error = np.max(abs(trace.parameters[-1] - theta))
    print(f"{nu}, split {split}: error {error:.1e}, largest variance left {trace.state['D'].max():.1e}")
    assert error < 1e-12
    assert trace.state["D"].max() == 0.0


NOISES = [
    dict(noise=dw.models.EquationError(0.01), P0=10.0),
    dict(),
    dict(noise=dw.models.NoisePolynomial((0.1, -0.4), 0.01), P0=10.0),
    dict(noise=dw.models.NoiseCovariance([[0.3, 0.1], [0.1, 0.2]], [0.1, 0.05], 0.5), P0=10.0),
    dict(memory=dw.RandomWalk(1e-4)),
    dict(gate=dw.InnovationGate(2.5)),
    dict(scale=dw.models.InverseGamma(2.0, 0.1), noise=dw.models.EquationError(1.0)),
]


def test_one_output_is_joint_where_everything_is_found_out():
    """Wrong numbers, doubtful and certain, and a jump that reaches b2 a sample later than b1."""
    rng = np.random.default_rng(0)
    u, y, x, theta = rng.standard_normal(400), np.empty(400), np.zeros(2), np.array([-1.0, 0.3, 1.0, 0.5])
    for t in range(400):
        theta[2:] += (t == 250) * np.array([1.4, -1.4])
        y[t] = x[0] + 0.2 * rng.standard_normal()
        x = np.append(x[1:], 0.0) - theta[:2] * y[t] + theta[2:] * u[t]
    y += 0.2 * (rng.random(400) < 0.04) * rng.uniform(3, 15, 400) * rng.choice([-1, 1], 400)
    one, many = (
        dw.Joint(2, 1, memory=dw.AutoMemory()).scan(y, u),
        dw.JointMIMO((2,), 1, memory=dw.AutoMemory()).scan(y, u),
    )
    assert len(one.jumps()) == 1 and np.sum(one.status & int(dw.Status.OUTLIER) != 0) > 5
    for name in ("x", "x_std", "parameters", "parameters_std"):
        np.testing.assert_allclose(getattr(many, name), getattr(one, name), rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("options", NOISES, ids=lambda o: "-".join(o) or "default")
@pytest.mark.parametrize("direct, lost_y, lost_u", [(False, 0, 0), (True, 0, 0), (True, 0.2, 0), (False, 0.2, 0.1)])
def test_one_output_is_joint(options, direct, lost_y, lost_u):
    rng = np.random.default_rng(4)
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=200, noise_std=0.1, missing=lost_y, seed=1)
    u = np.where(rng.random(200) < lost_u, np.nan, u)
    one, many = dw.Joint(2, 1, direct, **options), dw.JointMIMO((2,), 1, direct, **options)
    expected, got = one.scan(y, u, keep="covariance"), many.scan(y, u, keep="covariance")
    close = dict(rtol=1e-9, atol=1e-11)
    for name in ("prediction", "innovation", "variance", "status", "dof"):
        np.testing.assert_allclose(getattr(got, name)[:, 0], getattr(expected, name), **close)
    np.testing.assert_allclose(got.parameters, expected.parameters, **close)
    standard = np.sqrt(np.einsum("tii->ti", expected.covariance))
    scaled = standard[:, :, None] * standard[:, None, :]
    assert np.all(abs(got.covariance - expected.covariance) <= 1e-9 * scaled + 1e-18)
    np.testing.assert_allclose(many.mean(got.state), one.mean(expected.state), **close)
    assert many.loglik(got.state) == pytest.approx(one.loglik(expected.state), rel=1e-9)
    assert many.sigma2(got.state) == pytest.approx(one.sigma2(expected.state), rel=1e-9)


@pytest.mark.parametrize("nu", [(2, 1), (1, 3, 2)])
def test_coupled_is_split_where_nothing_links_the_outputs(nu):
    rng = np.random.default_rng(5)
    form = Structure(nu, 1, True)
    theta = np.where(form.sources < form.outputs, 0.2, 1.0) * rng.standard_normal(form.N - form.n)
    y, u = dw.models.simulate_mimo(nu, theta, samples=300, inputs=1, direct=True, noise_std=0.1, seed=1)
    d, R = tuple(0.3 * rng.standard_normal(v) for v in nu), 0.01 * np.arange(1.0, len(nu) + 1)
    for noise in (dw.models.EquationError(R), dw.models.NoisePolynomial(d, R)):
        P0 = by_name(dw.JointMIMO(nu, 1, True), rng.uniform(0.5, 2.0, form.N))
        options = dict(noise=noise, P0=P0, memory=dw.RandomWalk(1e-6))
        one, two = dw.JointMIMO(nu, 1, True, **options), dw.JointMIMO(nu, 1, True, split=False, **options)
        assert one.is_split and not two.is_split
        a, b = one.scan(y, u), two.scan(y, u)
        size = abs(a.prediction).max(), abs(a.parameters).max()
        assert np.max(abs(a.prediction - b.prediction)) <= 1e-13 * size[0]
        assert np.max(abs(a.parameters - b.parameters)) <= 1e-13 * size[1]
        np.testing.assert_allclose(a.parameters_std, b.parameters_std, rtol=1e-12)
        assert one.loglik(a.state) == pytest.approx(two.loglik(b.state), rel=1e-13)
    given = dw.models.NoiseCovariance(np.diag(np.arange(1.0, form.n + 1)), np.zeros((form.n, len(nu))), np.diag(R))
    assert dw.JointMIMO(nu, noise=given).is_split
    assert not dw.JointMIMO((1, 1), P0={"x1.1": {"x1.1": 1.0, "a1.22": 0.1}}).is_split


def test_each_output_learns_its_own_scale():
    y, u = dw.models.simulate_mimo((2, 1), THETA, samples=3000, inputs=1, noise_std=(0.1, 2.0), seed=1)
    est = dw.JointMIMO((2, 1), 1).scaled_to(y, u)
    trace = est.scan(y, u)
    assert np.sqrt(est.sigma2(trace.state)) * est.y_scale == pytest.approx([0.1, 2.0], rel=0.05)
    inside = np.mean(abs(trace.innovation) <= trace.band(0.95), axis=0)
    assert np.all(abs(inside - 0.95) < 0.012)  # three standard errors of 3000
    alpha, beta = est.scale_posterior(trace.state)
    assert alpha.tolist() == [1500 + (1 - 7) / 2, 1500 + (1 - 5) / 2] and np.all(beta > 0)  # 7 and 5 unknowns
    coupled = dw.JointMIMO(
        (2, 1), 1, split=False, noise=dw.models.EquationError((1.0, 400.0)), scale=dw.models.InverseGamma(1, 1)
    )
    state = coupled.scan(y, u).state
    assert np.sqrt(coupled.sigma2(state)) == pytest.approx([0.1, 0.1], rel=0.05)


def test_evidence_prefers_the_true_structure():
    y, u = dw.models.simulate_mimo((2, 1), THETA, samples=400, inputs=1, noise_std=0.3, seed=2)
    options = dict(noise=dw.models.EquationError(0.09), P0=10.0)
    evidence = {}
    for nu in [(1, 1), (2, 1), (1, 2), (2, 2), (3, 1), (3, 2)]:
        est = dw.JointMIMO(nu, 1, **options)
        evidence[nu] = est.loglik(est.scan(y, u, keep="innovations").state)
    assert max(evidence, key=evidence.get) == (2, 1)


def model(theta=DIRECT, nu=(2, 1), P=None, direct=True):
    theta = np.array(theta, float)
    return ModelMIMO(Structure(nu, 1, direct), theta, np.eye(len(theta)) * 1e-6 if P is None else P, 0.5)


def test_state_space_is_the_equations():
    m = model()
    u = np.random.default_rng(0).standard_normal((40, 1))
    expected, _ = dw.models.simulate_mimo((2, 1), DIRECT, samples=40, inputs=1, direct=True, u=u)
    A, B, C, D, dt = m.to_scipy()
    _, y, _ = scipy.signal.dlsim(scipy.signal.dlti(A, B, C, D, dt=dt), u)
    np.testing.assert_allclose(y, expected, atol=1e-11)
    w = np.linspace(0.1, 5, 7)
    G, _ = m.frequency_response(w)
    for h, z in enumerate(np.exp(1j * w * m.dt)):
        np.testing.assert_allclose(G[:, :, h], C @ np.linalg.solve(z * np.eye(3) - A, B) + D, rtol=1e-11)
    system = m.to_control()
    np.testing.assert_allclose(np.sort_complex(system.poles()), np.sort_complex(m.poles), atol=1e-11)
    np.testing.assert_allclose(system(1.0), m.dc_gain, rtol=1e-10)
    with pytest.raises(dw.InputError, match="no input"):
        ModelMIMO(Structure((1, 1)), np.zeros(4), np.eye(4)).to_control()


def test_uncertainties_are_first_order():
    """Exact derivatives against central differences of poles and gains."""
    rng = np.random.default_rng(1)
    L = rng.standard_normal((11, 11)) * 1e-3
    m, h = model(P=L @ L.T), 1e-6
    shifted = [[model(np.array(DIRECT) + s * h * e) for s in (1, -1)] for e in np.eye(11)]
    J = np.array([(a.poles - b.poles) / (2 * h) for a, b in shifted]).T
    J = np.stack([J.real, J.imag], axis=1)
    np.testing.assert_allclose(m.poles_covariance, J @ m.covariance @ J.swapaxes(1, 2), rtol=1e-5, atol=1e-12)
    J = np.array([(a.dc_gain - b.dc_gain) / (2 * h) for a, b in shifted])
    expected = np.sqrt(np.einsum("apk,ab,bpk->pk", J, m.covariance, J))
    np.testing.assert_allclose(m.dc_gain_std, expected, rtol=1e-6)
    assert m.close_poles == []
    twins = [-0.5, 0.0, 0.0, -0.5001]
    assert ModelMIMO(Structure((1, 1)), np.array(twins), np.eye(4) * 1e-4).close_poles == [(0, 1)]
    multiple = ModelMIMO(Structure((2,)), np.array([-1.0, 0.25]), np.eye(2) * 1e-4)
    assert multiple.close_poles == [(0, 1)]


def test_the_trace_has_a_column_per_output(tmp_path):
    y, u = dw.models.simulate_mimo((2, 1), THETA, samples=60, inputs=1, noise_std=0.1, missing=0.1, seed=1)
    est = dw.JointMIMO((2, 1), 1)
    trace = est.scan(y, u, keep="covariance")
    table = trace.columns()
    for name in ("y.2", "u", "prediction.1", "dof.2", "status.1", "x2.1", "x1.2", "a0.21", "a0.21_std"):
        assert table[name].shape == (60,)
    assert list(trace.to_frame().columns) == list(table)
    assert trace.band().shape == (60, 2)
    standard = est.scan(y, u)
    np.testing.assert_allclose(trace.parameters_std, standard.parameters_std, rtol=1e-9)
    assert any("output 2" in e.text for e in trace.events())
    np.testing.assert_allclose(trace.model(30).values, trace.parameters[30])
    trace.save(tmp_path / "trace")
    back = dw.Trace.load(tmp_path / "trace")
    assert np.array_equal(back.table, trace.table, equal_nan=True) and np.array_equal(back.dof, trace.dof)
    assert back.names == trace.names and repr(back.estimator) == repr(est)
    ratios = [ratio for ratio, _ in est.information_ratio(trace.state)]
    assert len(ratios) == 9 and max(ratios) < 0.5


REFUSED = {
    "order nu_i of each output": lambda: dw.JointMIMO("21"),
    "whole numbers": lambda: dw.JointMIMO((2, 1.5)),
    "of at least 1": lambda: dw.JointMIMO((2, 0)),
    "whole numbers of at least 1": lambda: dw.JointMIMO((True, 1)),
    "is empty": lambda: dw.JointMIMO(()),
    "limit is 2000": lambda: dw.JointMIMO((300, 300), 3),
    "not for several outputs": lambda: dw.JointMIMO((2, 1), noise=dw.models.OutputError()),
    "brackets": lambda: dw.JointMIMO((2, 1), noise=dw.models.EquationError),
    "one per output": lambda: dw.JointMIMO((2, 1), noise=dw.models.EquationError((1.0, 2.0, 3.0))),
    "d must list": lambda: dw.JointMIMO((2, 1), noise=dw.models.NoisePolynomial((0.1, 0.2))),
    "stacked states": lambda: dw.JointMIMO((2, 1), noise=dw.models.NoiseCovariance(np.eye(2), np.zeros(2), 1.0)),
    "negative eigenvalue": lambda: dw.JointMIMO(
        (1, 1), noise=dw.models.NoiseCovariance(np.eye(2), 2 * np.eye(2), np.eye(2))
    ),
    "links the outputs": lambda: dw.JointMIMO((1, 1), P0={"x1.1": {"x1.1": 1.0, "a1.22": 0.1}}, split=True),
    "y_scale must be": lambda: dw.JointMIMO((2, 1), y_scale=(1.0, 2.0, 3.0)),
    "y_scale must be positive": lambda: dw.JointMIMO((2, 1), y_scale=(1.0, -2.0)),
    "s0 of several outputs is given by name": lambda: dw.JointMIMO((2, 1), s0=np.zeros(12)),
    "s0 must be a finite vector": lambda: dw.JointMIMO((2, 1), s0={"a1.11": np.nan}),
    "memory must be": lambda: dw.JointMIMO((2, 1), memory=0.98),
    "gate must be": lambda: dw.JointMIMO((2, 1), gate=3.0),
    "one column per output": lambda: dw.JointMIMO((2, 1)).scan(np.zeros((5, 3))),
    "shape \\(T, 2\\)": lambda: dw.JointMIMO((2, 1)).scan(np.zeros(5)),
    "u was not given": lambda: dw.JointMIMO((2, 1), 1).scan(np.zeros((5, 2))),
    "must be simultaneous": lambda: dw.JointMIMO((2, 1), 1).scan(np.zeros((5, 2)), np.zeros(4)),
    "one sample is 2 output": lambda: dw.JointMIMO((2, 1)).update(dw.JointMIMO((2, 1)).start(), 1.0),
    "one row per state": lambda: dw.JointMIMO((2, 1)).update_batch(dw.JointMIMO((2, 1)).start(3), np.zeros((3, 4))),
    "another estimator": lambda: dw.JointMIMO((2, 1)).scan(np.zeros((5, 2)), state=dw.JointMIMO((1, 1)).start()),
    "parameters must list": lambda: dw.models.simulate_mimo((2, 1), [1.0], samples=3),
}


@pytest.mark.parametrize("message", REFUSED)
def test_what_does_not_fit_is_refused_with_words(message):
    with pytest.raises(dw.InputError, match=message):
        REFUSED[message]()


def gappy(seed, T=60, outputs=2):
    rng = np.random.default_rng(seed)
    y, u = rng.standard_normal((T, outputs)), rng.standard_normal(T)
    y[rng.random(y.shape) < 0.3] = np.nan
    u[rng.random(T) < 0.2] = np.nan
    return y, u


def test_a_certain_scale_is_a_known_one():
    """Products of two errors are absolute: in the moments relative to sigma^2 each carries one more sigma^2."""
    y, u = gappy(1)
    known = dw.JointMIMO((2, 1), 1, True, noise=dw.models.EquationError(0.25), P0=0.5, split=False)
    scale = dw.models.InverseGamma(1e12, 0.25e12)
    learnt = dw.JointMIMO((2, 1), 1, True, noise=dw.models.EquationError(1.0), scale=scale, P0=2.0, split=False)
    one, other = known.scan(y, u), learnt.scan(y, u)
    assert np.allclose(one.prediction, other.prediction, rtol=1e-6, atol=1e-8)
    assert np.allclose(one.variance, other.variance, rtol=1e-6)
    assert np.allclose(one.parameters, other.parameters, rtol=1e-6, atol=1e-8)


def test_a_restart_of_one_output_is_joints():
    y, u = dw.simulate([-1.3], [1.0], samples=60, noise_std=0.1, seed=1)
    y, u = np.concatenate([y[:30], np.full(300, np.nan), y[30:]]), np.concatenate([u[:30], np.ones(300), u[30:]])
    scale = dw.models.InverseGamma(2.0, 0.02)
    one = dw.Joint(1, 1, scale=scale).scan(y, u)
    several = dw.JointMIMO((1,), 1, scale=scale).scan(y[:, None], u)
    assert (one.status & int(dw.Status.LOST)).any()
    assert np.array_equal(several.status[:, 0], one.status)
    assert np.allclose(several.variance[:, 0], one.variance, rtol=1e-6)


def test_each_group_jumps_by_its_own_steps():
    y, u = gappy(2)
    steps = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    est = dw.JointMIMO(
        (1, 1),
        1,
        noise=dw.models.EquationError(1.0),
        memory=dw.RestartOnChange(response=dw.memory.CovarianceInflation(steps), settle=5),
        P0=1e6,
    )
    assert est.is_split
    y, u = np.nan_to_num(y), np.nan_to_num(u)
    state = est.scan(y[:50], u[:50]).state
    alarmed = state.copy()
    alarmed["detector_state"][:, OWN] = 1e3
    calm, alarmed = (est.update(s, y[50], u[50])[0] for s in (state, alarmed))
    gained = np.diag(est.covariance(alarmed) - est.covariance(calm))[2:]
    assert np.allclose(gained, steps**2, rtol=1e-9)


def test_each_output_of_a_group_has_a_detector_of_its_own():
    y, u = (np.nan_to_num(v) for v in gappy(2))
    memory = dw.RestartOnChange(dw.detect.VarianceCUSUM(4.0, threshold=1e9), settle=5)
    est = dw.JointMIMO((1, 1), 1, noise=dw.models.EquationError(0.2), memory=memory, split=False)
    state = est.scan(y[:50], u[:50]).state
    state["detector_state"][:, OWN] = 3.0, 4.0
    after, step = est.update(state, y[50], u[50])
    expected = [3.0, 4.0] - 0.5 * np.log(4.0) + 0.375 * step.innovation**2 / step.variance
    assert np.allclose(after["detector_state"][:, OWN], expected, rtol=1e-12)


def test_poles_move_with_what_acts_at_once():
    """Three outputs, the middle one acting at once on the last: by finite differences."""
    form = Structure((3, 2, 1), 0)
    values = np.random.default_rng(0).uniform(-0.4, 0.4, form.N - form.n)
    assert {"a0.21", "a0.31", "a0.32"} <= set(form.names)

    def poles(theta):
        return np.sort_complex(ModelMIMO(form, theta, np.zeros((len(theta),) * 2)).poles)

    m, step = len(values), 1e-6
    for at in range(m):
        e = step * (np.arange(m) == at)
        slope = abs(poles(values + e) - poles(values - e)) / (2 * step)
        unit = np.outer(e, e) / step**2
        model = ModelMIMO(form, values, unit)
        std = model.poles_std[np.lexsort((model.poles.imag, model.poles.real))]
        assert np.allclose(std, slope, rtol=1e-4, atol=1e-7), form.names[at]
