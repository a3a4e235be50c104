"""What a user says about drift, as the kernel wants it: checked, complete, in units. One function per policy."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..engine import ud, validation
from ..engine.errors import InputError
from ..models.scale import KnownScale
from . import auxiliary, correlation, fuzzy, likelihood, matching, transition, unknown, variational
from .adaptation import LARGEST, Setting, more_than_one, resolve

ROOM = 2.0  # times its prior, the widest variance: a prior of known width is no limit before data come
FADING = 0.995  # per sample, of what sigma^2 rests on: the noise may change, 200 samples of it count


def ground(setting: Setting, phi: Any = 1.0) -> dict[str, Any]:
    """Return the numbers every policy has: see `memory.unknown`."""
    return dict(
        R=setting.R, phi=diagonal(phi, setting.N), cap=ROOM * setting.cap, floor=0.0, moving=setting.moving,
        discount=1.0 if isinstance(setting.scale, KnownScale) else FADING,
    )  # fmt: skip


def diagonal(phi, N: int) -> np.ndarray:
    """Return a diagonal Phi as a vector; raise InputError where a parameter would grow by itself."""
    numbers = validation.each("phi", phi, N)
    if np.any(np.abs(numbers) > 1):
        raise InputError(f"phi is a share that remains, at most 1 in size (the parameters would run away), got {phi!r}")
    return np.where(np.abs(numbers) < 1e-100, 0.0, numbers)


@resolve.register
def resolve_drift(memory: transition.Drift, setting):
    has_q, has_nvr = np.size(memory.q) > 0, np.size(memory.nvr) > 0
    if has_q == has_nvr:
        raise InputError(
            "Drift(phi, q) or Drift(phi, nvr=..) needs its speed, in one of the two: q, variances per sample, or nvr, "
            f"q ms/sigma^2; got q = {memory.q!r} and nvr = {memory.nvr!r}. Is it not known? Some policies learn it"
        )
    N = setting.N
    if np.ndim(memory.phi) == 2 or np.ndim(memory.q) == 2:
        if has_nvr:
            raise InputError("nvr goes with a diagonal phi: say q where phi is a matrix")
        return _coupled(memory, setting)
    if has_nvr:
        nvr = _not_negative("nvr", memory.nvr, N)
        return unknown.Paced(**ground(setting, memory.phi), nvr=nvr), unknown.cells_of(N)
    q = _not_negative("q", memory.q, N) * setting.units
    return transition.Drifting(diagonal(memory.phi, N), q, ROOM * setting.cap), 0


@resolve.register
def resolve_fuzzy_drift(memory: fuzzy.FuzzyDrift, setting):
    levels = _rising("levels", memory.levels, 3, "noise variance ratios, small, medium and large")
    error = _rising("error", memory.error, 2, "where |e|/sqrt(S) begins to be large, and where it wholly is")
    geometric, delayed = (
        validation.yes("geometric", memory.geometric),
        validation.yes("as_published", memory.as_published),
    )
    small, medium, large = np.maximum(levels, 1e-12) if geometric else levels  # a logarithm
    kernel = fuzzy.Fuzzy(
        **ground(setting, memory.phi), small=small, medium=medium, large=large, usual=error[0], alarming=error[1],
        increment=validation.positive("increment", memory.increment),
        geometric=float(geometric), delayed=float(delayed),
    )  # fmt: skip
    return kernel, unknown.cells_of(setting.N, fuzzy.own_cells(setting.N, delayed))


@resolve.register
def resolve_covariance_matching(memory: matching.CovarianceMatching, setting):
    rule = matching.RULES.index(validation.one_of("rule", memory.rule, matching.RULES))
    kernel = matching.Match(**ground(setting, memory.phi), rule=rule, gain=_share("gain", memory.gain))
    return kernel, unknown.cells_of(setting.N, matching.own_cells(setting.N))


@resolve.register
def resolve_auxiliary_filter(memory: auxiliary.AuxiliaryFilter, setting):
    most = validation.positive("most", memory.most)
    kernel = auxiliary.Auxiliary(
        **ground(setting, memory.phi), forgetting=_share("forgetting", memory.forgetting),
        start=validation.positive("start", memory.start), most=most, widest=np.full(setting.N, most**2),
    )  # fmt: skip
    return kernel, unknown.cells_of(setting.N, auxiliary.own_cells(setting.N))


@resolve.register
def resolve_autocovariance_ls(memory: correlation.AutocovarianceLS, setting):
    lags, samples = validation.count("lags", memory.lags, least=1), more_than_one("memory", memory.memory)
    memory_size = unknown.cells_of(setting.N, correlation.own_cells(setting.N, lags))
    if memory_size > LARGEST:
        raise InputError(
            f"{lags} lags of {setting.N} parameters keep {memory_size:.2g} numbers, more than {LARGEST:.0e}: "
            f"take fewer "
            "lags, or LikelihoodDrift(shared=True), which keeps few"
        )
    kernel = correlation.Correlations(
        **ground(setting, memory.phi), learns=learns(setting), lags=lags, samples=samples, prior=setting.cap
    )
    return kernel, memory_size


@resolve.register
def resolve_likelihood_drift(memory: likelihood.LikelihoodDrift, setting):
    least, start, most = (validation.positive(name, getattr(memory, name)) for name in ("least", "start", "most"))
    if not least <= start <= most:
        raise InputError(f"start lies between least and most, got {start!r}, {least!r} and {most!r}")
    ratios = 1 if validation.yes("shared", memory.shared) else setting.N
    kernel = likelihood.Climb(
        **ground(setting, memory.phi), learns=learns(setting), ratios=ratios, start=np.log(start), least=np.log(least),
        most=np.log(most), samples=more_than_one("samples", memory.samples), tau=validation.positive("tau", memory.tau),
        prior=validation.positive("prior", memory.prior),
    )  # fmt: skip
    return kernel, unknown.cells_of(setting.N, likelihood.own_cells(setting.N, ratios))


@resolve.register
def resolve_variational_bayes(memory: variational.VariationalBayes, setting):
    name, nvr = validation.one_of("rule", memory.rule, variational.RULES), validation.positive("nvr", memory.nvr)
    common, weight, chi2 = ground(setting, memory.phi), 0.0, 0.0
    if name != "drift":
        if isinstance(setting.scale, KnownScale):
            raise InputError(
                f"VariationalBayes(rule={name!r}) learns the variance of the noise, and variance=.. says it is known: "
                "leave variance out, add a prior (scale=InverseGamma(alpha, beta)), or take rule='drift'"
            )
        common["discount"], weight, chi2 = variational.FADING[name], 2 * setting.scale.alpha, 2 * setting.scale.beta
    kernel = variational.Nominal(
        **common, rule=variational.RULES.index(name), nvr=nvr, settle=0.0 if weight >= 1 else 6.0 * setting.N,
        weight=weight, chi2=chi2,
    )  # fmt: skip
    return kernel, unknown.cells_of(setting.N, variational.CELLS)


def learns(setting) -> float:
    """Say whether sigma^2 is learnt, as a kernel wants it."""
    return float(not isinstance(setting.scale, KnownScale))


def _rising(name, value, size, meaning) -> np.ndarray:
    numbers = validation.floats(name, value)
    if numbers.shape != (size,) or not np.isfinite(numbers).all() or numbers[0] < 0 or np.any(np.diff(numbers) <= 0):
        raise InputError(f"{name} must be {size} numbers that rise, none negative: {meaning}; got {value!r}")
    return numbers


def _share(name, value) -> float:
    if validation.positive(name, value) > 1:
        raise InputError(f"{name} is a share, above 0 and at most 1, got {value!r}")
    return float(value)


def _coupled(memory, setting):
    """Return the kernel's drift of full matrices."""
    N, root = setting.N, np.sqrt(setting.units)
    phi = np.asarray(memory.phi, float)
    phi = phi if phi.ndim == 2 else np.diag(diagonal(memory.phi, N))
    if phi.shape != (N, N) or not np.isfinite(phi).all():
        raise InputError(f"phi must be a number, {N} numbers or a {N} x {N} matrix, got shape {phi.shape}")
    if max(abs(np.linalg.eigvals(phi))) > 1 + 1e-9:
        raise InputError(f"phi has an eigenvalue outside the unit circle: the parameters would run away; got {phi!r}")
    q = np.asarray(memory.q, float)
    q = q if q.ndim == 2 else np.diag(_not_negative("q", memory.q, N))
    try:
        G, d = ud.factor(validation.covariance("q", q, N))
    except ValueError:
        raise InputError("q must be a covariance: it has a negative eigenvalue") from None
    # in units of the prior: theta = root * theta'
    kernel = transition.Coupled((phi * root[:, None] / root).ravel(), (G * root[:, None]).ravel(), d)
    return kernel, 2 * N * N + 4 * N


def _not_negative(name, value, N) -> np.ndarray:
    numbers = validation.each(name, value, N)
    if np.any(numbers < 0):
        raise InputError(f"{name} must not be negative (it is a variance), got {value!r}")
    return numbers
