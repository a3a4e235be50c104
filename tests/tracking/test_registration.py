"""Biases of sensors: within their bars on drawn skies, taken off, told in words."""

import json

import numpy as np
import pytest
from driftwise_studies.score.motions import registering

import driftwise as dw
from driftwise.tracking.registration import Registration, _through, register


def test_biases_of_drawn_radars_lie_within_their_bars():
    z, gains = [], []
    for number in (1, 4):
        sky = registering.draw(5, number)
        some = sky.plots[: 1500 * len(sky.sensors)]
        found = Registration(sky.sensors, sky.sites, origin=registering.ORIGIN, reference=sky.reference)
        for first in range(0, len(some), 300):  # on-line
            found.feed(some[first : first + 300])
        truth = np.array([sky.truth[name] for name in sky.truth])
        told = np.array([(b.first, b.second, b.clock) for name, b in found.biases.items() if name in sky.truth])
        sd = np.array([(b.first_sd, b.second_sd, b.clock_sd) for n, b in found.biases.items() if n in sky.truth])
        free = sd > 0
        z += list((told - truth)[free] / sd[free])
        gains.append(np.median(np.abs(told - truth)[free] / np.abs(truth)[free]))
        assert found.used > 100
    assert np.mean(np.abs(z) < 2) > 0.85 and np.max(np.abs(z)) < 4, z
    assert np.median(gains) < 0.3


def test_what_is_taken_off_brings_sensors_together(call, tmp_path):
    """More than half of the error of a track goes when a clock .5 s late and 150 m are known; the words say both."""
    rng, t = np.random.default_rng(1), np.arange(0.0, 900.0)
    path = 9000 * np.stack([np.sin(t / 60), np.cos(t / 60)], axis=1)
    a, b = slice(0, None, 4), slice(2, None, 5)
    time = np.concatenate([t[a], t[b] + 0.5]) + 1.7e9
    position = np.concatenate([path[a], path[b] + [150, 80]]) + 20 * rng.standard_normal((405, 2))
    who = ["A"] * 225 + ["B"] * 180
    rows = sorted(
        f"{when:.2f},{east:.2f},{north:.2f},AB12,{name}" for when, (east, north), name in zip(time, position, who)
    )
    (tmp_path / "two.csv").write_text("\n".join(["time,east,north,icao24,sensor", *rows]) + "\n")
    code, out, err = call("track", tmp_path / "two.csv", "--register", "--json", tmp_path / "told.json")
    said = " ".join(out.split())
    assert (
        (code, err) == (0, "")
        and "B puts objects 1" in said
        and "B has a clock 0." in said
        and "late, beside A." in said
    )
    told = json.loads((tmp_path / "told.json").read_text())["biases"]["B"]
    assert abs(told["clock"] - 0.5) < 3 * told["clock_sd"] < 0.1
    seen = dw.tracking.read.read_plots(tmp_path / "two.csv")
    fixed = register(seen, reference="A").corrected(seen)
    errors = []
    for some in (seen, fixed):
        trace = dw.track(some)[0].trace
        at = np.interp(trace.time - 1.7e9, t, path[:, 0]), np.interp(trace.time - 1.7e9, t, path[:, 1])
        errors.append(np.sqrt(np.mean((trace.position - np.stack(at, axis=1))[20:] ** 2)))
    assert errors[1] < 0.5 * errors[0], errors


def test_a_cubic_goes_through_four_plots():
    cubic = np.polynomial.Polynomial([1.0, -2.0, 0.3, 0.05])
    path = [(t, np.array([cubic(t), 2 * cubic(t)]), 1.0) for t in (0.0, 1.0, 2.5, 4.0)]
    place, weights = _through(path, 1.7)
    np.testing.assert_allclose(place, [cubic(1.7), 2 * cubic(1.7)], rtol=1e-12)
    assert abs(weights.sum() - 1) < 1e-12


def test_says_no_in_words():
    for options, words in (
        ((["A"],), "two sensors"),
        ((["A", "B"], "A=1,2,0"), "SAC/SIC"),
        ((["1/1", "1/2"], "1/1=1,2,0"), "origin"),
    ):
        with pytest.raises(dw.InputError, match=words):
            Registration(*options)
    with pytest.raises(dw.InputError, match="reference"):
        Registration(["A", "B"], reference="C")
