"""Several outputs as a user meets them: summary, picture, structure choice, zeros, and what is refused."""

import json

import matplotlib
import numpy as np
import pytest
import scipy.signal
import scipy.stats
from draws import slow

import driftwise as dw
from driftwise.models.convert_mimo import ModelMIMO
from driftwise.models.structure import Structure

matplotlib.use("Agg")

THETA = [-1.2, 0.5, -0.1, 1.0, 0.5, 0.2, -0.8, 0.3, 0.4]  # (2, 1), one input; the last is a0.21
R = np.array([[0.01, 0.018], [0.018, 0.09]])  # correlation 0.6


def linked(R=R):
    return dw.models.NoiseCovariance(np.zeros((3, 3)), np.zeros((3, 2)), R)


def record(samples=1500, seed=1, **options):
    options = options or dict(noise_std=(0.1, 0.3))
    return dw.models.simulate_mimo((2, 1), THETA, samples=samples, inputs=1, seed=seed, **options)


def theta_of(form, rng, within=0.8):
    """Parameters of a stable plant: poles of each output's own, weak coupling."""
    while True:
        theta = np.where(form.sources < form.outputs, 0.2, 1.0) * rng.standard_normal(form.N - form.n)
        for i, nu in enumerate(form.nu):
            theta[(form.targets == i) & (form.sources == i)] = np.poly(rng.uniform(-within, within, nu))[1:]
        if abs(ModelMIMO(form, theta, np.eye(len(theta))).poles).max() < 0.95:
            return theta


@pytest.fixture(scope="module")
def trace():
    y, u = record(noise_std=(0.1, 0.3), missing=0.03)
    return dw.JointMIMO((2, 1), 1, dt=0.5).scaled_to(y, u).scan(y, u)


# --- summary -----------------------------------------------------------------------------------------------


def test_one_output_has_the_summary_of_joint():
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=600, noise_std=0.1, missing=0.05, seed=3)
    gate = dict(gate=dw.InnovationGate(3.0))
    one = dw.Joint(2, 1, **gate).scaled_to(y, u).scan(y, u).summary()
    many = dw.JointMIMO((2,), 1, **gate).scaled_to(y, u).scan(y, u).summary()
    got = many.outputs[0]
    for name in ("fit", "rmse", "noise_std", "nis", "coverage", "observed", "rejected"):
        assert getattr(got, name) == pytest.approx(getattr(one, name), rel=1e-9), name
    assert got.missing == one.missing_outputs > 0
    assert got.whiteness.p_value == pytest.approx(one.whiteness.p_value, rel=1e-6)
    assert many.loglik == pytest.approx(one.loglik, rel=1e-9)
    for a, b in zip(many.parameters, one.parameters):
        assert a[0] == b[0] and a[1:] == pytest.approx(b[1:], rel=1e-9)
    assert [std for _, std in many.poles] == pytest.approx([std for _, std in one.poles], rel=1e-6)
    assert many.gains[0][2:] == pytest.approx((one.model.dc_gain[0], one.model.dc_gain_std[0]), rel=1e-6)


def test_numbers_of_each_output_are_what_they_say(trace):
    summary = trace.summary()
    used = (trace.status & 0b1101) == 0
    z = np.full(used.shape, np.nan)
    for i, (one, N) in enumerate(zip(summary.outputs, (2 + 5, 1 + 4))):
        late = used[:, i] & (np.cumsum(used[:, i]) > 2 * N)
        e, T = trace.innovation[late, i], trace.variance[late, i]
        assert one.rmse == pytest.approx(np.sqrt(np.mean(e**2)), rel=1e-12)
        assert one.fit == pytest.approx(100 * (1 - one.rmse / trace.y[late, i].std()), rel=1e-12)
        dof = 2 * (0.5 + (np.arange(used[:, i].sum()) - N) / 2)[2 * N :]
        scored = dof >= 10
        e, T, dof = e[scored], T[scored], dof[scored]
        assert one.nis == pytest.approx(np.mean(e**2 / T * (1 - 2 / dof)), rel=1e-12)
        assert one.coverage == np.mean(abs(e) / np.sqrt(T) <= scipy.stats.t.ppf(0.975, dof))
        assert one.observed + one.missing == 1500
        z[np.flatnonzero(late)[scored], i] = np.clip(e / np.sqrt(T), -4, 4)
        sure = (0.1, 0.3)[i] / np.sqrt(2 * one.observed)
        assert abs(one.noise_std - (0.1, 0.3)[i]) < 4 * sure
    both = np.isfinite(z).all(axis=1)
    r = np.sum(z[both, 0] * z[both, 1]) / np.sqrt(np.sum(z[both, 0] ** 2) * np.sum(z[both, 1] ** 2))
    assert summary.correlation[0, 1] == pytest.approx(r, rel=1e-9) == summary.correlation[1, 0]
    assert summary.linked == [] and summary.notes == []
    assert abs(summary.correlation[0, 1]) < 4 / np.sqrt(1500)


def test_piece_by_piece_is_the_whole(trace):
    whole, pieces = trace.summary(), dw.results.SummaryMIMO(trace.estimator)
    state, sizes = None, []
    for first in range(0, 1500, 250):
        piece = trace.estimator.scan(trace.y[first : first + 250], trace.u[first : first + 250], state=state)
        state = pieces.add(piece).state
        sizes.append(sum(np.size(v) for v in vars(pieces).values()))
    assert len(set(sizes[1:])) == 1
    a, b = whole.as_dict(), pieces.as_dict()
    assert a.pop("words") == b.pop("words")
    np.testing.assert_allclose(a["correlation"], b["correlation"], rtol=1e-9)
    for one, other in zip(a["outputs"], b["outputs"]):
        assert one["whiteness"]["p_value"] == pytest.approx(other["whiteness"]["p_value"], rel=1e-9)
        assert one["coverage"] == other["coverage"] and one["fit"] == pytest.approx(other["fit"], rel=1e-9)
    assert a["parameters"] == b["parameters"] and a["loglik"] == b["loglik"]
    json.dumps(a, allow_nan=False)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_linked_noises_are_seen_and_cured(seed):
    """Split, an a0 takes part of the link for itself; coupled with the R that the summary offers it does not."""
    y, u = record(3000, seed, noise=linked())
    split = dw.JointMIMO((2, 1), 1).scaled_to(y, u).scan(y, u).summary()
    coupled = dw.JointMIMO((2, 1), 1, noise=linked(split.noise_covariance)).scaled_to(y, u).scan(y, u).summary()
    off = [abs(s.parameters[-1][1] - 0.4) / s.parameters[-1][2] for s in (split, coupled)]
    print(f"a0.21 is off by {off[0]:.1f} of its standard deviations split, {off[1]:.1f} coupled")
    assert off[0] > 2.5 > 2 > off[1]
    ((i, j, r),) = split.linked
    assert (i, j) == (1, 2) and abs(r - 0.6) < 0.05
    assert f"The noises of y1 and y2 are linked (r = {r:.2f}): estimate them together" in split.words
    assert coupled.linked == [] and "one filter for all outputs" in coupled.words
    np.testing.assert_allclose(coupled.noise_covariance, split.noise_covariance, rtol=1e-9)
    np.testing.assert_allclose(split.noise_covariance, R, rtol=0.1)
    assert coupled.outputs[1].rmse < 0.85 * split.outputs[1].rmse  # y_1(t) tells about y_2(t)
    stated = linked(np.diag(np.diag(R)))
    wrong = dw.JointMIMO((2, 1), 1, noise=stated, split=False).scaled_to(y, u).scan(y, u).summary()
    assert "innovations of y1 and y2 are linked" in wrong.words


def test_words_name_what_is_wrong():
    y, u = record(300)
    est = dw.JointMIMO((2, 1), 1).scaled_to(y, u)
    assert "too few for 7 and 5 unknowns" in est.scan(y[:5], u[:5]).summary().words
    good = est.scan(y, u).summary().words
    print(good)
    assert good.startswith("Structure (2, 1), one filter for each output: ")
    assert good.count("can be believed") == 2 and good.count("innovations are white") == 2
    assert "y2 from u1 -6." in good and "did not teach" not in good
    rest = est.scan(y, np.zeros_like(u)).summary()
    assert len(rest.unlearned) >= 3 and "did not teach" in rest.words
    low = dw.JointMIMO((1, 1), 1).scaled_to(y, u).scan(y, u).summary()
    assert not low.outputs[0].whiteness.is_white and "try a larger index" in low.words
    y[50, 1], u[60] = 500.0, np.nan
    lost = dw.JointMIMO((2, 1), 1, gate=dw.InnovationGate(5.0)).scaled_to(y, u).scan(y, u).summary()
    assert "y2: " in lost.words and "1 outlier ignored" in lost.words and "1 of 300 samples lack" in lost.words
    nothing = dw.results.SummaryMIMO(est).as_dict()
    assert nothing["words"].startswith("0 and 0 measured outputs are too few") and nothing["poles"][0]["std"] is None


# --- picture -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("nu, keep", [((2, 1), "std"), ((1, 1), "innovations"), ((2, 3, 1, 2), "means")])
def test_plot_shows_every_output_and_parameter(nu, keep, tmp_path):
    import matplotlib.pyplot as plt

    form = Structure(nu, 2, True)
    options = dict(samples=120, inputs=2, direct=True, noise_std=0.1, missing=0.05, seed=1)
    y, u = dw.models.simulate_mimo(nu, theta_of(form, np.random.default_rng(0)), **options)
    trace = dw.JointMIMO(nu, 2, True).scan(y, u, keep=keep)
    names = [f"level {i} (m)" for i in range(len(nu))]
    axes = trace.plot(labels={"outputs": names, "time": "hours"})
    assert axes.shape == (len(nu), 2 if keep == "innovations" else 3)
    assert [ax.get_ylabel() for ax in axes[:, 0]] == names and axes[-1, 1].get_xlabel() == "hours"
    for i, one in enumerate(trace.outputs):
        measured = next(line for line in axes[i, 0].lines if line.get_label() == "measured")
        np.testing.assert_array_equal(measured.get_ydata(), y[:, i])
        np.testing.assert_allclose(axes[i, 1].lines[1].get_ydata(), one.innovation / np.sqrt(one.variance))
    if keep != "innovations":
        shown = [line for ax in axes[:, 2] for line in ax.lines]
        assert [line.get_label() for line in shown] == trace.names
        np.testing.assert_array_equal([line.get_ydata()[-1] for line in shown], trace.parameters[-1])
        looks = [(line.get_color(), line.get_linestyle()) for line in axes[0, 2].lines]
        assert len(set(looks)) == len(looks)  # sixteen can be told apart
    if keep == "means":  # the most of them
        axes[0, 0].figure.savefig(tmp_path / "picture.png", dpi=40)
    plt.close("all")


# --- what is refused, and what to do instead ---------------------------------------------------------------


def test_report_and_smooth_say_what_to_use(trace):
    with pytest.raises(dw.InputError, match="summary"):
        trace.report("page.html")
    with pytest.raises(dw.InputError, match="smooth one output after the other"):
        trace.estimator.smooth(trace.y, trace.u)


def test_a_split_filter_is_joint_with_the_other_outputs_as_inputs():
    """What `JointMIMO.smooth` advises, P0 zero for what the structure leaves out."""
    y, u = record(400)
    split = dw.JointMIMO((2, 1), 1, noise=dw.models.EquationError((0.01, 0.09)), P0=10.0)
    trace = split.scan(y, u)
    first = dw.Joint(2, 2, noise=dw.models.EquationError(0.01), P0=[10, 10, 10, 10, 10, 0, 10, 10])  # no a1.12
    second = dw.Joint(1, 2, True, noise=dw.models.EquationError(0.09), P0=[10, 10, 10, 10, 10, 0])  # a0.21 but no b0.21
    others = np.column_stack([y[:, 1], u]), np.column_stack([y[:, 0], u])
    one, two = first.scan(y[:, 0], others[0]), second.scan(y[:, 1], others[1])
    np.testing.assert_allclose(one.prediction, trace.prediction[:, 0], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(two.prediction, trace.prediction[:, 1], rtol=1e-9, atol=1e-9)
    a11, a12, b1 = [one.parameters[-1][[first.names.index(n) for n in group]] for group in
                    (("a1", "a2"), ("b2.1",), ("b1.2", "b2.2"))]  # fmt: skip
    np.testing.assert_allclose(np.concatenate([a11, -a12, b1]), trace.parameters[-1][:5], rtol=1e-9)
    smoothed = first.smooth(y[:, 0], others[0])
    np.testing.assert_allclose(smoothed.parameters[0], one.parameters[-1], rtol=1e-6, atol=1e-9)


# --- models ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "nu, k, direct", [((2, 1), 2, True), ((1, 3, 2), 3, False), ((2, 2), 2, False), ((3,), 1, False)]
)
def test_model_of_a_scan_simulates_the_plant(nu, k, direct):
    """Noise-free: the model learnt from a record gives the outputs of another one; SciPy and control agree."""
    rng = np.random.default_rng(5)
    form = Structure(nu, k, direct)
    theta = theta_of(form, rng)
    options = dict(inputs=k, direct=direct)
    y, u = dw.models.simulate_mimo(nu, theta, samples=150, u=rng.standard_normal((150, k)), **options)
    trace = dw.JointMIMO(nu, noise=dw.models.EquationError(0.0), P0=100.0, **options).scan(y, u)
    model = trace.model()
    u = rng.standard_normal((60, k))
    expected, _ = dw.models.simulate_mimo(nu, theta, samples=60, u=u, **options)
    A, B, C, D, dt = model.to_scipy()
    _, got, _ = scipy.signal.dlsim(scipy.signal.dlti(A, B, C, D, dt=dt), u)
    np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-9)
    control = pytest.importorskip("control")
    system = model.to_control()
    np.testing.assert_allclose(
        control.forced_response(system, U=u.T).outputs.reshape(len(nu), -1).T, expected, atol=1e-9
    )
    np.testing.assert_allclose(sorted(abs(system.poles())), sorted(abs(model.poles)), atol=1e-9)

    zeros = model.zeros
    assert len(zeros) == form.n - (0 if direct else form.outputs)
    for z in zeros:
        G = C @ np.linalg.solve(z * np.eye(form.n) - A, B) + D
        gains = np.linalg.svd(G, compute_uv=False)
        near = np.linalg.svd(C @ np.linalg.solve((z + 0.1) * np.eye(form.n) - A, B) + D, compute_uv=False)
        assert gains[-1] < 1e-9 * max(gains[0], 1.0) < near[-1]
    theirs = np.atleast_1d(system.zeros())
    for z in zeros:
        assert np.min(abs(theirs - z)) < 1e-6 * max(1.0, abs(z))


def test_zeros_by_hand():
    form = Structure((2, 2), 2)
    theta = dict.fromkeys(form.names, 0.0) | {"b1.11": 2.0, "b2.11": 1.0, "b1.22": 4.0, "b2.22": -1.0}
    model = ModelMIMO(form, np.array([theta[n] for n in form.names]), np.eye(len(form.names)))
    np.testing.assert_allclose(model.zeros, [-0.5, 0.25], atol=1e-15)
    late = theta | {"b1.11": 0.0}
    model = ModelMIMO(form, np.array([late[n] for n in form.names]), np.eye(len(form.names)))
    assert np.isinf(model.zeros[0]) and model.zeros[1] == pytest.approx(0.25)
    nothing = ModelMIMO(form, np.zeros(len(form.names)), np.eye(len(form.names)))
    assert len(nothing.zeros) == 0
    with pytest.raises(dw.InputError, match="as many inputs as outputs"):
        _ = ModelMIMO(Structure((2, 1), 1), np.array(THETA), np.eye(9)).zeros


# --- which structure ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "nu, k", [((2, 1), 1), slow((1, 2), 1), ((2, 2), 2), slow((1, 1), 1), ((3, 2), 1), slow((2, 1, 1), 1)]
)
def test_the_true_structure_is_found_at_every_noise_level(nu, k):
    rng = np.random.default_rng(0)
    for seed, noise in enumerate((0.3, 0.01, 1e-6)):
        theta = theta_of(Structure(nu, k), rng)
        options = dict(inputs=k, noise_std=noise, missing=0.02 * seed, seed=seed)
        y, u = dw.models.simulate_mimo(nu, theta, samples=600, **options)
        evidence = dw.analysis.choose_structure(y, u, largest=3)
        print(nu, noise, evidence.words)
        assert evidence.best == nu
        assert len(evidence.structures) == 3 ** len(nu) and evidence.probability.sum() == pytest.approx(1)


def test_units_do_not_matter_and_notes_warn():
    y, u = record(400)
    evidence = dw.analysis.choose_structure(y, u)
    shifted = dw.analysis.choose_structure(y * [8.0, 2.0**-20], u * 1024)
    assert shifted.structures == evidence.structures
    differences = np.diff(evidence.log_evidence), np.diff(shifted.log_evidence)
    np.testing.assert_allclose(*differences, rtol=0, atol=1e-9 * abs(evidence.log_evidence).max())
    late = np.vstack([np.full((20, 2), np.nan), y]), np.vstack([np.ones((20, 1)), u])
    np.testing.assert_array_equal(dw.analysis.choose_structure(*late).log_evidence, evidence.log_evidence)
    assert evidence.notes == [] and evidence.words.startswith("structure (2, 1), odds ")
    assert "largest tried" in dw.analysis.choose_structure(y, u, largest=2).notes[0]
    few = dw.analysis.choose_structure(y[:6], u[:6])
    assert any("nearly as probable" in note for note in few.notes)
    assert list(evidence.columns()) == ["structure", "log_evidence", "probability"]
    listed = dw.analysis.choose_structure(
        y, u, structures=[(1, 1), (2, 1)], noise=dw.models.EquationError((0.01, 0.09))
    )
    assert listed.structures == [(2, 1), (1, 1)]
    est = dw.JointMIMO((2, 1), 1, noise=dw.models.EquationError((0.01, 0.09))).scaled_to(y, u)
    units = est.model.units(est.y_scale, est.u_scale)
    known = dw.JointMIMO(**{**est.options, "P0": dict(zip([*est.state_names, *est.names], 10 * units))})
    assert listed.log_evidence[0] == pytest.approx(known.loglik(known.scan(y, u).state), rel=1e-12)


def test_linked_noises_look_like_an_output_that_acts_at_once():
    """What `choose_structure` says it is bad at."""
    found = {}
    for noise in (np.eye(2), np.array([[1.0, 0.9], [0.9, 1.0]])):
        given = dw.models.NoiseCovariance(np.zeros((2, 2)), np.zeros((2, 2)), noise)
        theta = [-0.8, 0.1, 1.0, 0.1, -0.5, 1.0]
        y, u = dw.models.simulate_mimo((1, 1), theta, samples=600, inputs=1, noise=given, seed=1)
        found[noise[0, 1]] = dw.analysis.choose_structure(y, u).best
    print(found)
    assert found[0.0] == (1, 1) and Structure(found[0.9], 1).names.count("a0.21") == 1


REFUSED = {
    "y must be": lambda: dw.analysis.choose_structure(np.zeros(9)),
    "noise must be": lambda: dw.analysis.choose_structure(np.zeros((9, 2)), noise=dw.models.OutputError()),
    "more than 256": lambda: dw.analysis.choose_structure(np.zeros((9, 4)), largest=5),
    "structures is empty": lambda: dw.analysis.choose_structure(np.zeros((9, 2)), structures=[]),
    "whole numbers": lambda: dw.analysis.choose_structure(np.zeros((9, 2)), structures=[(1, 0)]),
    "lists 2 indices": lambda: dw.analysis.choose_structure(np.zeros((9, 2)), structures=[(1, 1, 1)]),
    "largest": lambda: dw.analysis.choose_structure(np.zeros((9, 2)), largest=0),
    "must be simultaneous": lambda: dw.analysis.choose_structure(np.zeros((9, 2)), np.zeros(8)),
}


@pytest.mark.parametrize("message", REFUSED)
def test_what_does_not_fit_is_refused(message):
    with pytest.raises(dw.InputError, match=message):
        REFUSED[message]()
