"""A polynomial model out: poles, gains, noise model, state space, and how sure they are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any

import numpy as np

from ..engine.errors import InputError
from .canonical import Canonical
from .convert import Model
from .family import Family
from .roots import Roots, WithPoles, drawn, estimate, order, spread


@dataclass(frozen=True)
class PolynomialModel(WithPoles):
    """A(q) y = sum B_l/F_l u_l + offset + C/D e, with the covariance of its coefficients; reads like a `Model`.

    Each channel B_l/(A F_l) is a `Model` of its own, whose coefficients are products: theirs is first order (the
    products are exact, each coefficient enters linearly). Poles are those of A and of every F, each from its own
    coefficients, so that a pole shared by two factors stays sharp.

    Bad at: what `Model` is bad at; and factors that share a root (no data tell A from F then).

    Parameters
    ----------
    family : Family
        Orders and delays.
    values, covariance : (m,), (m, m)
        Coefficients in the order of ``names``.
    dt : float
        Seconds between samples.
    noise_std : float
        Standard deviation of e, in units of y.

    Examples
    --------
    >>> import numpy as np
    >>> from driftwise.models.family import Family
    >>> m = PolynomialModel(Family(0, (1,), (1,), nc=1, nf=(1,)), np.array([1.0, 0.5, -0.8]), 1e-4 * np.eye(3))
    >>> print(m)
    y(t) = B(q)/F(q) u(t) + C(q) e(t)
    B(q) = 1 (± 0.01) q^-1
    C(q) = 1 + 0.5 (± 0.01) q^-1
    F(q) = 1 - 0.8 (± 0.01) q^-1
    >>> m.poles.real.tolist(), m.dc_gain.round(3).tolist(), m.noise_model.zeros().real.tolist()
    ([0.8], [5.0], [-0.5])
    """

    family: Family
    values: np.ndarray  # in the order of ``names``
    covariance: np.ndarray
    dt: float = 1.0
    noise_std: float = float("nan")  # of e

    @property
    def names(self) -> list[str]:
        """Names of the coefficients."""
        return self.family.names

    @cached_property
    def _factors(self):
        return self.family.split(self.values)

    def _embed(self, parts, inputs: int, direct: bool) -> Model:
        """Return the `Model` of denominator and numerators (k, ..) = parts(A, B, C, D, F)."""
        den, nums = parts(*self._factors)
        n = max(len(p) for p in (den, *nums)) - 1
        form = Canonical(max(n, 1), inputs, direct)

        def numbers(theta):
            den, nums = parts(*self.family.split(theta))
            a, B = np.zeros(form.n), np.zeros((inputs, form.n + 1))
            a[: len(den) - 1] = den[1:]
            for row, num in zip(B, nums):
                row[: len(num)] = num
            return np.concatenate([a, B[:, 1:].ravel(), B[:, 0] if form.direct else []])

        at = numbers(self.values)
        J = np.array([numbers(self.values + step) - at for step in np.eye(len(self.values))]).T
        return Model(form, at, J @ self.covariance @ J.T, self.dt)

    def channel(self, input: int = 0) -> Model:
        """Return B_l/(A F_l), from one input to the output, as a `Model`."""
        if isinstance(input, bool) or input not in range(self.family.inputs):
            raise InputError(f"input must be one of 0 to {self.family.inputs - 1}, got {input!r}; they count from 0")
        return self._channels[input]

    @cached_property
    def _channels(self) -> list[Model]:
        return [
            self._embed(lambda A, B, C, D, F: (np.convolve(A, F[l]), [B[l]]), 1, self.family.nk[l] == 0)
            for l in range(self.family.inputs)
        ]

    @cached_property
    def common(self) -> Model:
        """All channels over one denominator, A times every F, as a `Model`."""
        return self._embed(
            lambda A, B, C, D, F: (product(A, *F), _numerators(B, F)), self.family.inputs, self.family.direct
        )

    @cached_property
    def noise_model(self) -> Model:
        """C/(A D), from e to the output, as a `Model` with one input e; its direct term is exactly one."""
        return self._embed(lambda A, B, C, D, F: (np.convolve(A, D), [C]), 1, True)

    @cached_property
    def _with_noise(self) -> Model:
        def parts(A, B, C, D, F):
            return product(A, D, *F), [*(np.convolve(D, b) for b in _numerators(B, F)), product(C, *F)]

        return self._embed(parts, self.family.inputs + 1, True)

    @property
    def form(self) -> Canonical:
        """Form of `common`."""
        return self.common.form

    @property
    def samples(self) -> np.ndarray:
        """Coefficients of `common` drawn from their posterior with a fixed seed."""
        return self.common.samples

    # --- poles, zeros, gains: as for `Model` ---------------------------------------------------------------

    @cached_property
    def _poles(self) -> Roots:
        rng, found, slopes = np.random.default_rng(0), [], []
        first = [0, *(self.family.plain + self.family.nc + self.family.nd + sum(self.family.nf[:l])
                      for l in range(self.family.inputs))]  # fmt: skip
        for start, size in zip(first, (self.family.na, *self.family.nf)):
            P = np.zeros((size + 1, size + 1))
            P[1:, 1:] = self.covariance[start : start + size, start : start + size]
            c = np.insert(self.values[start : start + size], 0, 1.0)

            def draws(c=c, P=P):
                return drawn(c, P, rng)

            if size:
                found.append(estimate(c, P, draws, "pole", ["1", *self.names[start : start + size]]))
                slopes.append(np.zeros((2 * size, len(self.values))))
                slopes[-1][:, start : start + size] = found[-1].slopes[:, 1:]
        values = np.concatenate([f.values for f in found]) if found else np.zeros(0, complex)
        covariance = np.concatenate([f.covariance for f in found]) if found else np.zeros((0, 2, 2))
        method = [m for f in found for m in f.method]
        at = order(values)
        J = np.concatenate(slopes) if found else np.zeros((0, len(self.values)))
        joint, begun = spread(J, self.covariance), 0  # what two polynomials share is known to first order
        for f in found:
            own = slice(begun, begun + len(f.joint))
            joint[own, own], begun = f.joint, begun + len(f.joint)
        both = np.stack([2 * at, 2 * at + 1], axis=1).ravel()
        notes = [n for f in found for n in f.notes]
        return Roots(values[at], covariance[at], [method[i] for i in at], notes, joint[np.ix_(both, both)], J[both])

    def zeros(self, input: int = 0) -> np.ndarray:
        """Return the zeros of a channel."""
        return self.channel(input).zeros()

    def zeros_covariance(self, input: int = 0) -> np.ndarray:
        """Return the covariance (.., 2, 2) of (real, imaginary) part of each zero."""
        return self.channel(input).zeros_covariance()

    def zeros_std(self, input: int = 0) -> np.ndarray:
        """Return the root mean square radius of uncertainty of each zero."""
        return self.channel(input).zeros_std()

    def zeros_method(self, input: int = 0) -> list[str]:
        """Return how the uncertainty of each zero was found."""
        return self.channel(input).zeros_method()

    @property
    def notes(self) -> list[str]:
        """What is not an ordinary standard deviation here, in words."""
        found = list(self._poles.notes)
        for l, channel in enumerate(self._channels):
            of = f"input {l + 1}: " if len(self._channels) > 1 else ""
            found += [of + note for note in channel.notes if " pole" not in note and not note.startswith("pole")]
        return found

    @property
    def dc_gain(self) -> np.ndarray:
        """Steady-state gain from each input, (k,)."""
        return np.array([c.dc_gain[0] for c in self._channels])

    @property
    def dc_gain_std(self) -> np.ndarray:
        """Standard deviation of the steady-state gains."""
        return np.array([c.dc_gain_std[0] for c in self._channels])

    def dc_gain_interval(self, level: float = 0.95) -> np.ndarray:
        """Return the interval (k, 2) of the steady-state gains after Fieller."""
        return np.array([c.dc_gain_interval(level)[0] for c in self._channels]).reshape(-1, 2)

    def frequency_response(self, w) -> tuple[np.ndarray, np.ndarray]:
        """Return G (k, len(w)) and the covariance (k, len(w), 2, 2) of its (real, imaginary) parts."""
        found = [c.frequency_response(w) for c in self._channels or [self.common]]
        return np.concatenate([G for G, _ in found]), np.concatenate([C for _, C in found])

    # --- out -----------------------------------------------------------------------------------------------

    def simulate(self, u=None, *, samples=None, noise_std=None, seed: int = 0) -> tuple[np.ndarray, Any]:
        """Return a record (y, u) from rest; ``noise_std`` of e is the model's own if omitted (0 where unknown)."""
        from scipy.signal import lfilter

        A, B, C, D, F = self._factors
        if (u is None) != (not self.family.inputs) or (u is None and samples is None):
            raise InputError(f"the model has {self.family.inputs} input(s): give u, or samples where there is none")
        rows = np.asarray(u, float).reshape(len(u), -1) if u is not None else np.zeros((samples, 0))
        if rows.shape[1] != self.family.inputs or not np.isfinite(rows).all():
            raise InputError(f"u must be finite, of shape (T, {self.family.inputs}), got {np.shape(u)}")
        std = noise_std if noise_std is not None else self.noise_std if np.isfinite(self.noise_std) else 0.0
        y = lfilter(C, np.convolve(A, D), std * np.random.default_rng(seed).standard_normal(len(rows)))
        if self.family.has_offset:
            y += lfilter([1.0], A, np.full(len(rows), self.values[-1]))
        for l in range(self.family.inputs):
            y += lfilter(B[l], np.convolve(A, F[l]), rows[:, l])
        return y, u

    def to_transfer_function(self) -> tuple[np.ndarray, np.ndarray]:
        """Return numerators (k, n + 1) over the common denominator (n + 1,) in powers of q^-1."""
        return self.common.to_transfer_function()

    def to_scipy(self) -> tuple:
        """Return ``(A, B, C, D, dt)`` of all channels, what scipy.signal's dlti and dlsim take."""
        return self.common.to_scipy()

    def to_control(self, noise: bool = False) -> Any:
        """Return a python-control StateSpace; with ``noise`` its last input is e (needs the extra ``control``)."""
        return (self._with_noise if noise else self.common).to_control()

    def __str__(self):
        form, std = self.family, np.sqrt(np.diag(self.covariance).clip(0))
        k = form.inputs
        of = [f"{l + 1}" if k > 1 else "" for l in range(k)]
        lines = [form.words]
        names = [
            ("A", 0),
            *((f"B{o}", nk) for o, nk in zip(of, form.nk)),
            ("C", 0),
            ("D", 0),
            *((f"F{o}", 0) for o in of),
        ]
        at = 0
        for (name, lag), size in zip(names, (form.na, *form.nb, form.nc, form.nd, *form.nf)):
            if not size:
                continue
            is_b = name.startswith("B")
            terms = [] if is_b else [(1.0, None, 0)]
            terms += [(self.values[at + j], std[at + j], j + lag + (not is_b)) for j in range(size)]
            lines.append(f"{name}(q) = {_sum(terms)}")
            at += size
        if form.has_offset:
            lines.append(f"offset = {self.values[-1]:.4g} (± {std[-1]:.2g})")
        if np.isfinite(self.noise_std):
            lines.append(f"standard deviation of e: {self.noise_std:.4g}")
        return "\n".join(lines)


def product(*polynomials) -> np.ndarray:
    """Return the product of polynomials."""
    return reduce(np.convolve, polynomials)


def _numerators(B, F) -> list[np.ndarray]:
    """Return B_l times every other F."""
    return [product(B[l], *(F[j] for j in range(len(F)) if j != l)) for l in range(len(B))]


def _sum(terms) -> str:
    text = ""
    for value, std, lag in terms:
        size = f"{abs(value):.4g}" + (f" (± {std:.2g})" if std is not None else "") + (f" q^-{lag}" if lag else "")
        text += (" - " if text else "-") + size if value < 0 else (" + " if text else "") + size
    return text
