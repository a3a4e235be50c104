"""The model average against its formulas, written once more over arrays."""

import math

import numpy as np
import pytest
from test_model_average import MEMBERS

import driftwise as dw
from driftwise.analysis.laws import example
from driftwise.estimators.model_average import step

KAPPA, RHO = 4.0 ** np.arange(-2, 6), np.array([0.25, 1.0, 4.0, 16.0])
DOUBT = np.array([1e-4, 0.003, 0.3, 0.03])
PRIOR = np.r_[np.where(KAPPA == 1, 2.0, 0.5 * np.minimum(KAPPA, KAPPA**-2)), np.full(4, 0.01)]


def shares(weights):
    return weights / weights.sum()


def aggregated(regrets, speaks, counts=1.0):
    """Return the weights of Bernstein's online aggregation (Wintenberger 2017), but for its factor rate."""
    fading = 0.999 ** np.arange(len(regrets))[::-1, None]
    square, most = counts * np.square(regrets).sum(axis=0), (fading * np.abs(regrets)).max(axis=0)
    known, rate = most > 0, np.full(len(speaks), math.exp(-700))
    rate[known] = np.minimum(0.5 / most[known], np.sqrt(math.log(len(speaks)) / square[known]))
    power = np.where(speaks, rate * (counts * np.sum(regrets, axis=0) - rate * square), -np.inf)
    return shares(np.exp(power - power.max()))


def naive(past):
    """Return the last value, the straight line through the last two, and the mean."""
    if not len(past):
        return [0.0, 0.0, 0.0]
    return [past[-1], past[-1] if len(past) == 1 else 2 * past[-1] - past[-2], past.mean()]


def oracle(task, y, means, variances):
    """Yield prediction, variance and log density of each sample."""
    M = means.shape[1]
    logs, ratio, behind, width, worth = np.zeros(M), np.ones(M), np.zeros(M), np.ones(4), np.full(4, 0.25)
    regrets, q = [np.zeros(M + 1)], PRIOR.copy()
    across, wide, gaps, across_regrets = np.log(np.r_[np.full(M, 0.01 / M), 1.0]), np.ones(M + 1), 0.0, [np.zeros(3)]
    long, count, gap, asked = task.unit, 0.0, 0, []
    for i in range(len(y)):
        past = y[:i][np.isfinite(y[:i])]
        t, is_next = len(past), gap == 0
        mu, S = np.r_[means[i, :-3], naive(past)], np.r_[variances[i, :-3], task.unit * np.array([1 + gap, 1 + gap, 1])]
        if not is_next and t:  # no further out than y has been, by more than its range
            mu = mu.clip(2 * past.min() - past.max(), 2 * past.max() - past.min())
        moves = np.abs(np.diff(past))
        floor = max(moves[moves > 0].min() ** 2 / 12 if np.any(moves > 0) else 0.0, 1e-12 * task.unit)
        claim = ratio * S
        speaks = claim <= 100 * max(ratio[-1], 1) * S[-1]
        sure = speaks & (claim <= 16 / task.rate * np.maximum(claim, floor)[speaks].min())
        w = np.where(speaks, np.exp(logs - logs[speaks].max()), 0.0)
        w = shares(np.where(w > task.window, w, 0.0))
        precise = w if is_next else shares(w / np.maximum(claim, floor))
        mean = precise @ mu
        said, known = np.r_[mu, mean], np.r_[speaks, True]
        base = max(w @ (np.maximum(claim, floor) + (mu - mean) ** 2), floor)
        if is_next:
            prediction = aggregated(regrets, np.r_[sure, True], task.rate) @ said
        else:
            claimed = np.r_[claim, base]
            trust = shares(known * np.exp(across) / np.maximum(wide * claimed, floor))
            three = np.array([mean, trust @ said, mu[-3]])
            prediction = shares(aggregated(across_regrets, np.ones(3, bool), task.rate) * [0.49, 0.49, 0.02]) @ three
            mean = prediction
        v, e = np.maximum(np.r_[KAPPA * base, RHO * long], floor), y[i] - mean
        density = np.exp(-0.5 * e**2 / v) / np.sqrt(2 * math.pi * v)
        far = np.sort((mu[:-3] - prediction) ** 2)
        told = width * np.maximum(np.r_[[base] * 3, long] + DOUBT * far[3 * (M - 4) // 4], floor)
        variance = worth @ told if is_next else shares(q) @ v
        yield prediction, variance, math.log(shares(q) @ density)
        was_gap, gap = gap > 0, 0 if math.isfinite(y[i]) else gap + 1
        if gap:
            continue

        error = y[i] - prediction
        if is_next and t >= task.settle:
            regrets.append(np.where(known, 2 * error / task.unit * (said - prediction), 0.0))
            z2 = np.minimum(error**2 / told, 1000)
            width = np.maximum(width * (1 + np.array([2, 2, 2, 1]) * (z2 - 1) / task.tails), 0.02)
            asked.append(z2 + np.log(told))
            if t % 4 == 0:
                worth, asked = shares(worth * np.exp(-0.05 * (np.sum(asked, 0) - np.min(np.sum(asked, 0))))), []
        if was_gap:
            across_regrets.append(2 * error / task.unit * (three - prediction))
        if was_gap and y[i] != past[-1]:
            far = (y[i] - said) ** 2 / np.maximum(wide * claimed, floor)
            score = task.rate * (-0.5 * np.log(np.maximum(wide * claimed, floor)) - 3.5 * np.log1p(far / 6))
            across = task.forgetting**3 * (across + score)
            across = np.log((1 - task.share) * shares(np.exp(across - across.max())) + task.share / (M + 1))
            gaps = (1 - 1 / task.memory) * gaps + 1
            wide = np.maximum(wide + wide * (np.minimum(far, 25) - 1) / (gaps + 1), floor / claimed)
        mu = np.r_[means[i, :-3], naive(past)]
        z2 = (y[i] - mu) ** 2 / np.maximum(claim, floor)
        gain = task.rate * (-0.5 * np.log(np.maximum(claim, floor)) - 3.5 * np.log1p(z2 / 6))
        logs = task.forgetting * (logs + gain)
        logs = np.log((1 - task.share) * shares(np.exp(logs - logs.max())) + task.share / M)
        behind = (1 - 1 / task.memory) * behind + 1
        ratio = np.maximum(ratio + (ratio * np.minimum(z2, 25) - ratio) / (behind + 1), floor / S)
        fade = min(1 - 1 / task.tails, 1 - 1 / (10 + 0.1 * t))
        q = fade * q + (1 - fade) * PRIOR + shares(q * density)
        count = 30.0 if t < 60 else 0.999 * count + 1
        long = base if t < 60 else long + (e**2 - long) / (count + 1)


@pytest.mark.parametrize("rate", [1.0, 0.1])
def test_the_average_is_what_its_formulas_say(rate):
    average = dw.ModelAverage(MEMBERS, learning_rate=rate)
    y, u = example(MEMBERS[1], samples=400, missing=0.1)
    u = np.nan_to_num(u)
    y[200:] += 5.0  # a jump: what all were sure of is wrong
    y[300] += 40.0
    trace, columns = average.scan(y, u), [m.scan(y, u if m.model.inputs else None) for m in MEMBERS]
    means, variances = np.full((2, len(y), len(MEMBERS) + 3), np.nan)
    for i, own in enumerate(columns):
        means[:, i], variances[:, i] = own.prediction, own.variance
    expected = np.array(list(oracle(average.task, y, means, variances)))
    np.testing.assert_allclose(trace.prediction, expected[:, 0], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(trace.variance, expected[:, 1], rtol=1e-9)
    seen = np.isfinite(y)
    np.testing.assert_allclose(trace.table[seen, step.SCORE], expected[seen, 2], rtol=1e-8, atol=1e-8)
