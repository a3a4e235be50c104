"""The design of a restart against golden cases, 50 digits, quadrature and exact sums."""

import json
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import quad

import driftwise as dw
from driftwise.detect import restart

FILE = Path(__file__).parents[1] / "golden" / "perriot.json"
CASES = {case["name"]: case for case in json.loads(FILE.read_text())["cases"]}


def close(got, expected, rtol):
    got, expected = np.asarray(got, float), np.asarray(expected, float)
    return got.shape == expected.shape and np.max(np.abs(got - expected) / np.maximum(np.abs(expected), 1e-3)) <= rtol


def test_golden_energies():
    case = CASES["energy_terms"]
    rows = [dict(zip(case["input"], row)) for row in zip(*case["input"].values())]
    got = {
        "E_jump": [restart.energy_of_jump(r["dtheta"], r["T0"], r["N0"], r["F"]) for r in rows],
        "V": [restart.energy_of_noise(r["T1"], r["N0"], r["F"], r["G"]) for r in rows],
        "var": [restart.variance_after(r["T0"], r["N0"], r["F"], r["G"]) for r in rows],
        "E_FA": [
            2 * restart.energy_of_noise(r["T1"], r["N0"], r["F"], r["G"])
            - restart.energy_of_noise(2 * r["T1"], r["N0"], r["F"], r["G"])
            for r in rows
        ],
    }
    for key, values in got.items():
        assert close(values, case["expected"][key], case["rtol"]), key


def test_golden_restart_length():
    case = CASES["N0_bayes"]
    got = [restart.restart_length(d, G) for d, G in zip(case["input"]["dtheta"], case["input"]["G"])]
    assert close(got, case["expected"]["N0"], case["rtol"])


def test_golden_design():
    case = CASES["optimal_h_N0_corrected_J"]
    for args, (h, N0, J) in zip(case["input"]["args"], case["expected"]["h_N0_J"]):
        design = dw.detect.design_restart(*args, bounds=case["input"]["bounds"])
        assert close(design.criterion, J, case["rtol"])
        assert close([design.threshold, design.restart], [h, N0], 1e-4)
        assert not design.at_bound


def test_golden_printed_criterion_has_no_minimum():
    case = CASES["J_paper_unbounded_below"]
    given = case["input"]
    got = [restart.printed_criterion(h, N0, given["dtheta"], given["T0"]) for h, N0 in given["points"]]
    assert close(got, case["expected"]["J"], case["rtol"])
    assert got[1] < 50 * got[0] < 0


@pytest.mark.parametrize("F", [-3.0, -1.0, -0.500001, -0.5, -0.4999999999, -0.3, -1e-9])
@pytest.mark.parametrize("horizon, N0", [(1e-6, 2.0), (1.0, 1e6), (500.0, 26.5), (1e9, 0.5)])
def test_energies_over_wide_ranges(F, horizon, N0):
    with mp.workdps(50):
        b, L = -1 - 2 * mp.mpf(F), mp.log1p(mp.mpf(horizon) / N0)
        phi = -mp.expm1(-b * L) / b if b else L
        V = (L - phi) / b if b else L**2 / 2
        expected = [float(v) for v in (N0 * phi, phi / (horizon + mp.mpf(N0)), V)]
    got = [restart.energy_of_jump(1.0, horizon, N0, F), restart.variance_after(horizon, N0, F)]
    got.append(restart.energy_of_noise(horizon, N0, F))
    assert got == pytest.approx(expected, rel=1e-13)


def test_energies_are_integrals():
    F, N0, T = -0.8, 15.0, 120.0
    assert restart.energy_of_jump(0.5, T, N0, F) == pytest.approx(
        quad(lambda s: 0.25 * (N0 / (s + N0)) ** (-2 * F), 0, T)[0], rel=1e-10
    )
    # d Var = 2 F Var/(t + N0) dt + G^2/(t + N0)^2 dt, integrated by variation of constants
    variance = lambda s: 4 * (s + N0) ** (2 * F) * quad(lambda t: (t + N0) ** (-2 - 2 * F), 0, s)[0]  # noqa: E731
    assert restart.variance_after(T, N0, F, 2.0) == pytest.approx(variance(T), rel=1e-10)
    assert restart.energy_of_noise(T, N0, F, 2.0) == pytest.approx(quad(variance, 0, T)[0], rel=1e-9)


def test_discrete_sum():
    """An estimate with gains 1/N0, 1/(N0 + 1), .. after a jump, without noise: the sum of its squared errors."""
    for N0, exact in ((6, 0.179), (26.5, 0.951)):
        error, total = 0.2, 0.0
        for k in range(500):
            error -= error / (N0 + k)
            total += error**2
        assert restart.energy_of_jump_exact(0.2, 500, N0) == pytest.approx(total, rel=1e-12)
        assert total == pytest.approx(exact, abs=6e-4)
    assert restart.energy_of_jump(0.2, 500, 5.5) == pytest.approx(0.218, abs=6e-4)


def test_design_of_the_plates():
    """(11.2, 46) for increases, (9.0, 95) for decreases, from the means of the signal."""
    up, down = (dw.detect.design_restart(0.2, 500, std=1 / 0.99, mean=mean) for mean in (0.3119, 0.1369))
    assert (round(up.threshold, 1), round(up.restart)) == (11.2, 46)
    assert (round(down.threshold, 1), round(down.restart)) == (9.0, 95)
    assert up.closed_form == pytest.approx(26.5, abs=0.05)
    assert up.words.startswith("threshold 11.2, restart at gain 1/45.9: a false alarm every 405 samples")


def test_design_is_a_minimum_and_follows_the_scale():
    one, scaled = dw.detect.design_restart(0.7, 300), dw.detect.design_restart(700.0, 300, std=1000.0)
    assert scaled.threshold == pytest.approx(1000 * one.threshold, rel=1e-6)
    assert scaled.restart == pytest.approx(one.restart, rel=1e-6)
    assert scaled.criterion == pytest.approx(1e6 * one.criterion, rel=1e-10)
    for h, N0 in ((0.9, 1.0), (1.1, 1.0), (1.0, 0.9), (1.0, 1.1)):
        assert restart._criterion(one.threshold * h, one.restart * N0, 0.7, 300, -1, 0.35, 0.7) > one.criterion


def test_restart_rests_on_its_bound_at_large_jumps():
    design = dw.detect.design_restart(2.0, 500)
    assert design.at_bound and design.restart == pytest.approx(1.0) and "bound" in design.words
    assert design.threshold == pytest.approx(3.05, abs=0.01)


@pytest.mark.parametrize(
    "settings, word",
    [
        (dict(jump=-1.0), "jump"),
        (dict(every=0), "every"),
        (dict(F=0.5), "F must be negative"),
        (dict(std=np.nan), "std"),
        (dict(reference=2.0), "above reference"),
        (dict(bounds=((2.0, 1.0), (1.0, 400.0))), "bounds"),
        (dict(bounds=(3.0, 4.0)), "bounds"),
    ],
)
def test_bad_settings_are_refused(settings, word):
    with pytest.raises(dw.InputError, match=word):
        dw.detect.design_restart(**{"jump": 1.0, "every": 500, **settings})
