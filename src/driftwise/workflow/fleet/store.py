"""Saving a fleet: keys, rows and settings, and how those of earlier versions are read."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from ...errors import InputError
from ...estimators.reading import Rows
from ..snapshot import describe, is_described, rebuild
from . import sealed

SCHEMA = 1
READ: dict[str, Any] = {"text": str, "int": int, "float": float.fromhex, "bool": "True".__eq__}  # a key of each kind
SCALES = "y_scale", "u_scale"  # in which series of one fleet differ: kept also where policies are a user's own


def write(fleet, path) -> str:
    """Write a fleet; return the checksum of what was written."""
    size = len(fleet)
    header = {
        "schema": SCHEMA,
        "fields": _fields(fleet.estimators[0]),
        "estimators": [_settings(est) for est in fleet.estimators],
    }
    numbers = {"group": fleet._group[:size], "state": fleet._rows[:size]}
    return sealed.write(path, header, _words(fleet.keys), numbers)


def read(path, estimator=None) -> tuple[list, list, dict[str, np.ndarray]]:
    """Return the estimators, the keys and the columns of numbers in a file."""
    header, words, numbers = sealed.read(path, SCHEMA)
    estimators = [_estimator(settings, estimator, path) for settings in header["estimators"]]
    if any(_fields(est) != header["fields"] for est in estimators):
        raise InputError(
            f"the states in {path} are laid out otherwise than those of {estimators[0]!r}: "
            f"they have {', '.join(name for name, _ in header['fields'])}. Were they written by another version?"
        )
    keys = [READ[kind](text) for text, kind in zip(words["key"], words["kind"])]
    return estimators, keys, numbers


def _words(keys) -> dict[str, list[str]]:
    """Return keys as text, and what kind each one is."""
    pairs = [_word(key) for key in keys]
    return {"key": [text for text, _ in pairs], "kind": [kind for _, kind in pairs]}


def _word(key) -> tuple[str, str]:
    """Return a key as text, and its kind."""
    if isinstance(key, str):
        return str(key), "text"
    if isinstance(key, bool | np.bool_):
        return str(bool(key)), "bool"
    if isinstance(key, int | np.integer):
        return str(int(key)), "int"
    if isinstance(key, float | np.floating):
        return float(key).hex(), "float"
    raise InputError(f"keys that are saved are text or numbers, got {key!r} of {type(key).__name__}; use str(key)")


def _fields(estimator) -> list:
    """Return names and sizes of the parts of a state."""
    dtype = estimator.dtype
    return [[name, int(np.prod(dtype[name].shape))] for name in dtype.names]


def _settings(estimator) -> dict:
    """Return what is kept of the settings of an estimator: all, unless policies are a user's own."""
    if is_described(estimator):
        return json.loads(describe(estimator))
    options = estimator.options
    return {"kind": type(estimator).__name__, "scales": {k: np.asarray(options[k]).tolist() for k in SCALES}}


def _estimator(settings, given, path):
    """Return the estimator of such settings; ``given`` has the policies that were not saved."""
    if "scales" not in settings:
        return rebuild(json.dumps(settings))
    if not isinstance(given, Rows) or type(given).__name__ != settings["kind"]:
        raise InputError(
            f"{path} holds a fleet of {settings['kind']} with a policy of your own, which is not in the file: "
            f"give that estimator, Fleet.load(path, {settings['kind']}(..)), got {given!r}"
        )
    return type(given)(**{**given.options, **settings["scales"]})
