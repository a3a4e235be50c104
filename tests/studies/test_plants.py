"""Plants by hand and in TOML are one, their records are what was drawn, and the batch fit is the dense Gaussian's."""

import numpy as np
import pytest
from driftwise_studies.score.plants import PLANTS, draw, simulate
from driftwise_studies.score.plants.batch import Batch
from driftwise_studies.score.plants.field import Total, by_plant, worst
from driftwise_studies.score.plants.measured import one
from driftwise_studies.score.plants.physics import TINY, Plant, even, vehicle_slope
from driftwise_studies.score.plants.simulation import response, truth
from driftwise_studies.score.plants.told import is_tellable
from scipy.stats import multivariate_normal

from driftwise.models.formula_kernels import evaluate
from driftwise.models.formulas import library, read

REST = read("battery_charge").tables["rest"]
MORE = {
    "battery_two_rc": Plant(
        {}, (), lambda x, u, p: [(u[0] - x[0] / p["R1"]) / p["C1"], (u[0] - x[1] / p["R2"]) / p["C2"], 0 * x[2]],
        lambda x, u, p: [x[2] + p["R0"] * u[0] + x[0] + x[1]], even,
    ),
    "battery_charge": Plant(
        {}, (), lambda x, u, p: [u[0] / 3600 / p["capacity"], (u[0] - x[1] / p["R1"]) / p["C1"]],
        lambda x, u, p: [
            np.interp(x[0].real, *REST) + x[1] + p["R0"] * u[0]
            + 1j * x[0].imag * (np.interp(x[0].real + 1e-9, *REST) - np.interp(x[0].real, *REST)) / 1e-9
        ],
        even,
    ),
    "vehicle_grade": Plant(
        {}, (), lambda x, u, p: [*vehicle_slope(x, [u[0], x[1]], p | {"rolling": 0.01}), 0 * x[1]],
        lambda x, u, p: [x[0]], even,
    ),
}  # fmt: skip
EASY = 7  # a record of every plant


@pytest.mark.parametrize("name", library())
def test_formulas_of_the_library_are_the_plants_by_hand_with_their_derivatives(name):
    plant, hand, rng = read(name), (PLANTS | MORE)[name], np.random.default_rng(3)
    if name in PLANTS:
        assert hand.starts == {p.name: p.start for p in plant.free}
        assert hand.states == tuple((s.start, s.std) for s in plant.states)
        assert hand.walk == plant.states[-1].walk and hand.is_linear == plant.is_linear
    start = np.array([s.start for s in plant.states]), np.ones(plant.inputs), np.array([p.start for p in plant.free])
    for _ in range(5):
        x, u, theta = (v * rng.uniform(0.5, 1.5, v.size) + (v == 0) * rng.standard_normal(v.size) for v in start)
        dx, y, of_dx, of_y = evaluate(plant, x, u, theta)
        at = np.concatenate([x, u, theta])
        z = at[:, None] + 1j * TINY * np.eye(at.size)
        n, k = plant.n, plant.inputs
        parts = z[:n], z[n : n + k], dict(zip(plant.names, z[n + k :]))
        for value, slope, made in ((dx, of_dx, hand.slopes(*parts)), (y, of_y, hand.outputs(*parts))):
            made = np.array([np.broadcast_to(one, at.size) for one in made])
            assert np.allclose(value, made[:, 0].real, rtol=1e-12, atol=1e-13)
            scale = np.abs(made.imag / TINY).max(axis=1, keepdims=True)
            tolerance = 1e-6 if name == "battery_charge" else 1e-12  # its table is differenced
            assert np.all(np.abs(slope - made.imag / TINY) <= tolerance * scale)


@pytest.mark.parametrize("name", PLANTS)
def test_a_record_is_what_was_drawn_and_steps_are_exact(name):
    drawn = draw(5, name, EASY)
    again, other = draw(5, name, EASY), draw(6, name, EASY)
    assert np.array_equal(drawn.u, again.u) and not np.array_equal(drawn.theta, other.theta)
    few = slice(0, 60)
    exact, path = truth(drawn.plant, drawn.theta, drawn.x0, drawn.t[few], drawn.u[few])
    quick, end = response(drawn.plant, drawn.theta[:, None], drawn.x0[:, None], drawn.t[few], drawn.u[few], drawn.fast)
    (quiet, noise), (jumped, _) = simulate(drawn), simulate(drawn, jumps=True)
    assert np.all(np.abs(exact - quick[:, :, 0]) < 1e-2 * noise)
    assert np.allclose(path[-1], end[:, 0], rtol=1e-5, atol=1e-5 * np.abs(path[-1]).max())
    assert np.array_equal(quiet[: drawn.at], jumped[: drawn.at], equal_nan=True)
    ratio = drawn.after / drawn.theta
    assert np.sum(ratio != 1) == 1 and max(ratio[drawn.which], 1 / ratio[drawn.which]) == pytest.approx(1.3)
    off = np.nanstd(quiet[few] - exact, axis=0) / noise
    assert np.all(np.abs(off - 1) < (0.6 if drawn.plant.walk else 0.35))


def test_all_ways_of_driving_are_drawn_between_their_levels():
    for name in ("battery", "tank"):
        for number in range(12):
            drawn = draw(1, name, number)
            assert drawn.u.shape == (600, 1) and np.all(np.diff(drawn.t) > 0) and np.ptp(drawn.u) > 0
    assert {len(np.unique(draw(1, "battery", n).u)) == 2 for n in range(12)} == {True, False}


def test_the_log_posterior_of_the_batch_is_that_of_the_dense_gaussian():
    drawn = draw(5, "battery", EASY)
    y, _ = simulate(drawn)
    batch = Batch(drawn, y)
    there, fits, direct = batch.there[:, 0], [], []
    for factor in (1.0, 1.02):
        theta = drawn.theta * np.array([factor, 1.0, 1.0])
        fits.append(batch.posterior(np.log(theta)))
        start, std = np.array(drawn.plant.states).T
        basis = [truth(drawn.plant, theta, start + d, drawn.t, drawn.u)[0][there, 0] for d in np.eye(3)[:, :2]]
        S = np.column_stack([one - basis[2] for one in basis[:2]])
        t = drawn.t[there]
        V = S * std**2 @ S.T + 1e-10 * np.minimum.outer(t, t) + fits[-1].noise[0] ** 2 * np.eye(len(t))
        prior = -0.5 * np.sum(((np.log(theta) - batch.mean[:3]) / batch.spread[:3]) ** 2)
        direct.append(multivariate_normal(basis[2], V).logpdf(batch.y[0]) + prior)
    assert fits[1].value - fits[0].value == pytest.approx(direct[1] - direct[0], abs=1e-5)


def test_a_batch_fit_from_the_prior_ends_where_one_from_the_truth_does_and_near_it():
    for name in ("battery", "tank", "mass_spring_damper"):
        drawn = draw(5, name, EASY)
        y, noise = simulate(drawn)
        batch, true = Batch(drawn, y), np.log(drawn.theta)
        fits = [batch.fit([start]) for start in (true, batch.mean[: batch.m])]
        assert fits[1].value == pytest.approx(fits[0].value, abs=1e-3)
        assert np.all(np.abs(fits[0].eta - true) < 4 * batch.bound(noise))
        assert np.allclose(np.sqrt(np.diag(fits[0].covariance))[: batch.m], batch.bound(noise), rtol=0.3)


def test_a_jump_is_tellable_by_its_size_in_noise():
    drawn = draw(5, "battery", EASY)
    drawn = drawn._replace(which=0, after=drawn.theta * np.array([1.3, 1.0, 1.0]))
    for noise, tellable in ((1e-3, True), (100.0, False)):
        loud = drawn._replace(noise=noise)
        y, deviation = simulate(loud, jumps=True)
        assert is_tellable(loud, y, deviation) is tellable
    y, deviation = simulate(drawn)
    assert not is_tellable(drawn, y, deviation)


def test_a_battery_is_judged_and_tables_say_so():
    found = [one((0, "battery", 1))]
    total = Total(found)
    assert total.converged == 1.0 and found[0].is_tellable and found[0].is_dated and not found[0].false
    assert np.all(np.abs(found[0].error) < 4) and np.all(np.abs(found[0].error - found[0].batch_error) < 0.5)
    assert by_plant(found).count("\n") == 4 and "battery 1" in worst(found, 1)
