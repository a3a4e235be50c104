"""How fast each parameter drifts, as a memory sees it at the end of a record: numbers and words, read from a state."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...engine import ud
from ...memory import auto, auto_state
from ...memory.bank import open_bank
from ...memory.drift import DriftKernel, DriftMatrixKernel
from ...memory.imm import IMMKernel
from ...memory.modes import WEIGHT, mode
from ...memory.random_walk import RandomWalk
from ...memory.unknown_drift import open_drift_state

EXPLANATIONS = ("still", "fast", "learnt")  # the modes of `AutoMemory`


@dataclass(frozen=True, repr=False)
class Speeds:
    """How fast each parameter drifts: what `drift_of` returns.

    Attributes
    ----------
    names : parameters
    nvr : (N,), variance of a parameter's step per sample, in units of sigma^2 / mean(psi_i^2); NaN where its regressor
        has been nothing but zero
    samples : how many measured samples taught it
    weights : where several speeds compete, the probability of each; of `AutoMemory`: that the parameters stand "still",
    drift
        "fast" (NVR 0.1), or as "learnt" (that is ``nvr``)
    """

    names: list[str]
    nvr: np.ndarray
    samples: int
    weights: dict[str, float] | None = None

    @property
    def memory(self) -> np.ndarray:
        """How many samples each parameter remembers, (N,): 1/sqrt(NVR)."""
        with np.errstate(divide="ignore"):
            return self.nvr**-0.5

    @property
    def is_still(self) -> np.ndarray:
        """Whether each parameter stands still as far as the record can tell: it remembers more than half of it, (N,).

        All do where that explanation is likelier than drift.
        """
        return (self.memory > self.samples / 2) | (self.explanation == "still")

    @property
    def explanation(self) -> str:
        """The likeliest explanation of `AutoMemory`: "still", "fast" or "learnt", which other memories have alone."""
        found = max(self.weights, key=lambda name: (self.weights or {})[name]) if self.weights else "learnt"
        return found if found in EXPLANATIONS else "learnt"

    @property
    def words(self) -> str:
        """The speeds in plain words."""
        if not self.weights or "learnt" not in self.weights:
            return self._said()
        likely = f"({100 * self.weights[self.explanation]:.0f} % likely)"
        if self.explanation == "learnt":
            return f"{self._said()} {likely}"
        if self.explanation == "still":
            return f"no parameter drifts {likely}, or else {self._said()}"
        return f"all parameters forget in about {auto.LEVELS[1] ** -0.5:.1f} samples {likely}, or else {self._said()}"

    def _said(self) -> str:
        """Return the learnt speeds in words."""
        moving, still, unseen = [], [], []
        for name, memory in zip(self.names, self.memory):
            if math.isnan(memory):
                unseen.append(name)
            elif memory > self.samples / 2:
                still.append(name)
            else:
                moving.append(f"{name} in about {memory:.{0 if memory >= 9.5 else 1}f}")
        if len(still) == len(self.names):
            return "no parameter drifts"
        parts = [f"{', '.join(moving)} samples".replace(" in about", " forgets in about", 1)] if moving else []
        parts += [f"{', '.join(still)} stand{'s' * (len(still) == 1)} still"] if still else []
        parts += [f"of {', '.join(unseen)} nothing was seen"] if unseen else []
        return "; ".join(parts)

    def __repr__(self):
        return self.words

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain numbers (NaN and infinity where there is none)."""
        columns = zip(self.names, self.nvr.tolist(), self.memory.tolist(), self.is_still.tolist())
        keys = ("name", "nvr", "memory", "is_still")
        parameters = [dict(zip(keys, row)) for row in columns]
        return {"parameters": parameters, "samples": self.samples, "weights": self.weights, "words": self.words}


def read(est, state, names: list[str]) -> Speeds | None:
    """Return the speeds in a state of a recursive estimator; None where its memory knows of no drift."""
    memory, N = est.policies[2], est.model.N
    if isinstance(memory, RandomWalk | DriftKernel | DriftMatrixKernel):
        return Speeds(names, _by_variance(memory, est, state), int(state["observed"]))
    if not hasattr(memory, "moving"):
        return None
    drift = open_drift_state(np.array(state["memory_state"]), N)
    nvr = np.divide(drift.q, drift.unit, out=np.full(N, np.nan), where=drift.unit > 0)
    return Speeds(names, nvr, int(state["observed"]), _weights(memory, drift.own, N))


def _by_variance(memory, est, state) -> np.ndarray:
    """Return the NVR of steps in the units of theta: a drift known for long leaves a variance of q/sqrt(NVR)."""
    P = np.einsum("ii->i", ud.unpack(np.asarray(state["U"]), np.asarray(state["D"])))
    if isinstance(memory, DriftMatrixKernel):
        G = np.reshape(memory.G, (est.model.N, -1))
        q = G**2 @ memory.d
    else:
        q = memory.q / est.sigma2(state) if isinstance(memory, RandomWalk) and memory.is_absolute else memory.q
    return np.divide(q, P, out=np.zeros(len(P)), where=P > 0) ** 2


def _weights(memory, own, N) -> dict[str, float] | None:
    """Return the probability of each speed of a bank."""
    if not hasattr(memory, "levels"):
        return None
    M = len(memory.levels)
    if isinstance(memory, auto.AutoMemoryKernel):
        names, own = list(EXPLANATIONS), own[auto_state.HEAD :]
    else:
        names = [f"{level:g}" for level in memory.levels]
        if isinstance(memory, IMMKernel) and memory.jumps > 0:
            names[-1] = "jump"
    modes = open_bank(own, N, M).bank
    return {name: float(mode(modes, m, N).own[WEIGHT]) for m, name in enumerate(names)}
