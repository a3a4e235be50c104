"""A model of a user's own: regressors with a setting and a register, everything else from the step of `ARX`."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pytest

import driftwise as dw
from driftwise.engine.errors import InputError
from driftwise.estimators.arx.recursive import Recursive
from driftwise.estimators.arx.row import Lags, lags, regress, renew
from driftwise.estimators.arx.step import steps_like_lags
from driftwise.models.equation import Equation
from driftwise.results.snapshot import describe, rebuild


@dataclass(frozen=True)
class Wave(Equation):
    """y = c cos(step t) + s sin(step t) + e."""

    N = 2
    names = ("c", "s")


@steps_like_lags
class WaveLags(NamedTuple):
    """No lags; the register is the phase."""

    step: float


@regress.on(WaveLags)
def regress_wave(form, state, scratch, s2):
    psi, phase = scratch.psi, state.registers[0]
    psi[0], psi[1] = math.cos(phase), math.sin(phase)
    return psi[0] * state.theta[0] + psi[1] * state.theta[1], 0.0


@renew.on(WaveLags)
def renew_wave(form, state, scratch, y, y_variance, e, T):
    state.registers[0] += form.step
    return 0


class Sinusoid(Recursive):
    """A sinusoid of a known step of its phase."""

    def __init__(self, step=0.5, **options):
        super().__init__(**options)
        self.options = {"step": step} | self.options
        self.model = Wave(0)
        self._prepare(lags(self.model, WaveLags, registers=1, step=step))

    def _theta_units(self):
        return np.full(2, self.y_scale**2)


T = np.arange(200)
PHI = np.column_stack([np.cos(0.7 * T), np.sin(0.7 * T)])
Y = PHI @ [1.0, 2.0] + 0.1 * np.random.default_rng(1).standard_normal(200)


def test_a_form_has_the_fields_of_lags_before_its_own():
    assert WaveLags._fields == (*Lags._fields, "step")


def test_it_equals_least_squares_with_gaps():
    y = np.where(T % 7 == 3, np.nan, Y)
    found = Sinusoid(0.7, P0=1e12).scan(y)
    there = np.isfinite(y)
    np.testing.assert_allclose(found.parameters[-1], np.linalg.lstsq(PHI[there], y[there], rcond=None)[0], atol=1e-9)


def test_it_is_written_down_under_its_name():
    est = Sinusoid(0.7, memory=dw.RandomWalk(1e-4))
    again = rebuild(describe(est))
    assert type(again) is Sinusoid and describe(again) == describe(est)
    with pytest.raises(TypeError, match="windw"):
        Sinusoid(0.7, windw=3)


def test_predict_says_what_to_do_instead():
    est = Sinusoid(0.7)
    with pytest.raises(InputError, match="Sinusoid has no predict"):
        est.predict(est.start(), horizon=3)


def test_laws():
    dw.check_estimator(Sinusoid(0.7))
