"""Plants with known truth: drawn, simulated, written; who is told everything; one claim held against the truth."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from driftwise_studies.score.claims import audit, checking
from driftwise_studies.score.claims.checking import FALSE, TRUE, UNCHECKED, VACUOUS, Case, check
from driftwise_studies.score.claims.dating import dates
from driftwise_studies.score.claims.drawing import LONGEST, draw
from driftwise_studies.score.claims.hidden_inputs import expected, spread
from driftwise_studies.score.claims.oracle import ask, whitener
from driftwise_studies.score.claims.plant import TROUBLES, Jump, Plant
from driftwise_studies.score.claims.simulation import COLOUR, record, response
from driftwise_studies.score.claims.tables import Written
from scipy.linalg import toeplitz

from driftwise.engine.errors import InputError

PLAIN = Plant(
    0, frozenset(), 1200, 2.0, (0.8 + 0j,), ((1.0,),), (3.0,), (1,), "white", 5.0, 4.0, "equation", 0.8
)  # fmt: skip


def jumping(what: str, size: float) -> Plant:
    return replace(PLAIN, jumps=(Jump(what, 600, size),), troubles=frozenset({f"{what} jump"}))


def regressors(y, u):
    return np.column_stack([-y[1:-1], u[1:-1, 0], np.ones(len(y) - 2)]), y[2:]


def test_every_trouble_is_drawn_and_the_same_seed_is_the_same_plant():
    plants = [draw(5, number) for number in range(90)]
    assert set().union(*(plant.troubles for plant in plants)) == set(TROUBLES)
    assert plants == [draw(5, number) for number in range(90)] and plants[7] != draw(6, 7)
    assert 20 < max(max(plant.delays) for plant in plants) <= LONGEST
    assert all(abs(p) < 1 for plant in plants for p in plant.poles)


def test_the_record_is_that_of_the_equation():
    data = record(PLAIN, 1)
    psi, target = regressors(data.y, data.u)
    theta = np.linalg.lstsq(psi, target, rcond=None)[0]
    np.testing.assert_allclose(theta, [-0.8, 3.0 * 0.2, 5.0 * 0.2], atol=0.1)
    residual = target - psi @ np.array([-0.8, 0.6, 1.0])
    assert residual.std() == pytest.approx(data.sigma[0], rel=0.06)


def test_who_is_told_everything_is_least_squares_where_that_is_best():
    """An ARX with its own noise: the bound is the covariance of least squares."""
    data = record(PLAIN, 1)
    known = ask(PLAIN, data)
    psi, _ = regressors(data.y, data.u)
    P = data.sigma[0] ** 2 * np.linalg.inv(psi.T @ psi)
    slope = np.array([-3.0 / 0.2, 1 / 0.2, 0.0])
    assert known.gains[0] == pytest.approx(3.0) and known.slowest[0] == pytest.approx(-1 / np.log(0.8))
    assert known.gain_bars[0] == pytest.approx(1.96 * np.sqrt(slope @ P @ slope), rel=0.15)


@pytest.mark.parametrize(("what", "large", "small"), [("level", 1.0, 1e-3), ("gain", 2.0, 1.001), ("noise", 2, 1.001)])
def test_odds_of_a_change_grow_with_it(what, large, small):
    odds = [ask(plant, record(plant, 1)).log_odds[0] for plant in (jumping(what, large), jumping(what, small))]
    assert odds[0] > checking.TELLABLE > 1 > odds[1]


def test_the_odds_of_a_level_are_those_of_its_likelihood():
    """Equation noise whitened by A: what the jump takes off half the squares there, beside the other regressors."""
    plant = jumping("level", 0.5)
    data = record(plant, 2)
    y, u = data.y, data.u
    step = (np.arange(len(y)) >= 600).astype(float)
    clean = (data.clean - 5.0 - 0.5 * data.unit * step)[1:-1]
    others = np.column_stack([clean, u[1:-1, 0], np.ones(len(clean))])
    target = y[2:] - 0.8 * y[1:-1]
    taken = squares(others, target) - squares(np.column_stack([others, step[2:] - 0.8 * step[1:-1]]), target)
    expected = 0.5 * taken / data.sigma[0] ** 2 - 0.5 * np.log(len(y))
    assert ask(plant, data).log_odds[0] == pytest.approx(expected, rel=0.03)


def squares(X, y) -> float:
    left = y - X @ np.linalg.lstsq(X, y, rcond=None)[0]
    return float(left @ left)


@pytest.mark.parametrize(("size", "louder"), [(1.2, 1.0), (0.8, 1.0), (2.0, 3.0), (0.5, 1 / 3)])
def test_the_odds_of_a_gain_are_those_of_two_regressions(size, louder):
    """An ARX with and without a coefficient that changes, and a level that moves with it; also where noise jumps."""
    plant = replace(PLAIN, jumps=(Jump("gain", 600, size), Jump("noise", 500, louder)))
    data = record(plant, 3)
    psi, target = regressors(data.y, data.u)
    after, weight = np.arange(2, 1200) >= 600, 1 / data.sigma[2:, None]
    psi, target, number = psi * weight, target * weight[:, 0], 0.5 * np.log(1200)
    level, both = (np.column_stack([psi, psi[:, which] * after[:, None]]) for which in ([2], [1, 2]))
    one, two, three = (0.5 * squares(X, target) for X in (psi, level, both))
    known = ask(plant, data)
    assert known.log_odds[0] == pytest.approx(one - three - 2 * number, rel=0.05, abs=0.5)
    assert known.named_odds[0] == pytest.approx(two - three - number, rel=0.05, abs=0.5)


def test_the_odds_of_a_noise_are_those_of_its_innovations():
    plant = jumping("noise", 1.3)
    data = record(plant, 3)
    psi, target = regressors(data.y, data.u)
    e = target - psi @ np.array([-0.8, 0.6, 1.0])
    log = [len(part) * np.log(np.mean(part**2)) for part in (e, e[:598], e[598:])]
    expected = 0.5 * (log[0] - log[1] - log[2]) - 0.5 * np.log(600)
    assert ask(plant, data).log_odds[0] == pytest.approx(expected, abs=0.3)


def test_a_noise_below_the_rounding_jumps_for_nobody():
    plant = replace(jumping("noise", 3.0), snr=200.0)
    odds = [ask(one, record(one, 1)).log_odds[0] for one in (plant, replace(plant, levels=4))]
    assert odds[0] > checking.TELLABLE > 1 > odds[1]


def test_noise_at_missing_samples_is_known_to_nobody():
    """Every other sample of a first-order noise is a first-order noise, of the squared pole."""
    data, rng = record(PLAIN, 1), np.random.default_rng(1)
    seen, x = np.arange(1200) % 2 == 0, rng.normal(size=1200)
    white = (x[seen][1:] - 0.8**2 * x[seen][:-1]) / (data.sigma[0] * np.sqrt(1 + 0.8**2))
    np.testing.assert_allclose(whitener(PLAIN, data, seen)(x)[1:], white, rtol=1e-6)


@pytest.mark.parametrize("excitation", ["white", "coloured", "steps"])
def test_what_inputs_did_between_rows_nobody_knows(excitation):
    """The same as of many inputs that are equal at the rows."""
    plant, rng, T = replace(PLAIN, samples=60, excitation=excitation, delays=(2,)), np.random.default_rng(1), 60
    rows = np.flatnonzero(np.arange(T) % 5 * (np.arange(T) % 7) == 0)
    data = replace(record(plant, 1), rows=rows)
    u = np.repeat(data.u, 3000, axis=1)
    if excitation == "steps":
        for a, b in pairwise(rows):
            at = rng.integers(a + 1, b + 1, u.shape[1])
            u[a:b] = np.where(np.arange(a, b)[:, None] < at, u[a], u[b])
    else:
        rho = COLOUR if excitation == "coloured" else 0.0
        root = np.linalg.cholesky(toeplitz(rho ** np.arange(T)))
        free, whole = root @ rng.standard_normal(u.shape), root @ root.T
        u = free + whole[:, rows] @ np.linalg.solve(whole[np.ix_(rows, rows)], u[rows] - free[rows])
    y = np.array([response(plant, x[:, None]) for x in u.T])
    found = spread(plant, data, np.ones(T, bool))
    np.testing.assert_allclose(found, np.cov(y.T), atol=0.1 * found.max())
    known = slice(rows[-1] + 1)
    np.testing.assert_allclose(expected(plant, data)[known, 0], u.mean(axis=1)[known], atol=0.1)


def test_a_gain_is_known_less_well_where_the_input_moves_between_rows():
    plant = replace(PLAIN, excitation="white", noise="white")
    bars = [ask(one, record(one, 1)).gain_bars[0] for one in (plant, replace(plant, troubles=frozenset({"irregular"})))]
    assert bars[1] > 4 * bars[0]  # a quarter of the rows alone makes it twice as wide


def case(plant: Plant, **answer) -> Case:
    data = record(plant, 1)
    affine = {"level_m": (0.0, 1.0), "valve [%]": (50.0, 1.0)}
    written = Written("plant.csv", "plain", "seconds", "en", ("level_m",), ("valve [%]",), ("time_s",), 2.0, {}, affine)
    results = {"dt": plant.dt, "forecast": {"fit": 50.0}, "claims": [], **answer}
    return Case(plant, data, written, ask(plant, data), results)


DOUBTED = "12 values of 'valve [%]' not believed ({} for a missing value) and taken as missing."


def test_a_code_that_stands_for_lost_cells_is_doubted_rightly():
    """The table lost cells of its own and wrote -999 for them: that is what the note says, and no false alarm."""
    one = case(PLAIN)
    one = replace(one, written=replace(one.written, code="-999", lost={"valve [%]": 12, "level_m": 0}))
    said = [claim("table", "valve [%]", 12, text=DOUBTED.format(code)) for code in ("-999", "-99.99")]
    assert [check(one, it) for it in said] == [TRUE, FALSE]
    assert check(one, claim("table", "level_m", 12, text=DOUBTED.format("-999"))) == FALSE
    far = "3 values of 'level_m' not believed (single samples far outside that return) and taken as missing."
    assert check(one, claim("table", "level_m", 3, text=far)) == FALSE
    hit = replace(one, plant=replace(PLAIN, outliers=(0.01, 5.0)))
    assert check(hit, claim("table", "level_m", 3, text=far)) == TRUE


def test_a_gain_that_is_said_to_be_unknown_is_not_claimed():
    line = audit.Line(0, "", frozenset(), "answered")
    audit.recall(case(PLAIN, claims=[claim("gain", "valve [%]", None)]), line)
    assert line.expected["gain"] == 1 and line.found["gain"] == 0


def claim(kind, subject, value=None, interval=None, odds=None, text="") -> dict:
    return {"kind": kind, "subject": subject, "value": value, "interval": interval, "odds": odds, "text": text}


NONE = {"level": 0.5, "gain": {"valve [%]": 0.3}, "noise": 2.0}


@pytest.mark.parametrize(
    ("plant", "said", "verdict"),
    [
        (PLAIN, claim("gain", "valve [%]", 3.1, (2.9, 3.3)), TRUE),
        (PLAIN, claim("gain", "valve [%]", 3.1, (3.08, 3.12)), FALSE),
        (PLAIN, claim("gain", "valve [%]", 3.1, (-9.0, 15.0)), VACUOUS),
        (PLAIN, claim("gain", "level_m", 3.0, (2.9, 3.1)), FALSE),
        (replace(PLAIN, nonlinearity="square"), claim("gain", "valve [%]", 4.2, (3.9, 4.6)), FALSE),
        (PLAIN, claim("time constant", "level_m", 9.0, (8.5, 9.5)), TRUE),
        (PLAIN, claim("time constant", "valve [%]", 9.0, (8.5, 9.5)), TRUE),
        (PLAIN, claim("time constant", "level_m", 4.5, (4.2, 4.7)), FALSE),
        (PLAIN, claim("delay", "valve [%]", 1), TRUE),
        (PLAIN, claim("delay", "valve [%]", 9), FALSE),
        (PLAIN, claim("change", "none", NONE), TRUE),
        (PLAIN, claim("change", "unknown"), UNCHECKED),
        (PLAIN, claim("change", "the level rose by 2", 600), FALSE),
        (jumping("level", 1.0), claim("change", "none", NONE), FALSE),
        (jumping("noise", 1.5), claim("change", "none", NONE), TRUE),
        (jumping("level", 1.0), claim("change", "the level rose by 2", 605), TRUE),
        (jumping("level", 1.0), claim("change", "the gain from valve [%] halved", 605), FALSE),
        (jumping("level", 1.0), claim("change", "the level rose by 2", 900), FALSE),
        (jumping("gain", 2.0), claim("change", "the gain from valve [%] doubled", 605), TRUE),
        (PLAIN, claim("column", "output", "level_m"), TRUE),
        (PLAIN, claim("column", "inputs", ["valve [%]", "status"]), FALSE),
        (PLAIN, claim("clock", "time_s", 2.0), TRUE),
        (PLAIN, claim("clock", "time_s", 1.0), FALSE),
        (PLAIN, claim("note", "excitation", 0.1), UNCHECKED),
    ],
)
def test_a_claim_against_the_truth(plant, said, verdict):
    assert check(case(plant), said) == verdict


def test_a_file_by_the_month_is_dated_by_its_rows_and_intervals_are_held_against_the_change():
    said = [claim("change", "the gain from valve [%] doubled", at, (at - 4, at + 4)) for at in (603, 615)]
    one = case(jumping("gain", 2.0), dt=2.0 * 31 / 30.4375, claims=said[:1])
    assert [check(one, it) for it in said] == [TRUE, TRUE] and one.dt == 1.0
    line = audit.Line(0, "", frozenset(), "answered")
    for claims in (said[:1], said[1:]):
        audit.recall(replace(one, answer={**one.answer, "claims": claims}), line)
    assert line.dated == [True, False]


@pytest.mark.parametrize(("what", "large", "small"), [("level", 0.5, 0.1), ("noise", 2.0, 1.3), ("gain", 1.5, 1.1)])
def test_who_knows_all_but_the_date_has_it_within_his_interval(what, large, small):
    """In 34 of 40 at least, if it is one of 95 %: fewer have a chance of 1 in 300. A small change has a wider one."""
    widths = []
    for plant in (jumping(what, large), jumping(what, small)):
        found = [dates(plant, record(plant, seed), 0) for seed in range(40)]
        assert sum(first <= 600 <= last for first, last in found) >= 34
        widths.append(np.mean([last - first for first, last in found]))
    assert widths[1] > 5 * widths[0]


def test_a_change_is_told_by_two_dates_that_nobody_could_have_closer():
    one = case(jumping("gain", 1.15))
    first, last = dates(one.plant, one.record, 0)
    n = last - first
    assert n > one.tolerance
    for ends, verdict in (((-n, n // 2), TRUE), ((-2 * n, n), FALSE), ((-n, -5), FALSE)):
        said = claim("change", "the gain from valve [%] rose", 600 - n, tuple(600 + end for end in ends))
        assert check(one, said) == verdict


def test_the_most_likely_is_the_most_likely_and_as_likely_is_as_likely():
    table = {"model": ["ARX(2,2,1)", "ARX(1,1,1)"], "log_odds": [0.0, -300.0], "rmse": [1.0, 1.005]}
    one = case(PLAIN, candidates=table)
    assert check(one, claim("model choice", "most likely", "ARX(2,2,1)")) == TRUE
    assert check(one, claim("model choice", "as likely", "ARX(1,1,1)")) == FALSE


def test_the_best_that_follows_is_the_best_of_those():
    table = {"model": ["Joint(2)", "ARX(2,2,1)", "ARX(1,1,1)"], "log_odds": [0.0, -9.0, -300.0]}
    one = case(PLAIN, candidates=table)
    assert check(one, claim("model choice", "follows", "ARX(2,2,1)")) == TRUE
    assert check(one, claim("model choice", "follows", "ARX(1,1,1)")) == FALSE


def test_a_file_goes_through_the_front_door_and_its_claims_are_counted(monkeypatch):
    monkeypatch.setattr(audit, "draw", lambda seed, number: replace(PLAIN, samples=500, gains=(3.0,)))
    (line,) = audit.play(4, [0])
    assert line.outcome == "answered" and {"column", "change", "forecast"} <= {kind for kind, _, _ in line.claims}
    assert line.expected["gain"] == 1
    assert "| all |" in audit.table([line]) and "| gain |" in audit.table([line])


def test_a_file_that_is_refused_is_counted(monkeypatch):
    def refuse(path):
        raise InputError("nothing there")

    monkeypatch.setattr(audit, "front_door", refuse)
    (line,) = audit.play(3, [0])
    assert line.outcome == "refused" and "nothing there" in audit.falsehoods([line], 1)


def test_who_is_not_told_the_date_needs_more_and_dates_nothing_while_the_sensor_is_stuck():
    plant = jumping("level", 1.0)
    found = case(plant)
    dates = 1200 / (2 * found.tolerance) * 3  # of level, gain and noise
    for more, wanted in ((-0.1, False), (0.1, True)):
        odds = (checking.TELLABLE + np.log(dates) + more,)
        other = replace(found, oracle=replace(found.oracle, log_odds=odds))
        assert checking.tellable_jumps(other) == [0]
        assert checking.is_attainable(other, 0) is wanted
        stuck = replace(other, plant=replace(plant, stuck=(560, 100)))
        assert not checking.is_attainable(stuck, 0)


def test_a_plant_whose_first_poles_leave_no_room_for_another_is_drawn_anew():
    assert len(draw(20261127, 10).poles) == 3
