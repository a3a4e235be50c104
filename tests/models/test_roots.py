"""Poles, zeros and gains of an uncertain model: Jacobians, what sampling says, and where there is no answer."""

import numpy as np
import pytest
import scipy.stats

import driftwise as dw
from driftwise.models.canonical import Canonical

RNG = np.random.default_rng
DRAWS = 200_000


def model(poles, b=(), P=1e-12, inputs=0, direct=False, dt=1.0):
    a = np.real(np.poly(poles))[1:]
    theta = np.concatenate([a, np.ravel(b)])
    return dw.models.Model(
        Canonical(len(a), inputs, direct), theta, P * np.eye(len(theta)) if np.ndim(P) == 0 else P, dt
    )


def quadratic(c):
    """Roots (S, 2) of c0 z^2 + c1 z + c2 by the formula."""
    root = np.sqrt(c[:, 1] ** 2 - 4 * c[:, 0] * c[:, 2] + 0j)
    return np.stack([-c[:, 1] - root, -c[:, 1] + root], axis=1) / (2 * c[:, :1])


def second_moment(q, p):
    """Second moment (2, 2, 2) of sampled pairs q (S, 2) about p (2,), each pair assigned the nearer way round."""
    straight, crossed = (np.sum(abs(v - p) ** 2, axis=1) for v in (q, q[:, ::-1]))
    tie = np.isclose(straight, crossed, rtol=1e-9)
    first = np.where(tie, np.arange(len(q)) % 2 == 0, straight < crossed)
    e = np.where(first[:, None], q, q[:, ::-1]) - p
    e = np.stack([e.real, e.imag], axis=-1)
    return np.einsum("sia,sib->iab", e, e) / len(q)


CASES = [
    ([0.9, 0.5, -0.3, 0.1], [1.0, 0.5, -0.4, 0.2], 1, False),
    ([0.7 + 0.4j, 0.7 - 0.4j, 0.2], [[1.0, -0.5, 0.3], [0.3, 0.9, 0.2], [0.1, -0.6, np.nan]], 2, True),
]


@pytest.mark.parametrize("poles, b, inputs, direct", CASES)
def test_jacobians_are_finite_differences(poles, b, inputs, direct):
    b = np.ravel(b)[np.isfinite(np.ravel(b))]
    theta = np.concatenate([np.real(np.poly(poles))[1:], b])
    m, w, h = len(theta), np.array([0.0, 0.3, 1.1, 3.0]), 1e-6

    def of(theta):
        """Poles, zeros of each input, responses: by NumPy on the polynomials."""
        n = len(poles)
        B = theta[n : n * (inputs + 1)].reshape(inputs, n)
        B = np.column_stack([theta[n * (inputs + 1) :], B]) if direct else B
        z = np.exp(1j * w * 0.5)
        lags = z[:, None] ** -(np.arange(n + 1.0) if direct else np.arange(1.0, n + 1))
        G = (B @ lags.T) / (1 + theta[:n] @ (z[:, None] ** -np.arange(1.0, n + 1)).T)
        return [np.sort_complex(np.roots(c)) for c in (np.append(1, theta[:n]), *B)] + list(G)

    for j in range(m):
        step = h * np.eye(m)[j]
        slopes = [(p - q) / (2 * h) for p, q in zip(of(theta + step), of(theta - step))]
        P = np.zeros((m, m))
        P[j, j] = 1e-14
        mod = dw.models.Model(Canonical(len(poles), inputs, direct), theta, P, 0.5)
        found = [(mod.poles, mod.poles_covariance)]
        found += [(mod.zeros(i), mod.zeros_covariance(i)) for i in range(inputs)]
        for (p, C), slope in zip(found, slopes):
            J = np.stack([slope.real, slope.imag], axis=1)
            expected = J[:, :, None] * J[:, None, :] * 1e-14
            C = C[np.lexsort((p.imag, p.real))]
            np.testing.assert_allclose(C, expected, atol=1e-6 * 1e-14 * (1 + np.max(abs(slope)) ** 2))
        assert set(mod.method) == {"first order"}
        assert mod.notes == []
        G, C = mod.frequency_response(w)
        for i in range(inputs):
            slope = slopes[1 + inputs + i]
            np.testing.assert_allclose(G[i], of(theta)[1 + inputs + i], rtol=1e-12)
            J = np.stack([slope.real, slope.imag], axis=1)
            np.testing.assert_allclose(C[i], J[:, :, None] * J[:, None, :] * 1e-14, atol=1e-21)
            assert mod.dc_gain_std[i] == pytest.approx(1e-7 * abs(slope[0]), rel=1e-5, abs=1e-13)


def test_first_order_agrees_with_200_000_draws_where_poles_lie_apart():
    """The size of agreement known from the theory: variances within a few percent."""
    rng = RNG(1)
    L = rng.standard_normal((4, 4)) * 0.006
    m = model([0.8 + 0.3j, 0.8 - 0.3j], [1.0, -0.4], L @ L.T, inputs=1)
    assert m.method == ["first order"] * 2
    draws = m.values + rng.standard_normal((DRAWS, 4)) @ L.T
    sampled = second_moment(quadratic(np.insert(draws[:, :2], 0, 1, axis=1)), m.poles)
    print("pole variance, first order and sampled:", np.trace(m.poles_covariance[0]), np.trace(sampled[0]))
    np.testing.assert_allclose(m.poles_covariance, sampled, atol=0.03 * np.trace(sampled[0]))
    zero = -draws[:, 3] / draws[:, 2]
    assert m.zeros_std()[0] ** 2 == pytest.approx(np.mean((zero - 0.4) ** 2), rel=0.05)
    z = np.exp(1j * 0.35)
    g = (draws[:, 2] / z + draws[:, 3] / z**2) / (1 + draws[:, 0] / z + draws[:, 1] / z**2)
    G, C = m.frequency_response([0.35])
    e = g - G[0, 0]
    sampled = np.array([[np.mean(e.real**2), np.mean(e.real * e.imag)], [0, np.mean(e.imag**2)]])
    sampled[1, 0] = sampled[0, 1]
    print("response variance, first order and sampled:", np.trace(C[0, 0]), np.trace(sampled))
    np.testing.assert_allclose(C[0, 0], sampled, atol=0.08 * np.trace(sampled))


@pytest.mark.parametrize("shape", ["real", "pair"])
def test_first_order_fails_where_roots_meet_and_sampling_takes_over(shape):
    """Root std over distance against the ratio of sampled to first-order variance: the measured criterion."""
    half, table = 0.1 if shape == "real" else 0.1j, {}
    p = np.array([0.5 + half, 0.5 - half])
    for ratio in (0.03, 0.049, 0.1, 0.2, 0.5, 1.0, 5.0):
        s = ratio * 0.2 * 0.2 / np.sqrt(abs(p[0]) ** 2 + 1)
        m = model(p, P=s * s)
        c = m.values + s * RNG(2).standard_normal((DRAWS, 2))
        sampled = second_moment(quadratic(np.insert(c, 0, 1, axis=1)), m.poles)
        first = (ratio * 0.2) ** 2
        table[ratio] = np.trace(sampled[0]) / first
        # 8192 draws of a law with tails: two percent standard error, hence 8 %
        rel = 0.08 if ratio >= 0.05 else 0.05
        np.testing.assert_allclose(m.poles_std**2, np.trace(sampled, axis1=1, axis2=2), rtol=rel)
        assert m.method == (["sampled"] * 2 if ratio >= 0.05 else ["first order"] * 2)
    print(shape, "sampled / first-order variance by std / distance:", {k: round(v, 3) for k, v in table.items()})
    assert table[0.03] == pytest.approx(1, abs=0.03)
    assert table[0.049] < 1.06
    assert table[0.1] > 1.15
    assert table[5.0] < 0.5


def test_assignment_is_the_cheapest():
    from scipy.optimize import linear_sum_assignment

    from driftwise.models.roots import _assignment

    rng = RNG(9)
    for n in (2, 3, 5):
        p, q = (rng.standard_normal((400, n)) + 1j * rng.standard_normal((400, n)) for _ in range(2))
        cost = abs(p[:, :, None] - (p + 0.3 * q)[:, None, ::-1]) ** 2
        found = np.take_along_axis(cost, _assignment(cost)[:, :, None], axis=2).sum(axis=(1, 2))
        best = np.array([c[linear_sum_assignment(c)].sum() for c in cost])
        assert np.mean(found > best * (1 + 1e-12)) < (0.005 if n > 2 else 1e-9)
        assert found.sum() < 1.01 * best.sum()  # swaps of two miss a round of three now and then; the draws err by 2 %


def test_notes_name_the_poles_that_meet():
    m = model([0.9, 0.5, 0.499], P=1e-8)
    assert m.method == ["first order", "sampled", "sampled"]
    assert m.notes == ["poles 2 and 3 nearly coincide: sampled"]
    assert np.all(m.poles_std[1:] < 0.03)
    assert 1e-4 * 0.5**2 / (0.001 * 0.4) > 0.06  # what first order says, even of one coefficient alone
    again = model([0.9, 0.5, 0.499], P=1e-8)
    assert np.array_equal(m.poles_covariance, again.poles_covariance)


def test_exactly_double_poles_have_finite_bars_of_the_root_of_the_noise():
    for poles in ([0.5, 0.5], [0.0, 0.0], [0.6, 0.6, 0.6]):
        m = model(poles, P=1e-8)
        n = len(poles)
        assert np.isfinite(m.poles_std).all()
        # (z - p)^n = noise: the roots lie about noise^(1/n) away
        assert np.all((m.poles_std > 0.2 * 1e-4 ** (1 / n)) & (m.poles_std < 3 * 1e-4 ** (1 / n)))
    known = model([0.5, 0.5], P=0.0)
    np.testing.assert_allclose(known.poles_std, 0, atol=1e-6)


def test_a_conjugate_pair_keeps_mirrored_bars():
    m = model([0.8 + 0.01j, 0.8 - 0.01j, 0.2], P=1e-5)
    low, high = m.poles_covariance[:2]
    assert m.poles[0] == m.poles[1].conjugate()
    np.testing.assert_array_equal(low, high * [[1, -1], [-1, 1]])
    assert m.notes[0].startswith("poles 1 and 2 nearly coincide")
    assert m.poles_covariance[2, 1, 1] == 0.0  # the real one stays real


def test_zeros_of_each_input_and_their_number():
    theta = np.r_[np.poly([0.5, 0.2, 0.1])[1:], 1, -0.3, 0.02, 2, 0, -0.5]
    m = dw.models.Model(Canonical(3, 2), theta, 1e-10 * np.eye(9))
    np.testing.assert_allclose(m.zeros(0), [0.2, 0.1], atol=1e-12)
    np.testing.assert_allclose(abs(m.zeros(1)), [0.5, 0.5], atol=1e-12)
    assert dw.models.Model(Canonical(1, 1), np.array([-0.5, 1.0]), np.eye(2)).zeros().shape == (0,)
    for wrong in (2, -1, 0.5, True):
        with pytest.raises(dw.InputError, match="input must be one of 0 to 1"):
            m.zeros(wrong)


def test_zeros_put_at_0_by_the_orders_are_certain():
    found = model([0.5, 0.4, 0.3], [2.0, 0.0, 0.0], np.diag([1e-4, 1e-4, 1e-4, 1e-2, 0.0, 0.0]), inputs=1)
    assert np.array_equal(found.zeros(), [0, 0]) and np.array_equal(found.zeros_std(), [0, 0])
    assert not any("zero" in note for note in found.notes)


def test_a_zero_that_may_lie_at_infinity_says_so():
    a = [0.5, 0.3, 0.2]
    m = model(a, [0.01, 1.0, -0.4], 1e-4, inputs=1)  # b1 = one std
    assert np.isinf(m.zeros_std()[0])
    assert m.zeros()[1] == pytest.approx(0.3984, abs=1e-3)
    assert m.zeros_std()[1] == pytest.approx(0.0108, rel=0.05)  # of 0.4 = -b3/b2: hypot(1, .4) std, plus b1's part
    assert "b1 (0.01 ± 0.01) cannot be told from 0: the largest zero may lie at infinity" in m.notes
    nothing = model(a, [0.0, 1.0, -0.4], np.diag([1e-4] * 3 + [0.0, 1e-4, 1e-4]), inputs=1)  # known to be zero
    assert nothing.zeros().tolist() == [np.inf, 0.4]
    assert not [note for note in nothing.notes if "zero" in note]
    empty = model(a, [0.0, 0.0, 0.0], 1e-4, inputs=1)
    assert np.isinf(empty.zeros_std()).all()
    assert "the 2 largest zeros may lie" in " ".join(empty.notes)
    rough = model([0.5, 0.2], [1.0, -0.4], np.diag([0, 0, 0.15**2, 0.15**2]), inputs=1)
    draws = np.array([1.0, -0.4]) + 0.15 * RNG(3).standard_normal((DRAWS, 2))
    assert "b1 is known to 15 % only" in rough.notes[0]
    assert rough.zeros_std()[0] == pytest.approx(np.sqrt(np.mean((-draws[:, 1] / draws[:, 0] - 0.4) ** 2)), rel=0.1)


def test_gain_near_an_integrator_has_no_std():
    m = model([0.999, 0.5], [1.0, 0.5], 1e-4, inputs=1)
    assert np.isinf(m.dc_gain_std[0])
    assert m.dc_gain_interval()[0].tolist() == [-np.inf, np.inf]
    assert "A(1) = 0.0005 ± 0.014 cannot be told from 0" in m.notes[-1]
    _, C = m.frequency_response([0.0, 2.0])
    assert np.isinf(C[0, 0]).any() and np.isfinite(C[0, 1]).all()
    exact = dw.models.Model(Canonical(1, 1), np.array([-1.0, 1.0]), np.zeros((2, 2)))
    assert np.isinf(exact.dc_gain[0]) and np.isinf(exact.dc_gain_std[0])
    near = model([0.9], [0.1], np.diag([1.5e-2, 1e-6]) ** 2, inputs=1)  # A(1) is 6.7 std from zero: sampled
    draws = 0.1 / (0.1 + 1.5e-2 * RNG(4).standard_normal(DRAWS))
    assert near.dc_gain_std[0] == pytest.approx(np.sqrt(np.mean((draws - 1) ** 2)), rel=0.05)


@pytest.mark.parametrize("pole", [0.5, 0.97, 0.999])
def test_fieller_interval_covers_as_promised(pole):
    """2000 estimates; 95 % within four binomial standard errors (0.0195), at the integrator at least that."""
    truth = np.array([-pole, 1.0])
    P = np.array([[4e-4, -1e-4], [-1e-4, 4e-4]])
    draws = RNG(5).multivariate_normal(truth, P, 2000)
    gain, hit = 1.0 / (1 - pole), 0
    for theta in draws:
        low, high = dw.models.Model(Canonical(1, 1), theta, P).dc_gain_interval()[0]
        hit += low <= gain <= high
    assert hit / 2000 > 0.95 - 0.0195
    if pole == 0.5:
        assert hit / 2000 < 0.95 + 0.0195


def test_ellipse_holds_its_level():
    C = np.array([[2.0, 0.9], [0.9, 0.7]])
    e = dw.models.confidence_ellipse(C, 0.9, centre=1 - 2j)
    d = e.points() - [1, -2]
    np.testing.assert_allclose(np.einsum("ti,ij,tj->t", d, np.linalg.inv(C), d), scipy.stats.chi2.ppf(0.9, 2))
    assert e.semi_axes[0] == pytest.approx(np.max(np.hypot(*d.T)), rel=1e-3)
    k = np.argmax(np.hypot(*d.T))
    assert np.tan(e.angle) == pytest.approx(d[k, 1] / d[k, 0], rel=0.05)
    flat = dw.models.confidence_ellipse([[4.0, 0], [0, 0]], 0.95, centre=(0.5, 0))
    assert flat.semi_axes == (pytest.approx(2 * scipy.stats.norm.ppf(0.975)), 0.0)
    assert dw.models.confidence_ellipse(np.diag([np.inf, np.inf])).semi_axes == (np.inf, np.inf)
    for bad, level in (([[1, 2], [2, 1]], 0.95), (np.eye(3), 0.95), (np.eye(2), 95)):
        with pytest.raises(dw.InputError):
            dw.models.confidence_ellipse(bad, level)


def test_nothing_known_is_infinite_not_nan():
    m = dw.models.Model(Canonical(2, 1), np.array([-1.5, 0.7, 1.0, 0.5]), np.full((4, 4), np.inf))
    assert np.isinf(m.poles_std).all() and np.isinf(m.zeros_std()).all()
    assert np.isinf(m.dc_gain_std).all()
    assert "nothing is known of the poles yet" in m.notes


def apart(m, draws):
    """Parts of all poles over draws of the parameters (S, 2 n), each root of a draw beside the nearest of ours."""
    n, found = len(m.poles), np.empty((len(draws), 2 * len(m.poles)))
    for row, theta in zip(found, draws):
        q = list(np.roots(np.append(1, theta[:n])))
        for i, p in enumerate(m.poles):
            nearest = q.pop(int(np.argmin(abs(np.array(q) - p))))
            row[2 * i : 2 * i + 2] = nearest.real, nearest.imag
    return found


@pytest.mark.parametrize("poles", [[0.9, 0.5, -0.3], [0.7 + 0.4j, 0.7 - 0.4j, 0.2]])
def test_poles_vary_together_as_draws_do(poles):
    n = len(poles)
    root = RNG(4).standard_normal((n, n)) * 1e-3
    m = model(poles, P=root @ root.T)
    found = m.poles_joint_covariance
    drawn = np.cov(apart(m, RNG(5).multivariate_normal(m.values, m.covariance, 6_000)).T)
    size = np.sqrt(np.diag(drawn)) + 1e-12
    # a covariance of 6000 draws has a standard error of 1/77 of the product of deviations; second order adds some
    np.testing.assert_allclose(found / np.outer(size, size), drawn / np.outer(size, size), atol=0.05)
    blocks = found.reshape(n, 2, n, 2)[np.arange(n), :, np.arange(n)]
    np.testing.assert_allclose(blocks, m.poles_covariance, rtol=1e-9)
    assert np.linalg.eigvalsh(found).min() > -1e-12 * np.trace(found)


def test_a_conjugate_pair_moves_as_one():
    found = model([0.7 + 0.4j, 0.7 - 0.4j], P=1e-6).poles_joint_covariance
    np.testing.assert_allclose(found[:2, 2:], found[:2, :2] * [1, -1], rtol=1e-9)


def test_the_difference_of_two_poles_needs_what_they_share():
    """a1 = -(p + q), a2 = p q: where only a2 is uncertain the sum of the poles is certain, each of them is not."""
    m = model([0.9, 0.5], P=np.diag([0.0, 1e-6]))
    J = np.array([1.0, 0.0, 1.0, 0.0])
    assert J @ m.poles_joint_covariance @ J < 1e-20 and m.poles_std.min() > 1e-3


def test_sampled_poles_vary_together_too():
    m = model([0.72, 0.7], P=1e-6)
    assert "sampled" in m.method
    joint = m.poles_joint_covariance.reshape(2, 2, 2, 2)
    np.testing.assert_allclose(joint[[0, 1], :, [0, 1]], m.poles_covariance, rtol=1e-9)
    draws = RNG(6).multivariate_normal(m.values, m.covariance, 100_000)
    total = -draws[:, 0] - sum(m.poles.real)  # whichever is which, their sum is -a1
    J = np.array([1.0, 0.0, 1.0, 0.0])
    assert J @ m.poles_joint_covariance @ J == pytest.approx(np.mean(total**2), rel=0.05)


def test_poles_of_which_nothing_is_known_share_what_nobody_knows():
    m = dw.models.Model(Canonical(2), np.array([-1.4, 0.45]), np.full((2, 2), np.inf))
    assert np.isinf(np.diag(m.poles_joint_covariance)).all()


def test_other_models_have_it_too():
    y, u = dw.simulate([-1.2, 0.5], [1.0, 0.5], samples=400, noise_std=0.2, seed=1)
    for est in (dw.OE(2, 2), dw.BJ(1, 1, 1, 1), dw.ARMAX(2, 2, 1)):
        m = est.scan(y, u).model()
        n = len(m.poles)
        joint = m.poles_joint_covariance.reshape(n, 2, n, 2)
        np.testing.assert_allclose(joint[np.arange(n), :, np.arange(n)], m.poles_covariance, rtol=1e-6, atol=1e-15)
    several = dw.ARXMIMO(2, 0, na=1, nb=0).scan(np.column_stack([y, RNG(2).standard_normal(400)])).model()
    assert several.poles_joint_covariance.shape == (2 * len(several.poles),) * 2
    joint = several.poles_joint_covariance.reshape(2, 2, 2, 2)
    np.testing.assert_allclose(joint[[0, 1], :, [0, 1]], several.poles_covariance, rtol=1e-9)
    slow = dw.ContinuousJoint(2, inputs=1, dt=0.1).scan(y, u).model()
    joint = slow.poles_joint_covariance.reshape(2, 2, 2, 2)
    np.testing.assert_allclose(joint[[0, 1], :, [0, 1]], slow.poles_covariance, rtol=1e-9)


@pytest.mark.parametrize("unit", [2.0**-200, 2.0**30, 2.0**200])
def test_sampled_poles_do_not_depend_on_the_unit_of_the_input(unit):
    P = 1e-4 * (np.ones((4, 4)) + np.diag([3.0, 4.0, 9.0, 8.0]))
    scale = np.array([1.0, 1.0, unit, unit])
    b = np.array([1.0, 0.5])
    one, other = model([0.8, 0.75], b, P, 1), model([0.8, 0.75], unit * b, P * np.outer(scale, scale), 1)
    assert one.method == ["sampled", "sampled"]
    assert np.allclose(one.poles_std, other.poles_std, rtol=1e-9)
    assert np.allclose(one.samples, other.samples / scale)
