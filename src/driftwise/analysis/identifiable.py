"""Which parameters a record can teach at all: Salut's theorem 2 in discrete time."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..engine import validation
from ..engine.errors import InputError
from ..models.canonical import Canonical
from ..models.rows import regression_rows, triangle
from ..models.spectral import inside

ROWS = 20_000  # rows of a run that are looked at
WEAK = 1e-3  # of `Identifiability.worst`, below which there is something to say
ZERO = 1e-9  # a singular value so small beside the largest counts as none


class Direction(NamedTuple):
    """A combination of parameters and how well the record sees it."""

    eigenvalue: float  # of I_r with a unit diagonal: 0 unseen, 1 as well as each parameter alone
    vector: np.ndarray  # change of theta along it, in the order of the names; 1 for the parameter that shows most
    words: str


@dataclass(frozen=True)
class Identifiability:
    """What a record can teach about state and parameters; print `words` first.

    Attributes
    ----------
    names : list of str
        Names of the parameters a1.., b1.., b0: the order of `Direction.vector`.
    rank, unknowns : int
        Rank of the Gramian on [x(t0) ; r], and the number of its rows.
    gramian : (N, N)
        The Gramian O'O, in Salut's order [x_1..x_n ; a_0.., b_0.., b_n].
    parameter_gramian : (m, m)
        I_r, what is left for r alone when x(t0) is unknown (Schur complement), in Salut's order.
    directions : list of Direction
        Combinations of parameters, worst first: an orthogonal set in units of each parameter's own information, the
        unseen ones rewritten with as few names as possible.
    rows, lost_rows : int
        Samples used, and samples left out because they touch a missing value.
    words : str
        The answer in plain words, with the cause where it can be recognised.
    """

    names: list[str]
    rank: int
    unknowns: int
    gramian: np.ndarray
    parameter_gramian: np.ndarray
    directions: list[Direction]
    rows: int
    lost_rows: int
    words: str = field(repr=False)

    @property
    def is_identifiable(self) -> bool:
        """Whether r can be told from the data if there were no noise."""
        return not self.unseen

    @property
    def unseen(self) -> list[Direction]:
        """Directions of r about which the record says nothing."""
        return [d for d in self.directions if d.eigenvalue <= ZERO**2]

    @cached_property
    def worst(self) -> float:
        """Smallest eigenvalue of I_r with a unit diagonal: the graded answer (white input .1, a step .003, none 0)."""
        return self.directions[0].eigenvalue


def identifiability(y, u=None, *, order: int, direct: bool = False, d=None) -> Identifiability:
    """Return which combinations of parameters the record can tell apart, and why not the others.

    Parameters
    ----------
    y : (T,)
        Outputs; NaN where missing (rows that touch one are left out and counted).
    u : (T,) or (T, k), optional
        Inputs; NaN where missing.
    order : int
        Order n of the model.
    direct : bool
        Whether the direct terms b0 are unknowns.
    d : (n,), optional
        Known noise polynomial d_0 .. d_{n-1} (Salut's order): y and u are filtered by 1/C first.

    Returns
    -------
    Identifiability

    Raises
    ------
    InputError
        For shapes that do not fit, zeros of C not inside the circle, or missing samples together with d (a filter
        by 1/C does not get over a gap).

    Notes
    -----
    y(t) is linear in s(t0) = [x(t0) ; r] with rows that need no recursion; their Gramian is that of theorem 2 (Salut
    et al. 1979) in discrete time. Rank is that of the rows with columns of unit length, singular values above 1e-9 of
    the largest; I_r is what remains of the columns of r after projection on those of x(t0).

    What the rank does not say: noise in y makes it full, whatever the input, for the noise itself excites the
    rows. Equally noise-free data of a plant of lower order are rank deficient. For measured records read `worst`: below
    1e-3 or so there is a combination of parameters that is taught a thousand times less than each of them alone.

    Bad at: saying how large the error is (that needs the noise: see `Joint.information_ratio` and
    `cramer_rao_of_record`).

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=50, u=[1.0] * 50)
    >>> found = dw.analysis.identifiability(y, u, order=2)
    >>> found.rank, found.unknowns
    (5, 6)
    >>> print(found.words)
    The record cannot tell apart changes of the parameters along b1 - b2. The input is constant: move it.
    """
    y, u, form = _record(y, u, order, direct)
    n, N = form.n, form.N
    is_complete = not (np.isnan(y).any() or np.isnan(u).any())
    if d is not None:
        d = inside("d", d, n)
        if np.any(d) and not is_complete:
            raise InputError(
                "samples are missing, and filtering by 1/C does not get over a gap: leave d out, or cut out a complete "
                "stretch"
            )
    y_unit, u_units = _units(y[:, None]), _units(u)
    y, u = y / y_unit, u / u_units
    units = np.concatenate([np.ones(n), np.repeat([*y_unit, *u_units], n), u_units[: form.direct_terms]])
    R, G, used = np.zeros((0, N)), np.zeros((N, N)), 0
    for X, target, _ in regression_rows(form, y, u, d):
        X = X[~np.isnan(np.column_stack([X, target])).any(axis=1)]
        used += len(X)
        G += X.T @ X
        R = triangle(R, X)
    if not used:
        raise InputError(f"no row of the record is complete: every {n + 1} samples in a row touch a missing one")
    length = np.sqrt(np.diag(G))
    alive = length > 0
    singular = np.linalg.svd(R[:, alive] / length[alive], compute_uv=False) if alive.any() else np.zeros(0)
    rank = int(np.sum(singular > ZERO * singular[0])) if len(singular) else 0

    Rr = _without_state(R, n, alive)
    directions = _directions(Rr, length[n:], form.names, units[n:])
    back = form.salut
    G, I_r = (
        _of_units(G, units)[np.ix_(back, back)],
        _of_units(Rr.T @ Rr, units[n:])[np.ix_(back[n:] - n, back[n:] - n)],
    )
    found = Identifiability(form.names, rank, N, G, I_r, directions, used, len(y) - used, "")
    return replace(found, words=_words(found, form, y, u))


def taught(estimator, y, u) -> Identifiability | None:
    """Return what the first rows of a record could teach an estimator; None where no row is whole."""
    form = estimator.model
    order = estimator.order
    if not order:
        return _taught_apart(form, u[:ROWS]) if form.inputs + form.constants > 1 else None
    try:
        return identifiability(y[:ROWS], u[:ROWS] if form.inputs else None, order=order, direct=form.direct)
    except InputError:
        return None


def _taught_apart(form, X) -> Identifiability | None:
    """Return how well the regressors of a regression (T, k), and a constant where there is one, are told apart."""
    X = np.column_stack([X, *np.ones((form.constants, len(X)))])
    whole = X[np.isfinite(X).all(axis=1)]
    if len(whole) < form.N:
        return None
    units = _units(whole)
    whole = whole / units
    R, length = triangle(None, whole), np.sqrt((whole * whole).sum(axis=0))
    directions = _directions(R, length, form.names, units)
    rank = sum(d.eigenvalue > ZERO**2 for d in directions)
    G = _of_units(whole.T @ whole, units)
    found = Identifiability(form.names, rank, form.N, G, G, directions, len(whole), len(X) - len(whole), "")
    return replace(found, words=_words(found))


def _units(columns) -> np.ndarray:
    """Return powers of two about as large as the columns: what is divided by them has squares that are numbers."""
    largest = np.abs(np.where(np.isnan(columns), 0.0, columns)).max(axis=0, initial=0.0)
    return np.ldexp(1.0, np.frexp(largest)[1] - 1)


def _of_units(G, units) -> np.ndarray:
    """Return products of columns that were divided by these units; infinite where no number is large enough."""
    with np.errstate(over="ignore", under="ignore"):
        return G * units * units[:, None]


def _record(y, u, order, direct):
    """Return y (T,), u (T, k) and the sizes."""
    order = validation.count("order", order, least=1)
    inputs = 0
    if u is not None:
        try:
            shape = np.shape(u)
        except ValueError:
            shape = ()
        if len(shape) not in (1, 2):
            raise InputError(f"u must be (T,) or (T, k), got shape {shape}")
        inputs = 1 if len(shape) == 1 else shape[1]
    y, u = validation.record(y, u, inputs)
    if not len(y):
        raise InputError("the record is empty")
    return y, u, Canonical(order, inputs, bool(direct) and inputs > 0)


def _without_state(R, n, alive):
    """Triangle of the columns of theta after projection on the live columns of x(t0)."""
    x = np.flatnonzero(alive[:n])
    order = np.concatenate([x, np.arange(n, R.shape[1])])
    return triangle(None, R[:, order])[len(x) :, len(x) :]


def _directions(R, length, names, units):
    """Eigenvectors of R'R with a unit diagonal, smallest eigenvalue first."""
    m = len(names)
    own = np.sqrt((R * R).sum(axis=0))
    live = own > ZERO * length  # less is round-off of what the state explains
    vectors, values = np.zeros((m, m)), np.zeros(m)
    if live.any():
        _, s, V = np.linalg.svd(R[:, live] / own[live], full_matrices=True)
        s = np.concatenate([s, np.zeros(len(V) - len(s))])[::-1]
        s[s <= ZERO * s.max()] = 0.0
        dead = m - len(s)
        values[dead:] = s**2
        vectors[dead:, live] = V[::-1]
    vectors[: m - live.sum(), ~live] = np.eye(m - live.sum())
    unseen = int(np.sum(values == 0))
    vectors[:unseen] = _sparse(vectors[:unseen])
    unit = np.where(live, own, 1.0)  # vectors are in units of each parameter's own information: as large as they show
    out = []
    for value, v in zip(values, vectors):
        change = v / (unit * units)
        change /= change[np.argmax(abs(v) > (1 - 1e-6) * abs(v).max())]  # the first of equals, whatever the rounding
        out.append(Direction(float(value), change, _combination(change, v, names)))
    return out


def _sparse(basis):
    """Rows that span the same space with as few entries as elimination leaves, earliest parameters kept."""
    basis = basis / np.linalg.norm(basis, axis=1, keepdims=True) if len(basis) else basis.copy()
    for row in range(len(basis)):
        rest = abs(basis[row:]).max(axis=0)
        column = np.flatnonzero(rest > 0.3 * rest.max())[0]
        r = np.argmax(abs(basis[row:, column]))
        basis[[row, row + r]] = basis[[row + r, row]]
        basis[row] /= basis[row, column]
        others = np.arange(len(basis)) != row
        basis[others] -= np.outer(basis[others, column], basis[row])
    basis[abs(basis) < 1e-7 * abs(basis).max(axis=1, keepdims=True, initial=0)] = 0.0
    return basis[np.argsort([np.flatnonzero(row)[0] for row in basis])] if len(basis) else basis


def _combination(change, shown, names):
    """Write a direction with the entries that show most, the first one positive."""
    big = sorted(i for i in np.argsort(-abs(shown), kind="stable")[:6] if abs(shown[i]) > 0.05 * abs(shown).max())
    sign = np.sign(change[big[0]])
    parts = []
    for i in big:
        size = f"{abs(change[i]):.2g} " if abs(abs(change[i]) - 1) > 5e-3 else ""
        parts.append(f"{'-' if sign * change[i] < 0 else '+'} {size}{names[i]}")
    return " ".join(parts).removeprefix("+ ")


# --- causes --------------------------------------------------------------------------------------------------


def _words(found, form=None, y=None, u=None):
    unseen = found.unseen
    if not unseen:
        text = "Every combination of the parameters shows in the record."
        if found.worst < 1e-3:
            d = found.directions[0]
            text += f" The weakest is {d.words}, taught {1 / d.eigenvalue:.2g} times less than its parameters alone."
        return text
    along = ", ".join(d.words for d in unseen)
    text = f"The record cannot tell apart changes of the parameters along {along}."
    cause = "" if form is None else _cause(found, form, y, u, unseen)
    return f"{text} {cause}" if cause else text


def _cause(found, form, y, u, unseen):
    """Return what made the record so poor, as far as it can be recognised."""
    n, k = form.n, form.inputs
    if found.rows < found.unknowns:
        return f"{found.rows} usable samples are fewer than the {found.unknowns} unknowns: record more."
    if not np.any(y[~np.isnan(y)]):
        return "The output is zero throughout."
    reasons = []
    for i in range(k):
        name = f"Input {i + 1}" if k > 1 else "The input"
        kind = _kind(u[:, i], 2 * n + form.direct)
        if kind:
            reasons.append(f"{name} is {kind}.")
    touches_a = any(np.any(d.vector[:n]) for d in unseen)
    if touches_a and not np.any(u[~np.isnan(u)]):
        reasons.append(f"The output shows fewer than {n} modes: lower the order, or record with all of them excited.")
    if reasons:
        return " ".join(reasons)
    touches_b = any(np.any(d.vector[n:]) for d in unseen)
    if k and touches_a and touches_b:
        return (
            f"The input is rich enough, but a model of order {n - len(unseen)} explains the record: a pole and a zero "
            "cancel, or the order is too high."
            if len(unseen) <= n
            else "A model of lower order explains the record."
        )
    if touches_b and k > 1:
        return "The inputs move together: vary them independently."
    return ""


def _kind(u, needed):
    """Return what is poor about an input: zero, constant, a sinusoid, or too few frequencies; empty if nothing is."""
    known = u[~np.isnan(u)]
    size = abs(known).max(initial=0)
    if size == 0:
        return "zero: it teaches nothing about b"
    if np.ptp(known) <= ZERO * size:
        return "constant: move it"
    wide = needed + 1
    windows = np.lib.stride_tricks.sliding_window_view(u, wide) if len(u) >= wide else np.zeros((0, wide))
    windows = windows[~np.isnan(windows).any(axis=1)]
    if len(windows) < wide:
        return ""
    singular = np.linalg.svd(triangle(None, windows), compute_uv=False)
    rich = int(np.sum(singular > ZERO * singular[0]))
    if rich >= needed:
        return ""
    if rich == 2:
        middle = windows[:, 1] @ windows[:, 1]
        cosine = (windows[:, 1] @ (windows[:, 0] + windows[:, 2])) / (2 * middle)
        if abs(cosine) < 1:
            return f"a single sinusoid of period {2 * np.pi / np.arccos(cosine):.4g} samples: add other frequencies"
    return f"persistently exciting of order {rich} only, and {needed} are needed: add other frequencies"
