"""What the rest of the package may ask of a model and of an estimator: all that it knows of them."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np

from .base import Step


@runtime_checkable
class Model(Protocol):
    """What makes the regressor, transition and noise of a sample from its own numbers; it knows no memory."""

    @property
    def N(self) -> int:
        """Number of unknowns: states and parameters."""

    @property
    def inputs(self) -> int:
        """Number of inputs."""


@runtime_checkable
class Runs(Protocol):
    """An estimator: one recursion for a sample, a record and a fleet, from a state to a state.

    ``start`` makes a state, or a fleet of them; a state is a record of plain numbers, whose fields are ``dtype``. The
    same samples give the same numbers, bit for bit, whichever way they are fed.
    """

    model: Any
    options: dict[str, Any]
    dtype: np.dtype
    dt: float
    outputs: int | None  # None: y is a number, and (T,); p: it is (p,), and (T, p), also where p is 1
    takes_instants: bool  # whether ``time=`` says when a sample was taken

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them."""

    def update(self, state, y, u=None, *, time: float | None = None) -> tuple[np.ndarray, Step]:
        """Return the next state, and what this sample showed."""

    def scan(self, y, u=None, *, state=None, keep: str = "std", time=None) -> Any:
        """Run over a record and return its trace."""

    def update_batch(self, states, y, u=None, *, time=None) -> tuple[np.ndarray, Step]:
        """Advance a fleet by a sample, or by a stretch of samples, per series."""


@runtime_checkable
class Learns(Runs, Protocol):
    """An estimator of parameters: they have names, a prior, and a model that they make."""

    scale: Any

    @property
    def names(self) -> list[str]:
        """Names of the parameters."""

    def mean(self, state) -> np.ndarray:
        """Return what is unknown, in the user's order."""

    def covariance(self, state) -> np.ndarray:
        """Return its covariance, relative to sigma^2 where that is learnt."""

    def sigma2(self, state) -> Any:
        """Return the scale sigma^2."""

    def loglik(self, state) -> float:
        """Return the evidence."""

    def model_of(self, state) -> Any:
        """Return the model a state amounts to."""

    def scaled_to(self, y, u=None) -> Any:
        """Return the same estimator with its default prior in units of the data."""
