"""A linear system as its user wrote it: x+ = F x + G u + w, y = H x + D u + v, checked and in full."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from ..engine import ud, validation
from ..engine.errors import InputError
from ..engine.validation import floats
from .discretise import added, held
from .plant import _names

STATES = 200  # that a system may have: what is known of them is a matrix
SEEN = 1e-9  # smallest share of the largest singular value at which a direction counts as seen


class LinearSystem:
    """The matrices of one step, (n, n), (n, k), (p, n), (p, k), (n, n) and (p, p), with the names of what they link.

    Attributes
    ----------
    F, G, H, D, Q, R : the matrices
    n, inputs, outputs : sizes of x, u, y
    names, input_names, output_names
    """

    def __init__(self, F, G, H, D, Q, R, states=None, inputs=None, outputs=None):
        self.F = square("F", F)
        n = self.n = len(self.F)
        self.G = np.zeros((n, 0)) if G is None else self.written("G", "G", G)
        self.H = self._outputs_of(np.eye(1, n) if H is None else floats("H", H))
        k, p = self.inputs, self.outputs = self.G.shape[1], len(self.H)
        self.D = np.zeros((p, k)) if D is None else self._direct(D)
        self.Q, self.R = self.written("Q", "Q", Q), noise("R", R, p, "output")
        self.names = _names("states", states, n, "x")
        self.input_names, self.output_names = _names("inputs", inputs, k, "u"), _names("outputs", outputs, p, "y")

    def written(self, name: str, said: str, value) -> np.ndarray:
        """Return F, G or Q in full, however it was written; ``said`` is what to call it where it does not fit."""
        if name == "F":
            return square(said, value)
        if name == "G":
            return _matrix(said, value, self.n, "one row for each state, one column an input")
        return noise(said, value, self.n, "state")

    def sampled(self, dt: float) -> LinearSystem:
        """Return what x' = F x + G u + w, w of spectral density Q, is over dt seconds with its inputs held."""
        F, step = held(self.F, self.G, dt)
        G, D = (step, self.D) if self.inputs else (None, None)
        Q, names = added(self.F, self.Q, dt), (self.names, self.input_names, self.output_names)
        return LinearSystem(F, G, self.H, D, Q, self.R, *names)

    def _outputs_of(self, H) -> np.ndarray:
        H = H[None, :] if H.ndim == 1 else H
        if H.ndim != 2 or H.shape[1] != self.n or not len(H):
            said = f"H must be (p, {self.n}), a row for each output and a column for each of the {self.n} states of F"
            raise InputError(f"{said}, got shape {H.shape}{'. Is it transposed?' if H.shape[:1] == (self.n,) else ''}")
        return finite("H", H)

    def _direct(self, D) -> np.ndarray:
        if not self.inputs:
            raise InputError("D says how inputs act on outputs at once, and without G there are no inputs: give G too")
        given, shape = floats("D", D), (self.outputs, self.inputs)
        found = given.reshape(shape) if given.ndim < 2 and given.size == shape[0] * shape[1] else given
        if found.shape != shape:
            raise InputError(f"D must be {shape}, a row for each output and a column for each input, got {given.shape}")
        return finite("D", found)

    @property
    def m(self) -> int:
        """Number of states: there are no disturbances apart from w."""
        return self.n

    def discretise(self, dt: float, hold: str = "zoh"):
        """Return F, G0 and G1 of one step, as of an `Augmented` plant: u is held, so G1 = 0."""
        return self.F, self.G, np.zeros_like(self.G)

    @cached_property
    def reach(self) -> np.ndarray:
        """How much of each state some output shows within n steps, (p, n): the largest |H F^i| of each entry."""
        F, rows = self.F, self.H.copy()
        found = np.abs(rows)
        for _ in range(self.n - 1):
            rows = rows @ F
            size = np.abs(rows).max(initial=0.0)
            rows = rows / size if size > 1e100 else rows  # a fast mode: what counts is that it is seen
            found = np.maximum(found, np.abs(rows))
        return found

    @cached_property
    def hidden(self) -> list[str]:
        """Names of the states of which no output ever shows anything by itself: empty where (F, H) is observable."""
        size = np.abs(self.F).max(initial=0.0) or 1.0
        F, rows, stack = self.F / size, self.H, []
        for _ in range(self.n):
            lengths = np.linalg.norm(rows, axis=1, keepdims=True)
            rows = rows / np.where(lengths > 0, lengths, 1.0)
            stack.append(rows)
            rows = rows @ F
        _, s, V = np.linalg.svd(np.concatenate(stack))
        rank = int(np.count_nonzero(s > SEEN * s[0])) if s[0] > 0 else 0
        share = np.linalg.norm(V[rank:], axis=0)
        return [name for name, part in zip(self.names, share) if part > 1e-6]

    @property
    def notes(self) -> list[str]:
        """What to know of the system before it is believed, in sentences."""
        if not self.hidden:
            return []
        seen = ", ".join(self.output_names)
        return [
            f"{', '.join(self.hidden)} cannot be told from {seen}, however long the record (F, H is not observable): "
            "what is said of it comes from x0, P0 and Q alone. Measure another output, or leave the state out."
        ]


# --- matrices, checked ---------------------------------------------------------------------------------------


def finite(name: str, value: np.ndarray) -> np.ndarray:
    """Return a matrix without NaN and infinities."""
    bad = np.argwhere(~np.isfinite(value))
    if len(bad):
        where = tuple(bad[0].tolist())
        raise InputError(
            f"{name}{list(where)} is {value[where]}: a matrix has numbers only. NaN marks what is missing in y and u, "
            "never in the model; was something divided by zero?"
        )
    return value.copy()


def square(name: str, value) -> np.ndarray:
    """Return a finite square matrix; a number is one of a single state."""
    found = floats(name, value)
    found = found.reshape(1, 1) if found.ndim == 0 else found
    if found.ndim != 2 or found.shape[0] != found.shape[1] or not found.size:
        raise InputError(f"{name} must be square, (n, n), a row and a column for each state, got shape {found.shape}")
    if len(found) > STATES:
        raise InputError(f"{name} has {len(found)} states, and at most {STATES} are taken. Was a record given?")
    return finite(name, found)


def _matrix(name: str, value, rows: int, what: str) -> np.ndarray:
    found = floats(name, value)
    if found.ndim < 2 and found.size == rows:
        found = found.reshape(rows, 1)
    if found.ndim != 2 or found.shape[0] != rows or not found.shape[1]:
        raise InputError(f"{name} must be ({rows}, k), {what}, got shape {found.shape}")
    return finite(name, found)


def noise(name: str, value, size: int, what: str) -> np.ndarray:
    """Return a covariance (size, size): symmetric, no negative eigenvalue; from a number, its diagonal, or itself."""
    if value is None:
        raise InputError(f"{name} must be given, the covariance of the {what} noise: how could it be known otherwise?")
    given = floats(name, value)
    if given.shape not in ((), (size,), (size, size)):
        raise InputError(
            f"{name} must be a variance, ({size},) or ({size}, {size}), as there are {size} {what}s; "
            f"got shape {given.shape}"
        )
    full = np.diag(np.broadcast_to(given, (size,))) if given.ndim < 2 else given
    return non_negative(name, validation.covariance(name, finite(name, full), size))


def non_negative(name: str, full: np.ndarray) -> np.ndarray:
    """Return a symmetric matrix that is a covariance."""
    try:
        ud.factor(full)
    except ValueError:
        least = float(np.linalg.eigvalsh(full)[0])
        raise InputError(
            f"{name} must be a covariance, and it has the negative eigenvalue {least:.3g}: two of its parts are more "
            "than fully correlated. Are standard deviations where variances belong?"
        ) from None
    return full


def units(system: LinearSystem, y_scale: Any) -> np.ndarray:
    """Return squared units of each state: those in which n steps of it would show as y_scale in some output."""
    reach = system.reach / np.asarray(y_scale, float)[:, None]
    most = reach.max(axis=0)
    return np.where(most > 0, 1 / np.where(most > 0, most, 1.0), 1.0) ** 2
