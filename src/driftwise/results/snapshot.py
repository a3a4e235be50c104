"""States and estimators as text: readable, versioned, safe to ship to another machine."""

from __future__ import annotations

import json
import operator
from importlib import import_module
from typing import Any, TypeVar

import numpy as np

from ..detect.registry import ENTRIES as DETECTORS
from ..engine.atomic import replaced
from ..engine.errors import InputError
from ..engine.saved import check_states, reading
from ..memory.registry import ENTRIES as MEMORIES
from ..models.disturbance import Disturbance
from ..models.noise import EquationError, NoiseCovariance, NoisePolynomial, OutputError, UnknownPolynomial
from ..models.plant import Plant, Polynomial, Sinusoid
from ..models.scale import InverseGamma
from . import upgrade
from .former_names import SCHEMA, upgraded

KINDS: dict[str, Any] = {
    k.__name__: k
    for k in (
        EquationError,
        OutputError,
        NoisePolynomial,
        UnknownPolynomial,
        NoiseCovariance,
        Disturbance,
        InverseGamma,
        Plant,
        Polynomial,
        Sinusoid,
    )
}


Kind = TypeVar("Kind")
ESTIMATORS: dict[str, type] = {}  # by name, each written down by itself when its class is made


def register(kind: type[Kind]) -> type[Kind]:
    """Write a class of estimators, or of their settings, down under its name, so that `rebuild` finds it."""
    (KINDS if hasattr(kind, "_fields") else ESTIMATORS).setdefault(kind.__name__, kind)
    return kind


def _estimator(name: str) -> Any:
    """Return the class of estimators of that name, loaded now if it was not yet."""
    if name not in ESTIMATORS:
        getattr(import_module("driftwise.estimators"), name, None)  # which writes it down
    if name not in ESTIMATORS:
        raise InputError(
            f"{name} is no estimator of this version: import the module that registers it, then load again"
        )
    return ESTIMATORS[name]


def _is_estimator(value) -> bool:
    return ESTIMATORS.get(type(value).__name__) is type(value)


def kinds() -> dict[str, Any]:
    """Return the settings that a file may hold, by name: those of above, and all public detectors and memories."""
    public = {**DETECTORS.public(), **MEMORIES.public()}
    return {**KINDS, **{name: entry.kind for name, entry in public.items()}}


def _plain(value: Any) -> Any:
    if type(value).__name__ in kinds():
        return {"kind": type(value).__name__, **{k: _plain(v) for k, v in value._asdict().items()}}
    if isinstance(value, dict):
        return {"kind": "dict", **{k: _plain(v) for k, v in value.items()}}
    if _is_estimator(value):
        return {"kind": "estimator", "text": describe(value)}
    if isinstance(value, np.ndarray):
        return np.asarray(value, float).tolist()
    if isinstance(value, tuple | list):
        return [_plain(v) for v in value]
    value = value.item() if isinstance(value, np.generic) else value
    return {"kind": "complex", "real": value.real, "imag": value.imag} if isinstance(value, complex) else value


def _rich(value: Any) -> Any:
    if isinstance(value, dict) and value["kind"] == "estimator":
        return rebuild(value["text"])
    if isinstance(value, dict):
        fields = {k: _rich(v) for k, v in value.items() if k != "kind"}
        known = {"complex": complex, "dict": dict, **kinds()}
        if value["kind"] not in known:
            raise InputError(
                f"a {value['kind']} is not known here: import the module that registers it, then load again"
            )
        return known[value["kind"]](**fields)
    if isinstance(value, list):
        return [_rich(v) for v in value]
    return value


def is_described(estimator) -> bool:
    """Say whether all policies of an estimator are driftwise's own, so that `describe` covers them."""
    return all(map(_is_ours, estimator.options.values()))


def _is_ours(value) -> bool:
    if isinstance(value, tuple | list) and not hasattr(value, "_fields"):
        return all(map(_is_ours, value))
    if _is_estimator(value):
        return is_described(value)
    if callable(value):  # a function: what it does cannot be written down
        return False
    return not hasattr(value, "_fields") or (type(value) in kinds().values() and all(map(_is_ours, value)))


def describe(estimator) -> str:
    """Return the settings of an estimator as JSON; a user's own policies are not covered."""
    if not is_described(estimator):
        raise InputError(
            f"{estimator!r} has a policy or a function that is not driftwise's own: keep its settings yourself"
        )
    options = {k: _plain(v) for k, v in estimator.options.items()}
    return json.dumps({"schema": SCHEMA, "estimator": type(estimator).__name__, "options": options})


def rebuild(text: str):
    """Return the estimator that `describe` described."""
    data = upgraded(json.loads(text))
    kind = _estimator(data["estimator"])
    return kind(**{k: _rich(v) for k, v in data["options"].items()})


def save_state(estimator, state, path) -> None:
    """Write an estimator with one state, or a fleet of them, to a JSON file; every bit survives.

    Parameters
    ----------
    estimator, state
        As `scan` and `update` use and return them; a fleet's state has a row for each series.
    path : str or Path
        Where to write.

    Examples
    --------
    >>> import driftwise as dw, tempfile, pathlib
    >>> y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    >>> est = dw.ARX(1, 1)
    >>> state = est.scan(y, u).state
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "state.json"
    >>> dw.save_state(est, state, path)
    >>> again, resumed = dw.load_state(path)
    >>> again == est, bool((resumed == state).all())
    (False, True)
    """
    if not _is_estimator(estimator) or getattr(state, "dtype", None) != estimator.dtype:
        raise InputError("save_state takes (estimator, state, path): the state is one of that estimator's own")
    rows = np.atleast_1d(state).view(np.float64).reshape(np.size(state), -1)
    data = json.loads(describe(estimator)) | {
        "shape": list(np.shape(state)),
        "rows": [[float.hex(v) for v in row] for row in rows],
    }
    with replaced(path) as beside, open(beside, "w") as f:
        json.dump(data, f)


def load_state(path):
    """Return (estimator, state) as saved.

    Parameters
    ----------
    path : str or Path
        What `save_state` wrote.

    Raises
    ------
    InputError
        Where the file is no such file, was altered, or is of another version.

    Examples
    --------
    >>> import driftwise as dw, tempfile, pathlib
    >>> est, path = dw.AR(1), pathlib.Path(tempfile.mkdtemp()) / "state.json"
    >>> state, _ = est.update(est.start(), 1.0)
    >>> dw.save_state(est, state, path)
    >>> again, resumed = dw.load_state(path)
    >>> again == est, bool((resumed == state).all())
    (False, True)
    """
    with reading(path, "save_state"):
        with open(path, encoding="utf-8") as f:
            data = json.load(f)
        est = rebuild(json.dumps({k: data[k] for k in ("schema", "estimator", "options") if k in data}))
        rows = np.array([[float.fromhex(v) for v in row] for row in data["rows"]])
        rows = upgrade.rows(est, rows)
        if rows.size and 8 * rows.shape[1] != est.dtype.itemsize:
            raise InputError(
                f"its states have {rows.shape[1]} numbers, those of {est!r} have {est.dtype.itemsize // 8}: they "
                "were written by an earlier version and cannot be continued; start afresh"
            )
        shape = [operator.index(size) for size in data["shape"]]
        if min(shape, default=0) < 0:
            raise InputError(f"its states have the shape {shape}")
        return est, check_states(rows.view(est.dtype).reshape(shape), est.unknown_parts)
