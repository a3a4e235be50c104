"""Speeds that are learnt while sigma^2 is still far off: what sigma^2 explains as well says nothing of them."""

import numpy as np

import driftwise as dw
from driftwise.memory.likelihood_drift import LikelihoodDriftKernel, climb, learner_size, open_learner

SAMPLES, BEGIN = 500, 150


def gappy(seed):
    """Return y with gaps, u and parameters of a plant of order three that drifts, whose outputs move far."""
    rng = np.random.default_rng(seed)
    now = np.array([*np.poly(rng.uniform(0.6, 0.85, 3))[1:], 1.0, 1.0, -0.6])
    u, x = rng.standard_normal(SAMPLES), np.zeros(3)
    y, theta = np.empty(SAMPLES), np.empty((SAMPLES, 6))
    for t in range(SAMPLES):
        y[t], theta[t] = x[0] + 0.2 * rng.standard_normal(), now
        x = np.append(x[1:], 0.0) - now[:3] * y[t] + now[3:] * u[t]
        now = now + [*(0.001 * rng.standard_normal(3)), *(0.003 * rng.standard_normal(3))]
        if max(abs(np.roots([1.0, *now[:3]]))) > 0.96:
            now[:3] = theta[t, :3]
    y[rng.random(SAMPLES) < 0.2] = np.nan
    return y, u, theta


def test_speeds_do_not_fall_while_sigma2_is_too_large():
    """With gaps sigma^2 is known late; speeds were a tenth of what they began with by then, and filters sure of it."""
    of_bars = []
    for seed in range(30):
        y, u, theta = gappy(seed)
        trace = dw.Joint(3, 1, memory=dw.AutoMemory()).scaled_to(y, u).scan(y, u)
        of_bars.append(np.mean(((trace.parameters - theta)[BEGIN:] / trace.parameters_std[BEGIN:]) ** 2))
    assert np.exp(np.mean(np.log(of_bars))) < 3.0  # squares of errors in deviations: 3.9 before, 2.2 now


def test_a_sigma2_that_is_too_large_moves_no_speed():
    """All that innovations show is another sigma^2: z^2 is the same whatever the speeds' share of T."""
    est, rng = dw.Joint(1, 1, memory=dw.memory.LikelihoodDrift()), np.random.default_rng(0)
    policy = next(one for one in est.policies if isinstance(one, LikelihoodDriftKernel))
    learner = open_learner(np.zeros(learner_size(2, 2)), 2, 2)
    for t in range(500):
        learner.share[:] = rng.uniform(0.0, [0.3, 0.1])
        climb(policy, learner, 1.0 if t < 200 else 0.3, 1.0)
    assert np.all(abs(learner.eta) < 1.5)  # logarithms; at their least, -9.2, before
