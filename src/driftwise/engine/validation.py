"""Checks of what a user hands over, made once, with words that say what is wrong."""

from __future__ import annotations

import math
from datetime import UTC, datetime

import numpy as np

from . import bounds
from .errors import InputError, brief

LARGEST = 1e100  # typical size of data
HOLDS = ("zoh", "foh")  # what an input does between its samples: held, or a straight line


def count(name, value, least=0) -> int:
    """Return a whole number of at least ``least``, and at most what `bounds` says of this name."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise InputError(f"{name} must be a whole number of at least {least}, got {value!r}")
    if value > (most := bounds.MOST.get(name, bounds.COUNT)):
        raise InputError(f"{name} is at most {most}, got {value!r}{bounds.why(name)}")
    return int(value)


def yes(name, value) -> bool:
    """Return a truth value."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{name} must be True or False, got {value!r}")
    return bool(value)


def one_of(name, value, words) -> str:
    """Return one of the words allowed."""
    if not isinstance(value, str) or value not in words:
        raise InputError(f"{name} must be one of {', '.join(words)}, got {value!r}")
    return value


def positive(name, value) -> float:
    """Return a positive finite number."""
    is_number = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    if not (is_number and 0 < value < math.inf):
        raise InputError(f"{name} must be a positive finite number, got {value!r}")
    return float(value)


def share(name, value, what="a share") -> float:
    """Return a number above 0 and at most 1; ``what`` says what it is."""
    if positive(name, value) > 1:
        raise InputError(f"{name} is {what}, above 0 and at most 1, got {value!r}")
    return float(value)


def size(name, value) -> float:
    """Return a typical size of data, of which the kernel can take the square."""
    number = positive(name, value)
    return number if 1 / LARGEST <= number <= LARGEST else float(_sizes(name, np.array(number), value))


def sizes(name, value, size) -> np.ndarray:
    """Return ``size`` typical sizes of data."""
    return _sizes(name, each(name, value, size), value)


def root_mean_square(values) -> float:
    """Return that of the finite values, NaN without one; no unit is too large or too small for their squares."""
    values = values[np.isfinite(values)]
    if not values.size:
        return math.nan
    exponent = int(np.frexp(np.abs(values).max())[1])
    return float(np.ldexp(np.sqrt(np.mean(np.ldexp(values, -exponent) ** 2)), exponent))


def deviation(values) -> float:
    """Return the standard deviation of the finite values, as `root_mean_square` does."""
    values = values[np.isfinite(values)]
    return root_mean_square(values - values.mean()) if values.size else math.nan


def _sizes(name, numbers, value):
    if np.all((numbers >= 1 / LARGEST) & (numbers <= LARGEST)):
        return numbers
    if np.any(numbers <= 0):
        raise InputError(f"{name} must be positive, got {value!r}")
    if np.any((numbers < 1 / LARGEST) | (numbers > LARGEST)):
        raise InputError(f"{name} must lie between {1 / LARGEST:g} and {LARGEST:g}, got {value!r}. Is the unit right?")
    return numbers


def within(name, numbers, value):
    """Return numbers none of which is larger than data may be."""
    if np.any(abs(numbers) > LARGEST):
        raise InputError(f"{name} must not be beyond {LARGEST:g}, as data are not; got {value!r}")
    return numbers


def floats(name, value) -> np.ndarray:
    """Return an array of real numbers."""
    try:
        found = np.asarray(value)
        if found.dtype.kind in "cSUMmV":
            raise TypeError
        return found.astype(float)
    except (TypeError, ValueError):
        raise InputError(f"{name} must hold numbers, got {brief(repr(value))}") from None


def seconds(name, value) -> np.ndarray:
    """Return times in s: numbers as they are, dates as Unix time, UTC where they say no zone; NaT is NaN."""
    found = np.asarray(value)
    if found.dtype.kind == "O" and found.size and all(isinstance(one, datetime) for one in found.flat):
        utc = [one if one.tzinfo else one.replace(tzinfo=UTC) for one in found.flat]
        return np.array([one.timestamp() for one in utc]).reshape(found.shape)
    if found.dtype.kind == "M":
        return (found.astype("M8[ns]") - np.datetime64(0, "ns")) / np.timedelta64(1, "s")
    return floats(name, value)


def vector(name, value, size) -> np.ndarray:
    """Return a finite vector of the given size."""
    value = floats(name, value)
    if value.shape != (size,) or not np.isfinite(value).all():
        came = f"shape {value.shape}" if value.shape != (size,) else f"{value.tolist()}"
        raise InputError(f"{name} must be a finite vector of {size} numbers, got {came}")
    return value


def each(name, value, size) -> np.ndarray:
    """Return ``size`` finite numbers from one number for all, or one for each."""
    value = floats(name, value)
    fits = value.shape in ((), (1,), (size,))
    if not (fits and np.isfinite(value).all()):
        came = f"{value.tolist()}" if fits else f"shape {value.shape}"
        raise InputError(f"{name} must be a finite number, or {size} of them, got {came}")
    return np.full(size, value) if value.size == 1 else value.copy()


def unknowns(size: int) -> int:
    """Return how many unknowns a model has."""
    if size > bounds.UNKNOWNS:
        raise InputError(
            f"the model has {size} unknowns, and at most {bounds.UNKNOWNS} are taken: what is known of them is a "
            "matrix of their square. Take lower orders, or fewer inputs"
        )
    return size


def covariance(name, value, size) -> np.ndarray:
    """Return a covariance matrix from a scalar, its diagonal, or itself."""
    value = floats(name, value)
    if not np.isfinite(value).all():
        raise InputError(f"{name} must be finite; for a vague prior give a large number (1e10 costs no digits here)")
    if value.shape not in ((), (size,), (size, size)):
        raise InputError(f"{name} must be a number, ({size},) or ({size}, {size}), got shape {value.shape}")
    full = value if value.ndim == 2 else np.diag(np.broadcast_to(value, (size,)))
    if np.any(np.diag(full) < 0):
        raise InputError(f"{name} must not be negative: variances on its diagonal are. Was a sign lost?")
    if not np.allclose(full, full.T):
        raise InputError(f"{name} must be symmetric. Was its factor given instead of the matrix?")
    return (full + full.T) / 2


def numbers(name, value) -> np.ndarray:
    """Return data, contiguous float64, NaN where missing; masked means missing."""
    try:
        if isinstance(value, np.ma.MaskedArray):
            value = np.ma.filled(value.astype(float), np.nan)
        value = np.asarray(value)
        if value.dtype.kind in "cSUMmV":
            raise TypeError
        value = np.asarray(value, np.float64, order="C")
    except (TypeError, ValueError):
        raise InputError(
            f"{name} must hold real numbers. Is there text among them, or are its rows of unequal length?"
        ) from None
    if np.isinf(value).any():
        where = np.argwhere(np.isinf(value))[0].tolist()
        raise InputError(
            f"{name} is infinite at index {where}; mark missing samples by NaN. Was something divided by zero?"
        )
    return value if value.flags.writeable else value.copy()


def record(y, u, inputs: int, outputs: int | None = None):
    """Return y and u (T, k), contiguous float64, of a record.

    y is (T,) where there is one output, which ``outputs=None`` says, and (T, p) where there are p, also for p = 1.
    """
    y = numbers("y", y)
    y = _column(y) if outputs is None else _columns(y, outputs)
    return y, simultaneous(u, len(y), inputs)


def _column(y) -> np.ndarray:
    if not y.ndim:
        raise InputError("y must be a record, (T,), got a single number: for one sample use update")
    if y.ndim != 1:
        raise InputError(
            f"y must be one-dimensional, (T,), got shape {y.shape}: the model has one output. "
            "Did you pass inputs and outputs together, or a column as (T, 1)? Use y[:, 0]."
        )
    return y


def _columns(y, outputs) -> np.ndarray:
    if y.ndim == 1 and outputs == 1:
        y = y[:, None]
    if y.ndim != 2 or y.shape[1] != outputs:
        raise InputError(
            f"y must have shape (T, {outputs}), one column per output, got {y.shape}; time comes first. "
            "Is it transposed, or are these other outputs?"
        )
    return np.ascontiguousarray(y)


def simultaneous(u, samples: int, inputs: int) -> np.ndarray:
    """Return u (T, k), contiguous float64, of a record of so many samples."""
    if u is None:
        if inputs:
            raise InputError(f"the model has {inputs} input(s) but u was not given")
        return np.zeros((samples, 0))
    if not inputs:
        raise InputError("u was given but the model has no input; did you forget inputs=1?")
    u = numbers("u", u)
    if u.ndim == 1 and inputs == 1:
        u = u[:, None]
    if u.ndim != 2 or u.shape[1] != inputs:
        raise InputError(f"u must have shape (T, {inputs}), got {u.shape}; time comes first. Is it transposed?")
    if len(u) != samples:
        raise InputError(f"y has {samples} samples but u has {len(u)}; they must be simultaneous")
    return np.ascontiguousarray(u)


def inputs_to_come(u, horizon, inputs: int) -> np.ndarray:
    """Return u (h, k) of the samples to come; h is the length of u where no ``horizon`` is told."""
    if horizon is None and u is None:
        raise InputError("say how far: horizon=, or the inputs to come")
    u = simultaneous(u, len(np.atleast_1d(u)) if horizon is None else count("horizon", horizon, 1), inputs)
    if not np.isfinite(u).all():
        raise InputError("the inputs to come must be known: u has NaN. Assume a value for them")
    return u


def one(value, size: int) -> np.ndarray:
    """Return (1, 1, size) of a number or a sequence."""
    value = np.asarray(value)
    if value.dtype.kind in "cSUMmV":
        raise TypeError
    return np.array(value, np.float64).reshape(1, 1, size)


def sample(y, u, inputs: int, outputs: int | None = None):
    """Return y (1, 1, p) and u (1, 1, k) of one sample; one output, a number, where ``outputs`` is None."""
    try:
        ys, us = one(y, outputs or 1), one(() if u is None else u, inputs)
    except (TypeError, ValueError, OverflowError):
        what = "a number y" if outputs is None else f"{outputs} output(s) y"
        raise InputError(
            f"one sample is {what} and {inputs} input(s), got y = {y!r}, u = {u!r}; for records use scan"
        ) from None
    found = ys[0, 0].tolist() + us[0, 0].tolist()
    if math.inf in found or -math.inf in found:
        raise InputError(f"y and u must be finite, or NaN where missing; got y = {y!r}, u = {u!r}")
    return ys, us


def fleet(y, u, series: int, inputs: int, outputs: int | None = None):
    """Return y (S, T, p), u (S, T, k) and the shape of y, for S series of one output (None) or of p."""
    y, last = numbers("y", y), () if outputs is None else (outputs,)
    lead = y.shape[: y.ndim - len(last)]  # (S,) or (S, T)
    if len(lead) not in (1, 2) or lead[0] != series or y.shape[len(lead) :] != last:
        shapes = (
            f"({series},) or ({series}, T)" if outputs is None else f"({series}, {outputs}) or ({series}, T, {outputs})"
        )
        raise InputError(f"y must be {shapes}, one row per state, got shape {y.shape}")
    if (u is None) != (inputs == 0):
        raise InputError(f"the model has {inputs} input(s); u was {'not ' if u is None else ''}given")
    us = numbers("u", np.zeros((*lead, 0)) if u is None else u)
    if us.shape not in ((*lead, inputs), lead if inputs == 1 else None):
        expected = f"{(*lead, inputs)}" + (f" or {lead}" if inputs == 1 else "")
        raise InputError(f"u must be {expected}, like y with the inputs last, got shape {us.shape}")
    length = 1 if len(lead) == 1 else lead[1]
    return y.reshape(series, length, outputs or 1), us.reshape(series, length, inputs), y.shape


def counts(name, value, least=0) -> tuple[int, ...]:
    """Return whole numbers from one, or from a sequence of them."""
    values = value if isinstance(value, tuple | list | np.ndarray) else (value,)
    return tuple(count(name, v, least) for v in values)


# --- of a known plant --------------------------------------------------------------------------------------


def hold(value, inputs: int) -> str:
    """Return what u does between its samples; without an input it does not matter."""
    if not inputs:
        if value is not None:
            raise InputError(f"the plant has no input, so hold says nothing: leave it out, got {value!r}")
        return HOLDS[0]
    if value not in HOLDS:
        raise InputError(
            'u is given at its samples only: hold must say what it does between them, "zoh" (held) or "foh" (a '
            f"straight line); a wrong one is an error of the plant. Got {value!r}"
        )
    return value


def tolerance(value, n: int, m: int) -> np.ndarray:
    """Return the largest deviation of each of m elements that will do, infinite where none was stated."""
    found = floats("tolerance", np.inf if value is None else value)
    if found.shape not in ((), (n,), (m,)) or np.isnan(found).any() or np.any(found <= 0):
        shapes = f"({n},)" if n == m else f"({n},) or ({m},)"
        raise InputError(f"tolerance must be positive (inf: any will do), a number or {shapes}, got {value!r}")
    limits = np.full(m, np.inf)
    limits[: found.size if found.ndim else m] = found
    return limits


def degree(name, value) -> int:
    """Return the degree of a polynomial in time, -1 for none."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < -1:
        raise InputError(
            f"{name} is the degree of an unknown polynomial, at least -1: -1 none, 0 a constant, 1 a ramp; "
            f"got {value!r}"
        )
    return count(name, value) if value >= 0 else -1


def frequencies(value) -> list[float]:
    """Return different frequencies in rad/s."""
    found = np.atleast_1d(floats("frequencies", value))
    if found.ndim > 1 or not np.all(np.isfinite(found) & (found > 0)):
        what = ": a frequency of 0 is a constant, a polynomial of degree 0" if np.any(found == 0) else ""
        raise InputError(f"frequencies must be positive and finite, in rad/s, got {value!r}{what}")
    count("frequencies", len(found))
    if len(np.unique(found)) < len(found):
        raise InputError(f"frequencies must be different, or their sinusoids cannot be told apart: {value!r}")
    return found.tolist()
