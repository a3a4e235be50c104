"""Parameters that jump: found at once, learnt anew, and no alarm where nothing happened."""

import numpy as np
import pytest

import driftwise as dw
from driftwise.detect.watch import OWN

SEEDS, SAMPLES, JUMP = 100, 1000, 500
BEFORE, AFTER, B = np.array([-1.5, 0.72]), np.array([-1.2, 0.5]), [1.0, 0.5]
NOISE = 0.15


@pytest.fixture(scope="module")
def records():
    a = np.where(np.arange(SAMPLES)[:, None] < JUMP, BEFORE, AFTER)
    made = [dw.simulate(a, B, samples=SAMPLES, noise_std=NOISE, seed=s) for s in range(SEEDS)]
    return np.stack([y for y, _ in made]), np.stack([u for _, u in made])[..., None]


def follow(memory, records, noise=None):
    """Alarms (T, S), squared error of a (T, S)."""
    est = dw.Joint(2, 1, noise=noise or dw.models.EquationError(NOISE**2), memory=memory)
    states, alarms, errors = est.start(SEEDS), [], []
    for t in range(SAMPLES):
        states, steps = est.update_batch(states, records[0][:, t], records[1][:, t])
        alarms.append((steps.status & int(dw.Status.JUMP)) > 0)
        truth = BEFORE if t + 1 < JUMP else AFTER
        errors.append(np.sum((states["theta"][:, :2] - truth) ** 2, axis=1))
    return np.array(alarms), np.array(errors)


def rms(errors, first, stop):
    return np.sqrt(np.mean(errors[first:stop]) / 2)


@pytest.mark.parametrize("noise", [None, dw.models.EquationError()], ids=["known noise", "learnt noise"])
def test_a_jump_is_found_and_learnt_anew(records, noise):
    """Median delay at most 10 samples, none missed, no false alarm in 50 000 samples, rms error of a at most .03."""
    alarms, errors = follow(dw.RestartOnChange(), records, noise)
    assert not alarms[:JUMP].any()
    delay = [int(np.argmax(found)) if found.any() else SAMPLES for found in alarms[JUMP:].T]
    assert np.median(delay) <= 10
    assert max(delay) < 150
    assert rms(errors, 560, 1000) <= 0.03
    constant = follow(dw.Constant(), records, noise)[1]
    assert np.array_equal(errors[:JUMP], constant[:JUMP])
    assert rms(constant, 560, 1000) > 5 * rms(errors, 560, 1000)


def test_better_than_any_random_walk(records):
    until = follow(dw.RestartOnChange(), records)[1]
    for q in (1e-5, 1e-4, 1e-3):
        walking = follow(dw.RandomWalk(q), records)[1]
        # a walk pays in every quiet stretch for what it gains at the jump
        assert rms(until, 300, 500) < rms(walking, 300, 500)
        assert rms(until, 300, 1000) < rms(walking, 300, 1000) or rms(until, 600, 1000) < rms(walking, 600, 1000)


def test_no_parameter_becomes_wider_than_its_prior(records):
    est = dw.Joint(
        2,
        1,
        noise=dw.models.EquationError(NOISE**2),
        memory=dw.RestartOnChange(response=dw.memory.CovarianceInflation(1e6)),
        P0=2.0,
    )
    trace = est.scan(records[0][0], records[1][0], keep="covariance")
    assert (trace.status & int(dw.Status.JUMP)).any()
    assert np.all(trace.parameters_std**2 <= 2.0 * (1 + 1e-9))


def test_the_event_is_told(records):
    trace = dw.Joint(2, 1, memory=dw.RestartOnChange()).scan(records[0][0], records[1][0])
    told = [e for e in trace.events() if e.kind == "JUMP"]
    assert told and JUMP <= told[0].sample < JUMP + 20


@pytest.mark.parametrize(
    "memory, words",
    [
        (dw.RestartOnChange(dw.detect.VarianceCUSUM(0.5)), "ratio > 1"),
        (dw.RestartOnChange(12.0), "detector"),
        (dw.RestartOnChange(dw.detect.ProbeBank([1.0])), "probes"),
        (dw.RestartOnChange(response=dw.memory.CovarianceInflation([1.0, 2.0])), "step"),
        (dw.RestartOnChange(settle=-1), "settle"),
    ],
)
def test_bad_settings_are_told(memory, words):
    with pytest.raises(dw.InputError, match=words):
        dw.Joint(2, 1, memory=memory)


@pytest.mark.parametrize(
    "noise", [dw.models.EquationError(NOISE**2), dw.models.EquationError()], ids=["known noise", "learnt noise"]
)
def test_an_alarm_adds_the_square_of_the_step_and_starts_counting_anew(records, noise):
    """In the units of the data: variances of a gain step^2, those of b step^2 times (y_scale / u_scale)^2."""
    est = dw.Joint(
        2,
        1,
        noise=noise,
        memory=dw.RestartOnChange(response=dw.memory.CovarianceInflation(0.5), settle=10),
        P0=1e6,
        y_scale=2.0,
        u_scale=4.0,
    )
    state = est.scan(records[0][0][:100], records[1][0][:100]).state
    calm, alarmed = state.copy(), state.copy()
    calm["detector_state"], alarmed["detector_state"][OWN] = 0.0, 1e3
    (calm, _), (alarmed, step) = (est.update(s, records[0][0][100], records[1][0][100]) for s in (calm, alarmed))
    assert step.status & int(dw.Status.JUMP)
    assert not alarmed["detector_state"][OWN:].any()
    gained = est.sigma2(state) * np.diag(est.covariance(alarmed) - est.covariance(calm))[2:]
    assert np.allclose(gained, 0.25 * np.array([1, 1, 0.25, 0.25]), rtol=1e-9)


def test_the_sum_grows_by_the_log_likelihood_ratio():
    from scipy.stats import norm

    detector = dw.detect.VarianceCUSUM(ratio=3.0, threshold=100.0, sides="both")
    for z in (0.5, 1.7, 4.0):
        up, down = (norm.logpdf(z, scale=s) - norm.logpdf(z) for s in (np.sqrt(3.0), np.sqrt(1 / 3.0)))
        start = detector.scan([]).state
        start[OWN : OWN + 2] = 5.0
        assert np.allclose(detector.scan([z], state=start).state[OWN : OWN + 2], np.maximum(0, [5 + up, 5 + down]))


def test_an_event_can_be_read_without_words():
    y, u = dw.simulate(
        np.where(np.arange(900)[:, None] < 600, [-1.5, 0.7], [-1.4, 0.7]), B, samples=900, noise_std=0.3, seed=1
    )
    trace = (
        dw.ARX(2, 2, memory=dw.RestartOnChange(dw.detect.ScoreCUSUM("1 per 1000", jump=0.1))).scaled_to(y, u).scan(y, u)
    )
    (event,) = trace.jumps()
    assert event.parameter == "a1" and event.direction == 1 and event.statistic >= 1
    assert 590 <= event.since <= event.sample and "a1 rose" in event.text


def test_a_score_scales_with_the_data():
    y, u = dw.simulate([-0.6], [1.0], samples=300, noise_std=0.3, seed=2)
    y[200:] += 1.0 * np.roll(u, 1)[200:]
    est = dw.ARX(1, 1, memory=dw.RestartOnChange(dw.detect.ScoreCUSUM(1000, 0.3), dw.memory.GainReset(10)))
    one, other = (est.scaled_to(y * k, u).scan(y * k, u) for k in (1.0, 1024.0))
    assert np.array_equal(one.statistic, other.statistic, equal_nan=True)
    assert len(one.jumps()) >= 1
