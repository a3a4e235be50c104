"""How long should the window of a known plant be, and is each listed frequency worth its price?"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import oaconvolve

from ..engine import validation
from ..engine.errors import InputError
from ..estimators.window_observer.gains import Design
from ..estimators.window_observer.horizon import Horizon
from ..models.plant import Augmented, Plant
from .frequency_cost import Price, prices
from .lines import forced

USUAL = [10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000]  # samples


@dataclass(frozen=True)
class Advice:
    """Standard deviations at the end of a window, for windows of several lengths; print it.

    Attributes
    ----------
    names : states of the plant, then of the disturbances
    windows, samples : (K,) lengths in seconds and in samples
    std : (K, m), infinite where the window does not determine the unknowns
    condition : (K,) of the unknowns, each in its own units
    smallest : seconds of the smallest window that determines all unknowns
    required : seconds of the smallest window that meets the tolerance; None where none was given, infinite if none does
    prices : one `Price` for each `Sinusoid`
    bias : (K, n) root mean square error that the wrong plant alone makes, or None
    hidden : the modes that no window sees, in words; empty where there are none
    """

    names: list[str]
    windows: np.ndarray
    samples: np.ndarray
    std: np.ndarray
    condition: np.ndarray
    smallest: float
    required: float | None
    prices: list[Price]
    bias: np.ndarray | None
    hidden: str

    @property
    def total(self) -> np.ndarray | None:
        """Root mean square error (K, n) of noise and wrong plant together, or None."""
        return None if self.bias is None else np.hypot(self.std[:, : self.bias.shape[1]], self.bias)

    @property
    def notes(self) -> list[str]:
        """What to beware of, in words."""
        if self.hidden:
            return [self.hidden]
        found = [f"smallest window that determines everything: {self.smallest:.4g} s"]
        if self.required is not None:
            met = f"{self.required:.4g} s" if math.isfinite(self.required) else "no window is long enough"
            found.append(f"smallest window within the tolerance: {met}")
        for price in self.prices:
            found += price.notes(self.windows, self.std, self.names)
        if self.total is not None:
            best = self.windows[np.argmin(self.total, axis=0)]
            found.append(
                "with this error of the model the best window is "
                + ", ".join(f"{window:g} s for {name}" for name, window in zip(self.names, best))
            )
        return found

    def columns(self) -> dict[str, Any]:
        """Return the table by name: window, condition, std_NAME, and bias_NAME where asked for."""
        found = {"window": self.windows, "samples": self.samples, "condition": self.condition}
        found |= {f"std_{name}": self.std[:, i] for i, name in enumerate(self.names)}
        if self.bias is not None:
            found |= {f"bias_{name}": self.bias[:, i] for i, name in enumerate(self.names[: self.bias.shape[1]])}
        return found

    def __str__(self):
        head = ["window s", *self.names]
        cells = [[f"{t:g}", *(f"{s:.3g}" for s in row)] for t, row in zip(self.windows, self.std)]
        if self.bias is not None:
            head += [f"bias {name}" for name in self.names[: self.bias.shape[1]]]
            cells = [row + [f"{b:.3g}" for b in bias] for row, bias in zip(cells, self.bias)]
        widths = [max(map(len, column)) for column in zip(head, *cells)]
        lines = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths)) for row in [head, *cells]]
        return "\n".join([*lines, *self.notes])

    __repr__ = __str__


def advise_window(
    plant: Plant,
    *,
    dt: float,
    noise_std,
    disturbances=(),
    windows=None,
    tolerance=None,
    amplitudes: dict | None = None,
    model_error: Plant | None = None,
    u=None,
    hold: str | None = None,
) -> Advice:
    """Return standard deviations of a window's estimate against its length, and what each listed frequency costs.

    Nothing is simulated: a window's information is computed for any length (`Horizon`). For an integrator chain
    of N unknowns the m-th derivative has variance sigma^2 dt/T^(2m+1) [(N+m)!/(m! (N-m-1)!)]^2/(2m+1), nearly.

    Parameters
    ----------
    plant : Plant
    dt : seconds between samples
    noise_std : standard deviation of the noise, of each output
    disturbances : what disturbs the plant, with its prior
    windows : seconds; 10 to 10 000 samples if omitted
    tolerance : largest standard deviation to accept: number, (n,) or (m,); infinite where it does not matter
    amplitudes : {w: amplitude of q} of the sinusoids; what a finite prior amounts to where it is not given
    model_error : a `Plant` with the same states that may be the true one: how wrong would the estimates be?
    u : (T,) or (T, k) inputs, for ``model_error``; its error is taken over the samples after the longest window
    hold : "zoh" or "foh", for ``model_error`` with inputs

    Notes
    -----
    A sinusoid without prior adds about sigma |x(iw)/y(iw)| sqrt(2 dt/T) to the standard deviation of a state x, and
    removes an error of amplitude |x(iw)| q: below T = 2 dt/(A_y/sigma)^2 it costs more than it removes.

    Examples
    --------
    >>> import driftwise as dw
    >>> cart = dw.Plant([[0, 1], [0, 0]], [0, 1], states=("position", "speed"))
    >>> wind = dw.models.Polynomial([0, 1], float("inf"))
    >>> asked = dict(dt=0.01, noise_std=0.1, disturbances=wind, windows=[0.5, 1, 2], tolerance=[0.1, 0.1])
    >>> print(dw.analysis.advise_window(cart, **asked))
    window s  position   speed      q
         0.5    0.0408   0.385    1.52
           1    0.0294   0.137   0.268
           2     0.021  0.0488  0.0474
    smallest window that determines everything: 0.03 s
    smallest window within the tolerance: 1.24 s
    """
    augmented = Augmented(plant, disturbances)
    dt, sigma = validation.size("dt", dt), validation.sizes("noise_std", noise_std, augmented.outputs)
    samples = _samples(windows, dt)
    limits = validation.tolerance(tolerance, augmented.n, augmented.m)
    try:
        augmented.require_observable()
        hidden = ""
    except InputError as error:
        hidden = str(error)
    horizon = Horizon(augmented, dt, sigma)
    std = np.array([np.full(augmented.m, np.inf) if hidden else horizon.std(L) for L in samples])
    required = None
    if tolerance is not None:
        required = 0 if hidden else horizon.shortest(lambda L: bool(np.all(horizon.std(L) <= limits)))
    bias = None
    if model_error is not None and not hidden:
        bias = np.array([_bias(horizon, model_error, u, L, samples.max(), hold) for L in samples])
    smallest = 0 if hidden else horizon.smallest
    return Advice(
        names=augmented.names,
        windows=samples * dt,
        samples=samples,
        std=std,
        condition=np.array([np.inf if hidden else horizon.condition(L) for L in samples]),
        smallest=smallest * dt or math.inf,
        required=None if required is None else required * dt or math.inf,
        prices=[] if hidden else prices(horizon, std, samples, amplitudes or {}),
        bias=bias,
        hidden=hidden,
    )


def _bias(horizon, truth, u, samples, first, hold) -> np.ndarray:
    """Return the root mean square error (n,) of a window that believes in another plant than the true one.

    The window's estimate is exact on the model's own response to u: only the difference of outputs goes through K.
    """
    model, n, p = horizon.augmented, horizon.augmented.n, horizon.augmented.outputs
    true = Augmented(truth)
    if (true.n, true.inputs, true.outputs) != (n, model.inputs, p):
        raise InputError(
            f"model_error must be a plant of the same {n} states, {model.inputs} inputs and {p} outputs, "
            f"got {true.n}, {true.inputs} and {true.outputs}"
        )
    if u is None:
        raise InputError("model_error needs u, a record of inputs: what moves the plant decides how wrong it is")
    u, hold = validation.simultaneous(u, len(np.asarray(u)), model.inputs), validation.hold(hold, model.inputs)
    if np.isnan(u).any() or len(u) <= first:
        raise InputError(f"u must have no NaN and more samples ({len(u)}) than the longest window ({first})")
    (x, y), (x_model, y_model) = (forced(plant, u, horizon.dt, hold) for plant in (true, model))
    design = Design(model, horizon.dt, samples, horizon.noise_std)
    if not design.is_usable:
        return np.full(n, np.inf)
    K = design.gains[:n, ::-1]
    seen = np.zeros((len(u) - samples + 1, n))
    for j in range(p):
        seen += oaconvolve((y - y_model)[:, j, None], K[:, :, j].T, mode="valid", axes=0)
    error = (x_model[:, :n] - x)[samples - 1 :] + seen
    return np.sqrt(np.mean(error[first - samples + 1 :] ** 2, axis=0))


def _samples(windows, dt) -> np.ndarray:
    if windows is None:
        return np.array(USUAL)
    found = np.atleast_1d(validation.floats("windows", windows))
    if found.ndim != 1 or not len(found) or not np.isfinite(found).all() or np.any(found < dt):
        raise InputError(f"windows must be lengths in seconds, of at least one sample ({dt:g} s), got {windows!r}")
    return np.maximum(1, np.rint(found / dt)).astype(int)
