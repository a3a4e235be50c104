"""Alarms of the adaptive gain: against the plain recursion, and what they lift."""

import numpy as np
import pytest
from gains_followed import PHI, SLOW, records, run

import driftwise as dw


def followed(y, alarm, N0, K=0.0):
    """Plain recursion with gain 1/t, clipped; ``alarm(n, Z, y, nu, xp, c, K)`` says +1, -1 or 0."""
    xp = nu = R = c = 0.0
    t, found, alarms = 1.0, np.empty(len(y)), np.zeros(len(y))
    for n in range(len(y)):
        f, nu = PHI * nu, y[n] - xp
        after, Z = K, 0.0
        if n:
            R += (f * f - R) / t
            Z = f * nu / R
            after, t = K + Z / t, t + 1
        if n > 20:
            alarms[n] = alarm(Z, y[n], nu, c, K)
        if alarms[n]:
            t = min(t, N0[0] if alarms[n] > 0 else N0[1])
        alarm.seen(y[n])
        K, c = min(max(after, 0.0), 1.0), c + max(1 / 50, 1 / (n + 1)) * (nu * nu - c)
        found[n], xp = K, PHI * (xp + K * nu)
    return found, alarms


class Sums:
    """Hinkley's test with two sums kept whole, their extremes looked up."""

    def __init__(self, drift, threshold):
        self.drift, self.threshold, self.S = drift, threshold, ([0.0], [0.0])

    def __call__(self, Z, y, nu, c, K):
        up, down = self.S
        up.append(up[-1] + Z - self.drift[0])
        down.append(down[-1] + Z + self.drift[1])
        way = 1 if up[-1] - min(up) >= self.threshold[0] else -int(max(down) - down[-1] >= self.threshold[1])
        if way:
            self.S = [0.0], [0.0]
        return way

    def seen(self, y):
        pass


class Bank:
    """Fixed-gain filters beside the adaptive one, log likelihood ratios summed above zero."""

    def __init__(self, grid, threshold):
        self.grid, self.threshold = np.array(grid), threshold
        self.x, self.g = np.zeros(len(grid)), np.zeros(len(grid))

    def __call__(self, Z, y, nu, c, K):
        self.g = np.maximum(0, self.g + (nu**2 - (y - self.x) ** 2) / (2 * c))
        best = int(self.g.argmax())
        if self.g[best] < self.threshold:
            return 0
        self.g[:] = 0
        return 1 if self.grid[best] > K else -1

    def seen(self, y):
        self.x = PHI * (self.x + self.grid * (y - self.x))


GRID = (0.05, 0.12, 0.25, 0.45, 0.75)


@pytest.mark.parametrize(
    "detector, oracle, N0",
    [
        (dw.detect.PullTest(), Sums((0.15, 0.07), (15, 20)), (6, 15)),
        (dw.detect.GainProbes(), Bank(GRID, 6.17), (26.5, 26.5)),
    ],
)
def test_alarms_equal_the_plain_recursion(detector, oracle, N0):
    y = records(1, levels=(0.1, 0.5, 0.1), seed=3)[1][0]
    est = dw.AdaptiveGain(
        PHI, method="plr", memory=dw.Constant(), K0=0.0, x0=0.0, detector=detector, restart=N0, scale_samples=50
    )
    trace = est.scan(y)
    K, alarms = followed(y, oracle, N0)
    assert set(alarms) == {-1, 0, 1}
    assert np.array_equal(np.sign(trace.table[:, 6]), alarms)
    assert np.array_equal((trace.status & dw.Status.JUMP) != 0, alarms != 0)
    words = [event.text for event in trace.jumps()]
    assert any(w.startswith("jump: K rose") for w in words) and any(w.startswith("jump: K fell") for w in words)
    np.testing.assert_allclose(trace.parameters[:, 0], K, atol=1e-6)  # R starts at 0 there, at 1e-10 here


def test_a_detector_that_never_alarms_changes_nothing():
    y = records(1, seed=3)[1][0]
    for memory in (dw.RandomWalk(1e-4), dw.Constant()):
        plain = dw.AdaptiveGain(PHI, memory=memory).scan(y)
        quiet = dw.AdaptiveGain(PHI, memory=memory, detector=dw.detect.GainProbes(threshold=1e9)).scan(y)
        assert np.array_equal(plain.table[:, 8:], quiet.table[:, 8:])


def test_an_alarm_lifts_a_walk_to_its_share_of_the_prior():
    y = records(1, levels=(0.05, 0.7), seed=3)[1][0]
    for restart, lifted in ((0.5, 0.1), (1.0, 0.2)):
        est = dw.AdaptiveGain(
            PHI, detector=dw.detect.GainProbes(), restart=restart, **{**SLOW, "memory": dw.RandomWalk(0.0)}
        )
        status = est.scan(y).status
        first = int(np.flatnonzero(status & dw.Status.JUMP)[0])
        state = est.scan(y[: first + 1]).state
        assert np.sqrt(est.covariance(state)[1, 1]) == pytest.approx(lifted)


@pytest.mark.slow
def test_probes_find_the_decrease_that_the_paper_misses():
    _, y, _ = records(1000, seed=11)
    plain = dict(method="plr", memory=dw.Constant(), K0=0.0, x0=0.0, restart=26.5)
    shares = []
    for detector in (dw.detect.GainProbes(threshold=6.17), dw.detect.PullTest((0.15, 0.07), (18.3, 24.4))):
        _, alarms = run(dw.AdaptiveGain(PHI, detector=detector, scale_samples=50, **plain), y)
        shares.append(
            [np.mean(np.any(alarms[:, 500 * i : 500 * (i + 1)] * w > 0, axis=1)) for i, w in ((1, 1), (2, -1))]
        )
    (up, down), (pull_up, pull_down) = shares
    assert down == pytest.approx(0.92, abs=0.03) and pull_down == pytest.approx(0.59, abs=0.04)
    assert up == pytest.approx(0.77, abs=0.05) and pull_up == pytest.approx(0.81, abs=0.04)
