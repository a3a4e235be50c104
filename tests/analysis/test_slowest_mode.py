"""A plant whose slowest mode alone becomes faster or slower: its slopes, and what is told of it."""

import numpy as np
import pytest
from slopes import check_slopes

from driftwise.analysis.change_effects import SLOWEST, SPEED, effects, scanner, ways
from driftwise.analysis.change_log import ChangeLog, moved
from driftwise.analysis.change_places import beside_all
from driftwise.analysis.response_orders import begin
from driftwise.analysis.response_record import recorded
from driftwise.analysis.segmentation import hindsight
from driftwise.analysis.speeds import slowed

FAST, SLOW, AT = 0.75, 0.95, 450


def slowing(seed: int, factor: float, samples: int = 900):
    """Return y, u of two modes one after the other, the slower of which takes ``factor`` times as long from 450 on."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0], samples // 15), 15)
    x, z = np.zeros(samples), np.zeros(samples)
    for t in range(1, samples):
        a = SLOW ** (1 / factor) if t >= AT else SLOW
        x[t] = FAST * x[t - 1] + (1 - FAST) * u[t - 1]
        z[t] = a * z[t - 1] + (1 - a) * x[t]
    return 5 + z + 0.01 * rng.standard_normal(samples), u[:, None]


@pytest.mark.parametrize("factor", [1.8, 0.5])
def test_the_slowest_mode_alone_is_one_change_of_its_size(factor):
    """As a change of all modes it was too small by half, with gains beside it."""
    seen = hindsight(*slowing(1, factor))
    (jump,) = seen.jumps()
    assert jump.kind == SPEED and jump.is_alone and abs(jump.at - AT) < 10
    assert jump.after == pytest.approx(factor, rel=0.1)


def test_words_say_whether_it_is_the_slowest_alone():
    (jump,) = hindsight(*slowing(2, 1.8)).jumps()
    assert moved(jump, ["valve"]).startswith("the plant became slower, its slowest time constant 1.")
    log = ChangeLog(["valve"])
    log.add(*slowing(2, 1.8), np.arange(900.0))
    assert log.changes[0].moved.startswith("the plant became slower: 63 % of the answer to a step of valve took ")


def test_slopes_are_those_of_differences_and_the_scan_is_that_of_each_place():
    bare = begin(recorded(*slowing(3, 1.4))[0])
    assert (SPEED, SLOWEST) in ways(bare)
    r, places = beside_all(bare), np.array([200, 450, 600])
    for at, value in zip(places, scanner(bare, SPEED, SLOWEST, r)(places)):
        d = effects(bare, SPEED, SLOWEST, [at])[0][0] * bare.weight
        d -= bare.basis @ (bare.basis.T @ d)
        assert value == pytest.approx(0.5 * (d @ r) ** 2 / (d @ d), rel=1e-6)
    now = bare.with_speed(300, 0.2, is_alone=True).with_speed(600, -0.3, is_alone=True)
    check_slopes(now)


def test_a_slowest_pair_moves_as_one_and_others_stay():
    pair = 0.95 * np.exp(np.array([0.2j, -0.2j]))
    found = np.roots(slowed(np.real(np.poly([*pair, 0.5])), np.log(2.0), is_alone=True))
    assert sorted(abs(found)) == pytest.approx([0.5, np.sqrt(0.95), np.sqrt(0.95)])
    assert max(np.angle(found)) == pytest.approx(0.1)
