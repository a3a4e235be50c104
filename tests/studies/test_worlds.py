"""Systems that nobody chose are what they say; who is told everything is a dense Kalman filter; judging appends."""

import numpy as np
import pytest
from drawn_worlds import DRAWN
from driftwise_studies.score import worlds
from driftwise_studies.score.worlds import attainable, ceiling, told, untold
from driftwise_studies.score.worlds.simulation import QUIET, drawn, escapes
from driftwise_studies.score.worlds.system import ALONE, RADIUS, System, changed, is_stable

FEW = DRAWN[:36]


def of(trouble):
    """Return the systems that have a trouble."""
    return [system for system in DRAWN if trouble in system.troubles]


# --- systems -----------------------------------------------------------------------------------------------


def test_a_system_and_a_record_depend_on_their_seeds_alone():
    assert worlds.draw(0, 7) == DRAWN[7] and worlds.draw(1, 7) != DRAWN[7]
    for system in FEW:
        many, alone = worlds.records(system, range(3), 400), worlds.record(system, 2, 400)
        for name, value in many.__dict__.items():
            np.testing.assert_array_equal(value[2:], getattr(alone, name), err_msg=f"{name} of {system.about}")


def test_what_is_drawn_is_what_was_asked_for():
    assert [DRAWN[3 * i].troubles for i in range(len(ALONE))] == [
        (name,) if not (name == "walk some" and len(DRAWN[3 * i].theta) == 1) else ("walk all",)
        for i, name in enumerate(ALONE)
    ]
    assert all(len(of(name)) >= 20 for name in ALONE[1:])
    together = [system for system in DRAWN if system.number % 3]
    assert min(len(system.troubles) for system in together) >= 2
    nvr = np.array([v for system in DRAWN for v in system.nvr if v])
    sizes = np.array([size for system in DRAWN for size, _ in system.jumps])
    assert 1e-6 <= nvr.min() < 3e-6 and 3e-3 < nvr.max() <= 1e-2
    assert sizes.max() <= 8 and np.mean(sizes < 0.5) < 0.05  # smaller only where the plant bears no more
    assert all(1.5 <= max(f, 1 / f) <= 10 for system in DRAWN for f in system.steps)
    assert {system.na for system in DRAWN} == {-1, 1, 2, 3, 4} and {len(system.nb) for system in DRAWN} >= {0, 1, 2, 3}


def test_the_plant_is_stable_at_all_times():
    for system in FEW:
        r = worlds.records(system, range(4))
        assert np.nanmax(np.abs(r.y)) < 1e3 and np.isfinite(r.u).all()
        for theta in r.theta[:, ::50].reshape(-1, len(system.theta)) if system.na > 0 else ():
            assert max(abs(np.roots([1.0, *theta[: system.na]]))) < RADIUS + 1e-6


def test_a_record_whose_loop_loses_its_grip_is_drawn_anew():
    """A loop that holds the last output where it is missing is not the frozen loop, whose poles are inside."""
    system, seeds = DRAWN[164], range(12)
    raw, found = drawn(system, [[seed, system.number, 22] for seed in seeds], 2000), worlds.records(system, seeds)
    lost = escapes(raw.y)
    assert 0 < lost.sum() < 12 and not escapes(found.y).any()
    np.testing.assert_array_equal(found.y[~lost], raw.y[~lost])
    assert (found.theta[lost] != raw.theta[lost]).any(axis=(1, 2)).all()
    np.testing.assert_array_equal(found.y[lost][0], worlds.record(system, int(np.flatnonzero(lost)[0])).y[0])


def test_schur_cohn_finds_what_roots_find():
    a = np.random.default_rng(1).uniform(-1, 1, (500, 4)) * [2.0, 1.5, 1.0, 0.5]
    by_roots = [max(abs(np.roots([1.0, *one]))) < 0.9 for one in a]
    assert is_stable(a, 0.9).tolist() == by_roots and 50 < sum(by_roots) < 450


def test_outputs_are_those_of_the_equation():
    for system in FEW:
        r = worlds.records(system, range(2))
        psi = worlds.regressors(system, r.y, r.u)
        lags = max([1, system.na, *system.nb])
        dirty = np.isnan(r.y) | r.outliers
        clean = ~np.any([np.roll(dirty, lag, axis=1) for lag in range(lags + 1)], axis=0)
        clean[:, :lags] = False
        e = ((r.y - np.einsum("stn,stn->st", psi, r.theta)) / r.sigma)[clean]
        assert abs(e.std() - 1) < 5 / np.sqrt(2 * e.size) and abs(e.mean()) < 5 / np.sqrt(e.size), system.about


def test_outliers_of_the_process_are_what_the_next_outputs_go_on_from():
    """A third of the plants with outliers; nothing but the kind is drawn anew, and e alone is off."""
    plants = [system for system in of("outliers") if system.na > 0]
    felt = [system for system in plants if system.of_process]
    assert 0.2 < len(felt) / len(plants) < 0.47
    assert not any(system.of_process for system in DRAWN if system not in plants)
    for system in felt[:6]:
        r, other = worlds.records(system, range(2)), worlds.records(changed(system, of_process=False), range(2))
        np.testing.assert_array_equal(r.outliers, other.outliers)
        np.testing.assert_array_equal(r.theta, other.theta)
        e = (r.y - np.einsum("stn,stn->st", worlds.regressors(system, r.y, r.u), r.theta)) / r.sigma
        e[:, : max([system.na, *system.nb])] = np.nan
        off = np.abs(e[r.outliers & np.isfinite(e)])
        share, size = system.outliers
        assert np.all((off > 0.7 * size - 5) & (off < 1.3 * size + 5)) and len(off) > 0.4 * share * e.size
        clean = e[~r.outliers & np.isfinite(e)]
        assert abs(clean.std() - 1) < 5 / np.sqrt(2 * clean.size), system.about


def test_parameters_walk_and_jump_as_said():
    for system in of("walk all")[:4]:
        if system.jumps:
            continue
        r = worlds.records(system, range(4))
        step = np.diff(r.theta, axis=1) / np.array(system.deviations)
        free = np.any(step != 0, axis=2)  # a step that leaves what is stable is not taken
        found = (step[free] ** 2).mean(axis=0)
        np.testing.assert_allclose(found, system.nvr, rtol=6 * np.sqrt(2 / free.sum()) + 0.1 * (free.mean() < 1))
    for system in [system for system in of("jumps") if not system.nvr][:6]:
        r = worlds.records(system, range(4))
        for s, j in np.ndindex(r.jumps.shape):
            k = r.jumps[s, j]
            np.testing.assert_allclose(r.theta[s, k] - r.theta[s, k - 1], r.moved[s, j], atol=1e-12)
            size, who = system.jumps[j]
            said = np.isin(np.arange(len(system.theta)), who) * size
            went = np.abs(r.moved[s, j]) / system.deviations
            shares = went[said > 0] / said[said > 0]
            assert (went[said == 0] == 0).all() and np.allclose(np.log2(shares), np.round(np.log2(shares[0])))
        assert np.all(np.diff(r.theta, axis=1).any(axis=2).sum(axis=1) == len(system.jumps))


def test_noise_outliers_rests_and_gaps_are_as_many_as_said():
    for system in of("outliers")[:5] + of("missing")[:5] + of("rest")[:5] + of("louder")[:5]:
        r = worlds.records(system, range(20))
        share, length = system.missing
        assert abs(np.isnan(r.y).mean() - share) < 5 * np.sqrt(max(share, 1e-9) * length * 2 / r.y.size)
        share = system.outliers[0]
        assert abs(r.outliers.mean() - share) < 5 * np.sqrt(max(share, 1e-9) / r.y.size)
        levels = np.unique(np.round(r.sigma / system.sigma, 9))
        steps = np.round(np.cumprod([1.0, *system.steps]), 9)
        rests = np.round(QUIET * steps, 9) if system.rest[1] else []
        assert set(np.unique(steps)) <= set(levels) <= set(steps) | set(rests)
        if system.rest[0] and system.input[0] != "closed loop" and system.nb:
            assert np.all((r.u == 0).all(axis=2).sum(axis=1) >= system.rest[0])


def test_inputs_are_coloured_quantised_and_in_a_loop():
    for system in of("coloured")[:3] + of("quantised")[:3]:
        if system.rest[0]:
            continue
        u = worlds.records(system, range(30)).u
        if system.input[0] == "quantised":
            assert len(np.unique(u)) == system.input[1]
        else:
            found = np.mean(u[:, 1:] * u[:, :-1]) / np.mean(u**2)
            assert abs(found - system.input[1]) < 0.05
    loop = of("closed loop")[0]
    opened = changed(loop, input=("white", 0.0))
    one, other = worlds.record(loop, 1), worlds.record(opened, 1)
    y = np.concatenate([[[0.0]], one.y], axis=1)[:, 1:]
    if not np.isnan(y).any():
        np.testing.assert_allclose(one.u[..., 0] - other.u[..., 0], -loop.input[1] * y, atol=1e-9)


# --- references --------------------------------------------------------------------------------------------


def dense(y, psi, sigma, q, P0):
    """Return filtered theta, innovations and their variances of the textbook's Kalman filter; q[k] is added after k."""
    theta, P, paths, seen = np.zeros(psi.shape[1]), np.diag(P0), [], []
    for k in range(len(y)):
        S = psi[k] @ P @ psi[k] + sigma[k] ** 2
        e = y[k] - psi[k] @ theta
        if np.isfinite(e):
            gain = P @ psi[k] / S
            theta, P = theta + gain * e, P - np.outer(gain, psi[k] @ P)
        paths.append(theta)
        seen.append((e, S))
        P = P + np.diag(q[k])
    return np.array(paths), np.array(seen).T


REGRESSION = System(
    5, -1, (1, 1), (1.0, -0.5), 0.3, (0.3, 0.3), ("white", 0.0), nvr=(1e-3, 0.0), jumps=((3.0, (1,)),),
    steps=(4.0, 0.25), outliers=(0.03, 15.0), missing=(0.1, 1),
)  # fmt: skip


def test_the_filter_that_is_told_is_the_dense_one():
    r = worlds.record(REGRESSION, 3, 900)
    y, q = np.where(r.outliers, np.nan, r.y)[0], told.walk(REGRESSION, 900)
    theta, *_ = told.follow(REGRESSION, y, r.u[0], r.sigma[0], q)
    expected, _ = dense(y, r.u[0], r.sigma[0], q, [told.WIDE, told.WIDE])
    np.testing.assert_allclose(theta, expected, rtol=1e-7, atol=1e-9)


def test_who_is_told_of_outliers_of_the_process_takes_them_for_loud_samples():
    system = next(s for s in of("outliers") if s.of_process and s.rests and not s.missing[0])
    r = worlds.record(system, 3, 600)
    known, sigma = told.without_outliers(system, r)
    np.testing.assert_array_equal(known, r.y)
    np.testing.assert_allclose(sigma[r.outliers] / r.sigma[r.outliers], np.hypot(1.0, system.outliers[1]))
    psi, first = worlds.regressors(system, r.y, r.u)[0], max([system.na, *system.nb])
    prior = told.WIDE * np.maximum(np.array(system.deviations) ** 2, 1.0)
    y = np.where(np.arange(600) < first, np.nan, r.y[0])
    expected, _ = dense(y, psi, sigma[0], told.walk(system, 600), prior)
    theta, *_ = told.follow(system, known[0], r.u[0], sigma[0], told.walk(system, 600))
    np.testing.assert_allclose(theta[first:], expected[first:], rtol=1e-6, atol=1e-8)


def test_the_oracle_is_told_the_jump_and_says_whether_it_could_have_told_it():
    found = []
    for size in (0.3, 3.0):
        system = changed(REGRESSION, jumps=((size, (1,)),))
        for seed in range(6):
            r = worlds.record(system, seed, 900)
            y, q, k = np.where(r.outliers, np.nan, r.y)[0], told.walk(system, 900), r.jumps[0, 0]
            theta, can = told.oracle(system, y, r.u[0], r.sigma[0], r.jumps[0], r.moved[0], q)
            jumping = q.copy()
            jumping[k - 1] += r.moved[0, 0] ** 2
            expected, (e, v) = dense(y, r.u[0], r.sigma[0], jumping, [told.WIDE] * 2)
            _, (e0, v0) = dense(y, r.u[0], r.sigma[0], q, [told.WIDE] * 2)
            odds = np.nancumsum((0.5 * (np.log(v0 / v) + e0**2 / v0 - e**2 / v))[k : k + told.SOON])
            np.testing.assert_allclose(theta, expected, rtol=1e-7, atol=1e-9)
            assert can == [odds.max() >= np.log(told.ODDS)]
            found += can
    assert 0 < sum(found) < len(found)


def test_the_best_constant_speed_in_hindsight_is_no_worse_than_the_true_one():
    r = worlds.records(REGRESSION, range(3), 900)
    y, q = np.where(r.outliers, np.nan, r.y), told.walk(REGRESSION, 900)
    plain = [told.follow(REGRESSION, y[s], r.u[s], r.sigma[s], q)[0] for s in range(3)]
    known = told.told(REGRESSION, r)
    assert (
        known.oracle
        < known.reference
        <= np.sqrt(np.mean([told.error(REGRESSION, path, true) for path, true in zip(plain, r.theta)]))
    )
    assert known.which != "true Q" and known.tellable.shape == (3, 1)


def test_the_odds_of_every_moment_are_those_of_the_filter_that_is_told_it():
    system = changed(REGRESSION, outliers=(0.0, 0.0), missing=(0.0, 1), steps=())
    r, samples, variances = worlds.record(system, 1, 120), 120, np.array([0.0, 0.4])
    rows, q = (r.u[0], r.y[0], r.sigma[0]), told.walk(system, 120)
    moments, P0 = ceiling.Moments([variances, 4 * variances], np.log(0.5)), np.array([10.0, 10.0])
    steps = list(ceiling.filtered(*rows, q, np.zeros(2), np.diag(P0)))
    for *seen, _, _ in steps:
        logs, moved, _ = (found.reshape(2, len(moments.A), -1) for found in moments.take(*seen))
    theta = steps[-1][-2]
    path, (e0, v0) = dense(r.y[0], r.u[0], r.sigma[0], q, P0)
    np.testing.assert_allclose(theta, path[-1], rtol=1e-9)
    for size, k in ((0, 1), (0, 40), (1, 40), (1, 119)):
        jumping = q.copy()
        jumping[k - 1] += [1, 4][size] * variances
        path, (e, v) = dense(r.y[0], r.u[0], r.sigma[0], jumping, P0)
        ratio = 0.5 * np.sum(np.log(v0 / v) + e0**2 / v0 - e**2 / v) + np.log(0.5)
        assert logs[size, k] == pytest.approx(ratio, abs=1e-9)
        np.testing.assert_allclose(theta + moved[size, k], path[samples - 1], rtol=1e-8, atol=1e-10)


def test_mixtures_tell_a_large_jump_and_not_a_tiny_one():
    for size, tells in ((8.0, True), (1e-3, False)):
        system = changed(REGRESSION, outliers=(0.0, 0.0), missing=(0.0, 1), steps=(), jumps=((size, (1,)),))
        r = worlds.record(system, 2, 900)
        [found] = ceiling.of_record(system, r.u[0], r.y[0], r.sigma[0], r.theta[0], r.jumps[0], r.moved[0])
        assert [one.told for one in found[1:]] == [tells, tells] and all(0.5 < one.held <= 1.0 for one in found)
        assert not tells or found[0].square < min(one.square for one in found[1:])  # who is told when errs less


def test_who_knows_the_law_of_jumps_gives_each_a_share():
    guesses = ceiling.statistics(None, np.array([1.0, 2.0, 0.5]))
    assert [len(g.precision) for g in guesses] == [len(ceiling.SCALES)] * 4
    assert sum(len(g.precision) * np.exp(g.log_prior) for g in guesses) == pytest.approx(1.0)


def test_the_mixture_over_dates_is_the_reference_where_nothing_happens_at_a_date():
    system = DRAWN[3]
    assert system.troubles == ("walk all",)
    r = worlds.record(system, 1, 150)
    psi, y = worlds.regressors(system, r.y, r.u)[0], r.y[0].copy()
    y[: max(system.na, *system.nb)] = np.nan
    prior = told.WIDE * np.maximum(np.array(system.deviations) ** 2, 1.0)
    may, sigma = attainable.worlds([system], 150), attainable.quiet(system, r.sigma[0])
    found = attainable.follow(may, psi, y, sigma, prior, 5, np.random.default_rng(0), False)
    known = told.follow(system, r.y[0], r.u[0], r.sigma[0], told.walk(system, 150))[0]
    np.testing.assert_allclose(found[20:], known[20:], rtol=1e-8, atol=1e-10)


def test_the_mixture_over_dates_finds_a_step_of_the_noise():
    """It comes to know when the noise became louder: nearer to who is told than who believes in no step."""
    system = changed(DRAWN[0], na=-1, nb=(1,), theta=(1.0,), sigma=0.1, deviations=(0.1,), steps=(8.0,))
    r = worlds.record(system, 1, 600)
    rows = r.u[0], r.y[0], attainable.quiet(system, r.sigma[0]), np.array([1e3])
    errors = [
        told.error(
            system,
            attainable.follow(attainable.worlds([one], 600), *rows, 30, np.random.default_rng(0), False),
            r.theta[0],
        )
        for one in (system, changed(system, steps=()))
    ]
    known = told.error(system, told.follow(system, r.y[0], r.u[0], r.sigma[0], told.walk(system, 600))[0], r.theta[0])
    assert errors[0] < 1.1 * known < 0.8 * errors[1]


def test_hypotheses_are_dropped_by_lot_and_no_sum_is_biased():
    logs, rng, total = (
        np.log(np.random.default_rng(1).dirichlet(np.full(40, 0.3))),
        np.random.default_rng(2),
        np.zeros(40),
    )
    for _ in range(2000):
        kept, weights = attainable.chosen(logs, 10, rng)
        assert len(kept) == 10
        np.add.at(total, kept, np.exp(weights))
    np.testing.assert_allclose(total / 2000, np.exp(logs), atol=0.005)


def test_a_jump_is_told_or_has_a_cause():
    plain = changed(REGRESSION, outliers=(0.0, 0.0), missing=(0.0, 1), steps=(), nvr=())
    seen = {}
    for size in (0.4, 8.0):
        system = changed(plain, jumps=((size, (1,)),))
        r = worlds.records(system, range(6), 900)
        seen[size] = [untold.causes(system, r, s) for s in range(6)]
    assert [could for could, _ in seen[8.0]] == [1] * 6 and not any(found for _, found in seen[8.0])
    found = [one for _, some in seen[0.4] for one in some]
    assert found and all(why in (untold.NO_TRIAL, untold.BELOW, untold.EVEN) and size < 3 for why, size in found)
