"""Verdicts: each one is fine where nothing is wrong and not fine where something is, and false alarms are rare."""

import json
import math

import numpy as np
import pytest
from scipy.stats import binom, chi2, norm

import driftwise as dw
from driftwise.analysis.drift_or_jump import odds
from driftwise.analysis.information_age import last_news
from driftwise.results.verdicts import Diagnosis, Verdict

A, B = [-1.5, 0.7], [1.0, 0.5]


def run(est, y, u):
    return est.scaled_to(y, u).scan(y, u)


def plant(samples=1000, seed=1, b=B, a=A, **options):
    return dw.simulate(a, b, samples=samples, noise_std=0.3, seed=seed, **options)


@pytest.fixture(scope="module")
def sound():
    """Return the verdicts on a run in which nothing is wrong."""
    return run(dw.ARX(2, 2), *plant()).diagnose()


def found(est, y, u, name):
    return run(est, y, u).diagnose().find(name)


def test_a_sound_run_is_fine(sound):
    assert sound.is_fine
    assert all(v.is_known and v.threshold[0] <= v.value <= v.threshold[1] for v in sound)
    names = "NIS, coverage, whiteness, excitation, identifiability, stability, drift or jump, last news"
    assert ", ".join(v.name for v in sound) == names
    assert sound.words == f"All of {names} are fine."


@pytest.mark.parametrize("variance, way", [(0.01, "larger"), (0.9, "smaller")])
def test_nis_and_coverage_of_a_wrong_variance(sound, variance, way):
    y, u = plant()
    trace = dw.ARX(2, 2, variance=variance, P0=1e4).scan(y, u)
    verdict = trace.diagnose().find("NIS")
    assert not verdict.is_fine
    assert verdict.value == trace.summary().nis
    assert f"the noise is {way} than the variance that was given" in verdict.advice
    assert not trace.diagnose().find("coverage").is_fine


def test_whiteness_of_coloured_noise(sound):
    rng = np.random.default_rng(3)
    (y, u), e = plant(samples=1500), rng.standard_normal(1501)
    verdict = found(dw.ARX(2, 2), y + 0.5 * (e[1:] + 0.9 * e[:-1]), u, "whiteness")
    assert not verdict.is_fine
    assert "try ARMAX" in verdict.advice
    joint = found(dw.Joint(2, inputs=1), y + 0.5 * (e[1:] + 0.9 * e[:-1]), u, "whiteness")
    assert "try noise=UnknownPolynomial()" in joint.advice


def test_an_offset_is_no_colour():
    y, u = plant()
    verdict = found(dw.ARX(2, 2), y + 3.0, u, "whiteness")
    assert not verdict.is_fine and "deviations too high on average: estimate it (offset=True)" in verdict.advice


def test_a_still_input_excites_not_all(sound):
    y, u = plant(u=np.ones(1000))
    verdicts = run(dw.ARX(2, 2), y, u).diagnose()
    excitation = verdicts.find("excitation")
    assert not excitation.is_fine
    assert "3 of 4 combinations" in excitation.advice
    assert "move the input" in excitation.advice
    verdict = verdicts.find("identifiability")
    assert not verdict.is_fine and "The input is constant: move it" in verdict.advice


def test_regressors_that_go_together_are_told():
    """A car that cruises: force and slope, and the mass is anything; and the same that varies its speed."""
    rng = np.random.default_rng(6)
    force = 180.0 + rng.standard_normal(1000)
    for shown, is_fine in ((force, False), (force + 500.0 * rng.standard_normal(1000), True)):
        phi = np.column_stack([shown, np.full(1000, -9.81)])
        y = phi @ [1 / 1800.0, 0.01] + 0.05 * rng.standard_normal(1000)
        verdict = run(dw.Regression(["1/m", "slope"]).scaled_to(y, phi), y, phi).diagnose().find("identifiability")
        assert verdict.is_fine == is_fine
    y = force / 1800.0 + 0.05 * rng.standard_normal(1000)
    near = run(dw.Regression(["1/m"], offset=True), y, force).diagnose().find("identifiability")
    assert not near.is_fine and "let the regressors go different ways" in near.advice
    known = run(dw.Regression(["b"], offset=True), 3.0 * force - 100.0 + rng.standard_normal(1000), force)
    verdict = known.diagnose().find("identifiability")
    assert verdict.is_fine and verdict.value < 1e-3 and "known to a half" in verdict.advice


@pytest.mark.parametrize("pole, words", [(1.0, "cannot be told from 1"), (1.02, "unstable")])
def test_stability(sound, pole, words):
    y, u = plant(a=[-pole], b=[1.0], samples=300)
    trace = run(dw.ARX(1, 1), y, u)
    verdict = trace.diagnose().find("stability")
    assert not verdict.is_fine and words in verdict.advice
    ((p, std),) = trace.summary().poles  # a real pole: all of its deviation is radial
    assert verdict.value == abs(p)
    assert verdict.threshold[1] == pytest.approx(1 - norm.ppf(0.99) * std)


def test_the_deviation_of_a_pair_is_that_of_its_modulus():
    model = run(dw.ARX(2, 2), *plant()).model()
    verdict = run(dw.ARX(2, 2), *plant()).diagnose().find("stability")
    slope, P = 0.5 / math.sqrt(model.values[1]), model.covariance  # |p| = sqrt(a2) of a complex pair
    assert (1 - verdict.threshold[1]) / norm.ppf(0.99) == pytest.approx(slope * math.sqrt(P[1, 1]), rel=1e-6)


def test_a_jump_and_a_drift_are_told_apart():
    late = np.arange(1000)[:, None] >= 600
    jumped = found(dw.ARX(2, 2), *plant(b=np.where(late, [1.6, 0.5], B)), "drift or jump")
    assert not jumped.is_fine
    assert jumped.advice.startswith("the parameters jumped, b1 by +0.")
    walk = np.cumsum(0.03 * np.random.default_rng(0).standard_normal(1000))
    drifted = found(dw.ARX(2, 2), *plant(b=np.column_stack([1 + walk, np.full(1000, 0.5)])), "drift or jump")
    assert not drifted.is_fine
    assert drifted.advice.startswith("the parameters drift, most of all b1 ")


def test_odds_need_a_regression_on_data():
    y, u = plant()
    assert odds(dw.Joint(2, inputs=1), y, u)[:2] == pytest.approx(odds(dw.ARX(2, 2), y, u)[:2])
    assert odds(dw.Joint(2, inputs=1, noise=dw.models.OutputError()), y, u) is None


@pytest.mark.parametrize("gain, is_fine", [(1.0, True), (1.5, False)])
def test_constancy_where_there_are_no_odds(gain, is_fine):
    late = np.arange(1000)[:, None] >= 500
    y, u = plant(b=np.where(late, gain * np.array(B), B), noise="output")
    verdict = found(dw.Joint(2, inputs=1, noise=dw.models.OutputError()), y, u, "drift or jump")
    assert verdict.is_fine == is_fine
    assert ("moved by" in verdict.advice) == (not is_fine)


def test_a_memory_that_tells_is_heard():
    late = np.arange(1000)[:, None] >= 600
    y, u = plant(b=np.where(late, [2.0, 0.5], B))
    verdict = found(dw.ARX(2, 2, memory=dw.AutoMemory()), y, u, "drift or jump")
    assert verdict.is_fine and "1 jump, the last at 6" in verdict.advice


def test_news_stop_where_the_input_stops(sound):
    u = np.random.default_rng(1).standard_normal(1000)
    u[600:] = 0.0
    y, u = plant(u=u)
    verdict = found(dw.ARX(2, 2), y, u, "last news")
    assert (verdict.value, verdict.is_fine) == (400, False)
    assert verdict.advice.startswith("no informative sample for 400 samples: b")
    assert "move the input" in verdict.advice
    y[600:] = math.nan
    assert last_news(dw.ARX(2, 2), y, u).is_all
    assert "y is missing since" in found(dw.ARX(2, 2), y, u, "last news").advice


def test_information_is_that_of_the_rows():
    """The age is where 99 % of 1/[inv(G)]_ii were there, on rows built by hand."""
    rng = np.random.default_rng(5)
    u = rng.standard_normal(400) * (np.arange(400) < 130)
    y, u = dw.simulate([-0.8], [1.0], u=u, samples=400, noise_std=0.3, seed=2)
    rows = np.column_stack([-y[:-1], u[:-1]])  # of samples 1 ..
    J = np.array([1 / np.linalg.inv(rows[:k].T @ rows[:k])[1, 1] for k in range(20, 400)])
    exact = 399 - (20 + np.argmax(J >= 0.99 * J[-1]))
    assert abs(last_news(dw.ARX(1, 1), y, u).age - exact) <= 4, "blocks of four samples"


def test_missing_rejected_and_saturated_samples():
    y, u = plant()
    spoilt = y.copy()
    spoilt[50:990:40] += 60
    verdicts = run(dw.Joint(2, inputs=1, gate=dw.InnovationGate(6, settle=40)), spoilt, u).diagnose()
    assert not verdicts.find("rejected").is_fine
    assert verdicts.find("rejected").value == pytest.approx(0.024, abs=0.002)
    few, many = y.copy(), y.copy()
    few[::50], many[::5] = math.nan, math.nan
    assert found(dw.ARX(2, 2), few, u, "missing")[1:4] == (0.02, (0.0, 0.1), True)
    assert found(dw.ARX(2, 2), many, u, "missing")[1:4] == (0.2, (0.0, 0.1), False)
    clipped = np.minimum(y, np.quantile(y, 0.9))
    verdict = found(dw.ARX(2, 2), clipped, u, "saturation")
    assert verdict.value == pytest.approx(0.1) and not verdict.is_fine
    with pytest.raises(KeyError, match="there are: NIS"):
        found(dw.ARX(2, 2), np.round(y), u, "saturation")  # coarse is not clipped


def test_too_little_is_no_alarm():
    y, u = plant(samples=9)
    for stop in (0, 3, 9):
        verdicts = run(dw.ARX(2, 2), y[:stop], u[:stop]).diagnose()
        assert all(v.is_fine for v in verdicts[:4])
        assert math.isnan(verdicts.find("NIS").value)


def test_calibration_of_scores():
    z = np.random.default_rng(0).standard_normal(2000)
    good = dw.analysis.calibration(np.where(np.arange(2000) % 7, z, math.nan))
    assert good.is_fine
    assert good.find("NIS").value == pytest.approx(np.mean(z[np.arange(2000) % 7 > 0] ** 2))
    coloured = dw.analysis.calibration((z[1:] + z[:-1]) / math.sqrt(2))
    assert [v.name for v in coloured.not_fine] == ["whiteness"]
    assert coloured.find("whiteness").value == pytest.approx(0.25, abs=0.1), "r1 = 1/2"
    assert [v.name for v in dw.analysis.calibration(0.5 * z).not_fine] == ["NIS", "coverage"]


def test_thresholds_are_those_of_the_books():
    verdicts = dw.analysis.calibration(np.random.default_rng(1).standard_normal(100))
    low, high = verdicts.find("NIS").threshold
    assert (low, high) == pytest.approx((chi2.ppf(0.005, 100) / 100, chi2.ppf(0.995, 100) / 100))
    low, high = verdicts.find("coverage").threshold
    assert binom.cdf(round(100 * low) - 1, 100, 0.95) < 0.005 < binom.cdf(round(100 * low) + 1, 100, 0.95)
    assert high == 0.99 or high == 1.0
    assert verdicts.find("whiteness").threshold[1] == pytest.approx((chi2.ppf(0.99, 20) - 20) / 102)


def test_several_outputs_each_have_their_verdicts():
    rng = np.random.default_rng(0)
    u, y = rng.standard_normal(400), np.zeros((400, 2))
    for t in range(1, 400):
        y[t] = 0.7 * y[t - 1] + u[t - 1] * np.array([1, 0.5]) + 0.1 * rng.standard_normal(2)
    verdicts = dw.ARXMIMO(2, 1, 1, 1).scan(y, u).diagnose()
    assert [v.name for v in verdicts] == [
        f"{name} of y{i}" for i in (1, 2) for name in ("NIS", "coverage", "whiteness")
    ]
    assert verdicts.is_fine


def test_the_table_and_the_dictionary(sound):
    text = str(Diagnosis([*sound, Verdict("new", 2.0, (0.0, 1.0), False, "too large " * 30)]))
    lines = text.splitlines()
    assert max(map(len, lines)) <= 110
    assert [line[2:5] for line in lines if line.startswith("!")] == ["new"]
    assert "0.8 to 1.25" in text and "at most 0.5" in text
    data = json.loads(json.dumps(sound.as_dict(), allow_nan=False))
    assert data["excitation"]["threshold"] == [None, 0.5]
    assert data["NIS"]["value"] == sound.find("NIS").value


@pytest.mark.slow
def test_false_alarms_are_rare():
    """Of 1000 sound records each verdict fails at most as often as chance at 1 % has it (99.9 %)."""
    failed: dict[str, int] = {}
    for seed in range(1000):
        for verdict in run(dw.ARX(2, 2), *plant(samples=250, seed=seed)).diagnose().not_fine:
            failed[verdict.name] = failed.get(verdict.name, 0) + 1
    print(failed)
    assert max(failed.values()) <= binom.ppf(0.999, 1000, 0.01)
    assert set(failed) <= {"NIS", "coverage", "whiteness", "drift or jump"}


@pytest.mark.slow
def test_jumps_and_drifts_are_named_right():
    late, right = np.arange(600)[:, None] >= 300, [0, 0]
    for seed in range(100):
        jumped = found(dw.ARX(2, 2), *plant(600, seed, np.where(late, [1.4, 0.5], B)), "drift or jump")
        walk = np.cumsum(0.03 * np.random.default_rng(seed).standard_normal(600))
        b = np.column_stack([1 + walk, np.full(600, 0.5)])
        drifted = found(dw.ARX(2, 2), *plant(600, seed, b), "drift or jump")
        right[0] += "jumped, b1" in jumped.advice
        right[1] += "drift, most of all b1" in drifted.advice
    print(right)
    assert min(right) >= 90


def test_no_more_outputs_are_missing_than_there_are():
    """One that cannot be read is missing, too: it is counted once."""
    y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    y[50:150], y[200:369] = np.nan, 1e70
    trace = dw.ARX(1, 1).scan(y, u)
    (verdict,) = [v for v in trace.diagnose() if v.name == "missing"]
    assert verdict.value == 269 / 400 and "269 of 400" in verdict.advice
