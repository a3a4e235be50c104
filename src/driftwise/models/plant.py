"""A plant that is known, and disturbances of known shape: x' = A x + B u + E q, y = C x + D u + F q, q' = S q."""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy  # scipy.linalg loads where it is used, which is not in `engine.validation`

from ..engine.errors import InputError, brief
from ..engine.validation import HOLDS, count
from .discretise import added

VISIBLE = 1e-9  # smallest singular value of the balanced [A - lambda I; H], relative, at which a mode counts as seen


class _Matrices(NamedTuple):
    A: Any
    B: Any = None
    C: Any = None
    D: Any = None
    states: Any = None
    inputs: Any = None
    outputs: Any = None


class Plant(_Matrices):
    """x' = A x + B u, y = C x + D u in continuous time, as numbers; names are optional.

    Parameters
    ----------
    A : (n, n) state matrix, 1/s
    B : (n, k) input matrix; none without inputs
    C : (p, n) output matrix; the first state is measured if omitted
    D : (p, k) direct terms; none if omitted
    states, inputs, outputs : names, for traces, reports and messages

    Examples
    --------
    >>> motor = Plant([[0, 1], [0, -2]], [0, 3], [1, 0], states=("angle", "speed"))
    """

    __slots__ = ()

    def __new__(cls, A, B=None, C=None, D=None, states=None, inputs=None, outputs=None):
        for name, matrix in zip("ABCD", (A, B, C, D)):
            if callable(matrix) or isinstance(matrix, str | bytes):
                kind = "a function" if callable(matrix) else "text"
                raise InputError(
                    f"{name} must be a matrix of numbers, got {kind}, {brief(repr(str(matrix)))}. A plant that changes "
                    "with its state or with time has no such matrices: take those about the point where it works"
                )
        return super().__new__(cls, A, B, C, D, states, inputs, outputs)


class Polynomial(NamedTuple):
    """A disturbance q that is a polynomial in time of this degree (0: a constant) with unknown coefficients.

    Parameters
    ----------
    into : number or (n,): how q enters each x'; 0 where it disturbs the outputs only
    prior_std : number, or one for each of q, q', .. : standard deviation of what q may be when the estimate begins.
        infinite: nothing is known, it is annihilated; 0: left out. There is no default: too tight a prior makes every
        error bar wrong, silently
    degree : degree of the polynomial
    walk : q's highest derivative also wanders: standard deviation it gains in one second. A window knows none
    outputs : number or (p,): how q enters each output
    name : what it is called; q if omitted

    Examples
    --------
    >>> import driftwise as dw
    >>> drag = dw.models.Polynomial([0, 1], prior_std=2.0, degree=1, name="drag")  # a ramp on the second state
    >>> drag.degree, drag.name
    (1, 'drag')
    """

    into: Any
    prior_std: Any
    degree: int = 0
    walk: float = 0.0
    outputs: Any = 0.0
    name: str | None = None


class Sinusoid(NamedTuple):
    """A disturbance q of known frequency w (rad/s), its amplitude and phase unknown: q_c' = -w q_s, q_s' = w q_c.

    Parameters
    ----------
    w : frequency in rad/s
    into, prior_std, walk, outputs, name : as in `Polynomial`; the prior is the one of q_c, and of q_s

    Examples
    --------
    >>> import driftwise as dw
    >>> hum = dw.models.Sinusoid(w=314.16, into=0, prior_std=1.0, outputs=1.0, name="hum")  # on the output only
    >>> hum.w, hum.name
    (314.16, 'hum')
    """

    w: float
    into: Any
    prior_std: Any
    walk: float = 0.0
    outputs: Any = 0.0
    name: str | None = None


class Augmented:
    """State z = [x; q] of a plant with its disturbances: z' = A z + B u, y = H z + D u, with names and priors.

    Attributes
    ----------
    A (m, m), B (m, k), H (p, m), D (p, k)
    n, inputs, outputs : sizes of x, u, y
    plant, disturbances : what it was made of
    prior_std (m,) : infinite for x
    walk (m,) : standard deviation that each state gains in one second
    names, input_names, output_names
    """

    def __init__(self, plant: Plant, disturbances=()):
        self.plant = plant
        A, B, C, D = self._matrices(plant)
        n, k, p = len(A), B.shape[1], len(C)
        self.n, self.inputs, self.outputs = n, k, p
        self.disturbances = _listed(disturbances)
        shapes, into, seen, priors, walks, names = [], [], [], [], [], []
        for i, q in enumerate(self.disturbances):
            S, walk, own = _shape(q)
            shapes.append(S)
            into.append(np.outer(_column("into", q.into, n, "state"), np.eye(len(S))[0]))
            seen.append(np.outer(_column("outputs", q.outputs, p, "output"), np.eye(len(S))[0]))
            priors.append(_priors(q, len(S)))
            walks.append(walk)
            called = q.name or ("q" if len(self.disturbances) == 1 else f"q{i + 1}")
            names += [f"{called}{end}" for end in own]
            if not np.any(into[-1]) and not np.any(seen[-1]):
                raise InputError(f"{q!r} enters neither a state nor an output: where does it act (into=, outputs=)?")
        m = n + len(names)
        self.A = np.zeros((m, m))
        self.A[:n, :n] = A
        if names:
            self.A[n:, n:] = scipy.linalg.block_diag(*shapes)
            self.A[:n, n:] = np.hstack(into)
        self.B = np.vstack([B, np.zeros((m - n, k))])
        self.H = np.hstack([C, *seen]) if names else C
        self.D = D
        self.prior_std = np.concatenate([np.full(n, np.inf), *priors])
        self.walk = np.concatenate([np.zeros(n), *walks])
        self.names = _names("states", plant.states, n, "x") + names
        if len(set(self.names)) < m:
            raise InputError(f"states and disturbances must have different names, got {self.names}")
        self.input_names = _names("inputs", plant.inputs, k, "u")
        self.output_names = _names("outputs", plant.outputs, p, "y")

    @staticmethod
    def _matrices(plant):
        if not isinstance(plant, Plant):
            is_one = all(hasattr(plant, name) for name in "ABCD") and not isinstance(plant, type)
            cause = ": take its matrices, Plant(sys.A, sys.B, sys.C, sys.D)" if is_one else ""
            raise InputError(f"plant must be Plant(A, B, C, D), got {plant!r}{cause}")
        A = _matrix("A", plant.A, None)
        n = len(A)
        if A.shape != (n, n) or not n:
            raise InputError(f"A must be square, (n, n), got shape {A.shape}")
        B = np.zeros((n, 0)) if plant.B is None else _matrix("B", plant.B, n)
        C = np.eye(1, n) if plant.C is None else _matrix("C", plant.C, n, is_row=True)
        p, k = len(C), B.shape[1]
        D = np.zeros((p, k)) if plant.D is None else _matrix("D", plant.D, p)
        if B.shape[0] != n or C.shape[1] != n or D.shape != (p, k):
            raise InputError(
                f"A {A.shape}, B {B.shape}, C {C.shape} and D {D.shape} do not fit: (n, n), (n, k), (p, n), (p, k)"
            )
        return A, B, C, D

    @property
    def m(self) -> int:
        """Number of states with the disturbances'."""
        return len(self.A)

    @cached_property
    def modes(self) -> np.ndarray:
        """Eigenvalues, 1/s: those of the disturbances exactly, those of the plant next to one of these as that one."""
        own = np.array([0j] + [v for q in self.disturbances for v in _modes(q)])
        found = np.linalg.eigvals(self.A[: self.n, : self.n]).astype(complex)
        near = 1e-6 * max(1e-300, np.abs(found).max(initial=0.0), np.abs(own).max())
        for i, value in enumerate(found):
            j = np.argmin(abs(own - value))
            found[i] = own[j] if abs(own[j] - value) < near else value
        return np.concatenate([found, own[1:]])

    @cached_property
    def hidden(self) -> list[complex]:
        """Modes that no output shows (Popov, Belevitch and Hautus): empty where [x; q] is observable."""
        balanced, (scale, _) = scipy.linalg.matrix_balance(self.A, permute=False, separate=True)
        H = self.H * scale
        size = float(np.linalg.norm(balanced, 2)) or 1.0  # a level that stays: A = 0
        H = H / np.maximum(np.linalg.norm(H, axis=1, keepdims=True), 1e-300) * size
        found: list[complex] = []
        for mode in self.modes:
            if any(abs(mode - other) <= 1e-6 * size for other in found):
                continue
            pencil = np.vstack([balanced - mode * np.eye(self.m), H])
            columns = np.linalg.norm(pencil, axis=0)
            if np.linalg.svd(pencil / np.where(columns > 0, columns, 1), compute_uv=False)[-1] < VISIBLE:
                found.append(complex(mode))
        return found

    def require_observable(self) -> None:
        """Raise `InputError`, naming the mode, where x and the disturbances without a prior cannot be told apart."""
        unknown = [q for q in self.disturbances if np.isinf(_priors(q, len(_modes(q)))).any()]
        hidden = Augmented(self.plant, unknown).hidden
        if hidden:
            told = " and ".join(dict.fromkeys(map(_told, hidden)))
            raise InputError(
                f"{told} cannot be seen in {', '.join(self.output_names)}: state and disturbances "
                f"({', '.join(self.names)}) cannot be told apart. Measure another output, or leave a disturbance out"
            )

    def discretise(self, dt: float, hold: str = "zoh"):
        """Return Phi (m, m), G0 and G1 (m, k): z(t + dt) = Phi z(t) + G0 u(t) + G1 u(t + dt), exact under the hold.

        "zoh": u holds its value from t to t + dt (G1 = 0); "foh": it is a straight line between its samples.
        """
        if hold not in HOLDS:
            raise InputError(f'hold must be "zoh" (u held) or "foh" (straight lines between samples), got {hold!r}')
        m, k = self.m, self.inputs
        M = np.zeros((m + 2 * k, m + 2 * k))
        M[:m, :m], M[:m, m : m + k] = self.A, self.B
        M[m : m + k, m + k :] = np.eye(k) / dt
        E = scipy.linalg.expm(M * dt)
        Phi, whole, slope = E[:m, :m], E[:m, m : m + k], E[:m, m + k :]
        return (Phi, whole, np.zeros_like(whole)) if hold == "zoh" else (Phi, whole - slope, slope)

    def noise(self, dt: float) -> np.ndarray:
        """Return the covariance (m, m) that the walks of the disturbances add in dt seconds (Van Loan, 1978)."""
        return added(self.A, np.diag(self.walk**2), dt)


def _listed(disturbances) -> tuple:
    if isinstance(disturbances, Polynomial | Sinusoid):
        return (disturbances,)
    if not isinstance(disturbances, tuple | list):
        raise InputError(
            f"disturbances must be Polynomial(..), Sinusoid(..), or a list of them (none: ()), got {disturbances!r}"
        )
    return tuple(disturbances)


def _told(mode: complex) -> str:
    if mode == 0:
        return "the constant mode (0)"
    if mode.real == 0:
        return f"the mode at {abs(mode.imag):g} rad/s"
    if mode.imag == 0:
        return f"the mode exp({mode.real:g} t)"
    return f"the mode at {mode.real:g} +- {abs(mode.imag):g}j"


def _matrix(name, value, rows, is_row=False) -> np.ndarray:
    """Return a finite matrix; one-dimensional numbers are a column of ``rows``, or a row where ``is_row``."""
    try:
        found = np.array(value, float)
    except (TypeError, ValueError):
        raise InputError(f"{name} must be a matrix of numbers, got {value!r}") from None
    if found.ndim == 0:
        found = found.reshape(1, 1)
    if found.ndim == 1:
        found = found[None, :] if is_row else found[:, None]
    if found.ndim != 2 or not np.isfinite(found).all():
        raise InputError(f"{name} must be a finite matrix, got {value!r}")
    return found


def _numbers(value) -> np.ndarray:
    """Return an array, NaN where the value is no numbers at all."""
    try:
        return np.array(np.nan if value is None else value, float)
    except (TypeError, ValueError):
        return np.array(np.nan)


def _column(name, value, size, of) -> np.ndarray:
    found = _numbers(value)
    if found.shape not in ((), (size,)) or not np.isfinite(found).all():
        raise InputError(f"{name} must be a finite number, or {size} of them (one for each {of}), got {value!r}")
    if found.ndim == 0 and found and size > 1:
        raise InputError(f"{name} must say how the disturbance enters each {of}: {size} numbers, got {value!r}")
    return np.full(size, found)


def _shape(q):
    """Return S (d, d), the walks (d,) and the endings of the names of a disturbance's states."""
    if isinstance(q, Polynomial):
        g = q.degree
        if isinstance(g, bool) or not isinstance(g, int | np.integer) or g < 0:
            raise InputError(f"degree of a polynomial disturbance must be a whole number of at least 0, got {g!r}")
        count("degree", g)
        return np.eye(g + 1, k=1), _walk(q, np.eye(g + 1)[g]), ["", *("_" + "d" * i for i in range(1, g + 1))]
    if isinstance(q, Sinusoid):
        if not _is_number(q.w) or q.w <= 0:
            what = "; a frequency of 0 is a constant: Polynomial(into, prior_std)" if q.w == 0 else ""
            raise InputError(f"w must be a positive frequency in rad/s, got {q.w!r}{what}")
        return np.array([[0.0, -q.w], [q.w, 0.0]]), _walk(q, np.ones(2)), ["_c", "_s"]
    raise InputError(f"a disturbance must be Polynomial(..) or Sinusoid(..), got {q!r}")


def _walk(q, where) -> np.ndarray:
    if not _is_number(q.walk) or q.walk < 0:
        raise InputError(f"walk must be a finite number of at least 0, got {q.walk!r}")
    return q.walk * where


def _is_number(value) -> bool:
    return isinstance(value, int | float | np.integer | np.floating) and bool(np.isfinite(value))


def _modes(q) -> list[complex]:
    return [0j] * (q.degree + 1) if isinstance(q, Polynomial) else [1j * q.w, -1j * q.w]


def _priors(q, size) -> np.ndarray:
    found = _numbers(q.prior_std)
    fits = found.shape in ((), (size,)) and not np.isnan(found).any() and np.all(found >= 0)
    if not fits:
        raise InputError(
            "prior_std must be stated for each disturbance: at least 0, inf where nothing is known; "
            f"got {q.prior_std!r}"
        )
    if found.ndim == 0 and isinstance(q, Polynomial) and size > 1 and 0 < found < np.inf:
        raise InputError(f"prior_std must be {size} numbers, of q and its derivatives, got {q.prior_std!r}")
    return np.full(size, found)


def _names(what, given, size, letter) -> list[str]:
    if given is None:
        return [letter] if size == 1 and letter != "x" else [f"{letter}{i + 1}" for i in range(size)]
    given = list(given) if isinstance(given, list | tuple) else [given]
    if not all(isinstance(name, str) for name in given) or not len(given) == len(set(given)) == size:
        raise InputError(f"{what} must be {size} different names, got {given!r}")
    return given
