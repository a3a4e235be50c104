"""Which structure indices do the data speak for? The evidence of each choice, as `choose_order` for one output."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import Any, cast

import numpy as np

from ..engine import validation
from ..engine.errors import InputError
from ..estimators.joint_mimo.estimator import JointMIMO
from ..memory.constant import Constant
from ..models.noise import EquationError
from ..models.scale import InverseGamma
from .orders import CLOSE, PILOT, SMALLEST, VAGUE, _ratio

MOST = 256  # structures compared at once


@dataclass(frozen=True)
class StructureEvidence:
    """Log evidence of structures on the same samples, most probable first; equally probable beforehand.

    Attributes
    ----------
    structures : list of (p,), structure indices
    log_evidence : (S,), natural logarithms
    largest : the largest index that was tried

    Examples
    --------
    >>> import driftwise as dw
    >>> truth = [-1.2, 0.5, -0.1, 1.0, 0.5, 0.2, -0.8, 0.3, 0.0]
    >>> y, u = dw.models.simulate_mimo((2, 1), truth, samples=400, inputs=1, noise_std=0.1, seed=1)
    >>> dw.analysis.choose_structure(y, u, largest=2).structures[0]
    (2, 1)
    """

    structures: list[tuple[int, ...]]
    log_evidence: np.ndarray
    largest: int

    @property
    def best(self) -> tuple[int, ...]:
        """The most probable structure."""
        return self.structures[0]

    @property
    def probability(self) -> np.ndarray:
        """Posterior probability of each structure."""
        weight = np.exp(self.log_evidence - self.log_evidence[0])
        return weight / weight.sum()

    @property
    def notes(self) -> list[str]:
        """What to beware of, in words; empty where the verdict is plain."""
        found = [f"an index of {self.best} is the largest tried: try more"] if max(self.best) == self.largest else []
        behind = zip(self.structures[1:], self.log_evidence[0] - self.log_evidence[1:])
        near = [f"{nu} (odds {math.exp(d):.1f}:1)" for nu, d in behind if d < math.log(CLOSE)]
        return found + ([f"nearly as probable: {' and '.join(near)}"] if near else [])

    @property
    def words(self) -> str:
        """The verdict in a sentence or two."""
        text = f"structure {self.best}"
        if len(self.structures) > 1:
            odds = math.exp(min(self.log_evidence[0] - self.log_evidence[1], 700.0))
            text += f", odds {_ratio(odds)} against {self.structures[1]}"
        return "; ".join([text, *self.notes])

    def columns(self) -> dict[str, list]:
        """Return structure, log_evidence and probability by name."""
        lists = [c.tolist() for c in (self.log_evidence, self.probability)]
        return {"structure": list(self.structures), "log_evidence": lists[0], "probability": lists[1]}


def choose_structure(
    y,
    u=None,
    largest: int = 3,
    structures=None,
    *,
    direct: bool = False,
    noise: EquationError = EquationError(),
    P0: float = VAGUE,
    memory: Any = Constant(),
) -> StructureEvidence:
    """Return what the record says about the structure indices of its model.

    Parameters
    ----------
    y : (T, p) outputs; NaN where missing
    u : (T,) or (T, k) inputs, optional
    largest : int
        Every structure with indices from 1 to this is tried: largest^p of them, at most 256.
    structures : list of tuples, optional
        The structures to compare, in place of all these.
    direct, memory : as in `JointMIMO`
    noise : EquationError
        With its variance, or without: then each output learns its own.
    P0 : float
        Prior variance of every unknown in units of the data, as in `OrderEvidence`.

    Raises
    ------
    InputError
        Where data or a setting do not fit.

    Notes
    -----
    Same priors and cautions as `OrderEvidence`, where the reasons stand: P0 absolute, and the noise level of each
    output that the largest structure finds in the first 1000 samples, rounded to a power of four, with the weight of
    one sample. Outputs are filtered one by one (split). Bad at: noises that are linked between the outputs, where
    y_1(t) then tells about y_2(t) and a structure with an a0 is preferred for it; colour of the noise; parameters that
    jump; one record of many outputs (the cost is that of so many runs).

    Examples
    --------
    >>> import driftwise as dw
    >>> truth = [-1.2, 0.5, -0.1, 1.0, 0.5, 0.2, -0.8, 0.3, 0.4]
    >>> y, u = dw.models.simulate_mimo((2, 1), truth, samples=400, inputs=1, noise_std=0.3, seed=2)
    >>> choose_structure(y, u, largest=2).best
    (2, 1)
    """
    if np.ndim(y) != 2 or np.shape(y)[1] < 1:
        raise InputError(f"y must be (T, p), a column for each output, got shape {np.shape(y)}")
    if not isinstance(noise, EquationError):
        raise InputError(f"noise must be EquationError() or EquationError(variance), got {noise!r}")
    p, inputs = np.shape(y)[1], 0 if u is None else 1 if np.ndim(u) == 1 else np.shape(u)[-1]
    largest, P0 = validation.count("largest", largest, least=1), validation.positive("P0", P0)
    if structures is None:
        if largest**p > MOST:
            raise InputError(f"{largest}^{p} structures are more than {MOST}: a smaller largest, or list structures")
        structures = list(product(range(1, largest + 1), repeat=p))
    options = dict(direct=direct, memory=memory)
    # what does not fit is said now
    tried = sorted({JointMIMO(nu, inputs, noise=noise, **options).model.nu for nu in structures})
    if not tried:
        raise InputError("structures is empty: which ones shall be compared?")
    if any(len(nu) != p for nu in tried):
        raise InputError(f"y has {p} columns, so a structure lists {p} indices; got {tried}")
    y, u = validation.record(y, u, inputs, p)
    some = np.isfinite(y).any(axis=1)
    start = int(np.argmax(some)) if some.any() else len(y)
    y, u = y[start:], (u[start:] if inputs else None)

    biggest = tuple(max(nu[i] for nu in tried) for i in range(p))
    pilot = y[:PILOT], None if u is None else u[:PILOT]
    scaled = JointMIMO(biggest, inputs, **options).scaled_to(*pilot)
    options |= dict(y_scale=scaled.y_scale, u_scale=scaled.u_scale if inputs else 1.0)
    if noise.variance is None:
        noise = EquationError(cast(Any, _noise_levels(biggest, inputs, *pilot, P0, options)))
        options["scale"] = InverseGamma(0.5, 0.5)
    found = []
    for nu in tried:
        est = _with_prior(nu, inputs, noise, P0, options)
        found.append(est.loglik(est.scan(y, u, keep="innovations").state))
    order = np.argsort([-v for v in found], kind="stable")
    return StructureEvidence([tried[c] for c in order], np.array(found)[order], max(biggest))


def _with_prior(nu, inputs, noise, P0, options) -> JointMIMO:
    """Return the estimator of a structure under the prior that all of them share."""
    est = JointMIMO(nu, inputs, noise=noise, **options)
    units = P0 * est.model.units(est.y_scale, est.u_scale)
    names = [*est.state_names, *est.names]
    return JointMIMO(nu, inputs, noise=noise, P0=dict(zip(names, units.tolist())), **options)


def _noise_levels(nu, inputs, y, u, P0, options) -> np.ndarray:
    """Return the noise variance (p,) of each output that a structure finds in the pilot.

    Again and again, as the prior is relative to the level (`OrderEvidence._noise_level`).
    """
    unit = np.square(options["y_scale"])
    level = np.ones(len(unit))
    while True:
        noise = EquationError(cast(Any, level * unit))
        est = _with_prior(nu, inputs, noise, P0, {**options, "scale": InverseGamma(0.5, 0.5)})
        state = est.scan(y, u, keep="innovations").state
        known = state["observed"] >= 2 * np.array(est.unknowns)
        ratio = np.maximum(level * est.sigma2(state), SMALLEST)
        found = np.where(known, np.minimum(4.0 ** np.round(np.log(ratio) / math.log(4)), level), level)
        if np.all(found == level):
            return level * unit
        level = found
