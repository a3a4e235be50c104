"""Saving a fleet: keys, rows and settings, and how those of earlier versions are read."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..engine.errors import InputError
from ..estimators.base import is_estimator
from ..results import former_names, upgrade
from ..results.snapshot import describe, is_described, rebuild
from . import checkpoint_file

SCHEMA = 4  # 2: what a run has to remember besides, so that it can be gone on with; 3: more columns; 4: new names
READ: dict[str, Any] = {"text": str, "int": int, "float": float.fromhex, "bool": "True".__eq__}  # a key of each kind
SCALES = "y_scale", "u_scale"  # in which series of one fleet differ: kept also where policies are a user's own


class Kept(NamedTuple):
    """What a file holds: the fleet, and arrays and facts that were kept with it."""

    estimators: list
    keys: list
    rows: np.ndarray
    group: np.ndarray
    arrays: dict[str, np.ndarray]
    facts: dict[str, Any]


def write(fleet, path, arrays: dict[str, np.ndarray] | None = None, facts: dict[str, Any] | None = None) -> str:
    """Write a fleet, arrays of any shape and facts (JSON) with it; return the checksum of all of it.

    Arrays need a fleet that is not empty.
    """
    folder = os.path.dirname(os.path.abspath(path))
    if not os.path.isdir(folder):
        raise InputError(f"{path} cannot be written: there is no folder {folder}; make it first")
    size, arrays = len(fleet), arrays or {}
    is_column = {name: values.ndim == 2 and len(values) == size and values.size > 0 for name, values in arrays.items()}
    header = {
        "schema": SCHEMA,
        "fields": _fields(fleet.estimators[0]),
        "estimators": [settings(est) for est in fleet.estimators],
        "facts": facts or {},
        "arrays": list(arrays),
    }
    numbers = {"group": fleet._group[:size], "state": fleet._rows[:size]}
    numbers |= {name: values for name, values in arrays.items() if is_column[name]}
    loose = {name: np.asarray(values, order="C") for name, values in arrays.items() if not is_column[name]}
    return checkpoint_file.write(path, header, _words(fleet.keys), numbers, loose)


def read(path, estimator=None) -> Kept:
    """Return what is in a file, also in one of an earlier schema."""
    header, words, numbers, loose = checkpoint_file.read(path, SCHEMA)
    for schema in range(header["schema"], SCHEMA):
        header = UPGRADES[schema](header)
    estimators = [_estimator(found, estimator, path) for found in header["estimators"]]
    states, fields = (
        numbers["state"],
        former_names.parts(header["fields"]),
    )  # of which some files of schema 4 kept old names
    if all(fields in upgrade.fields(est) and fields != _fields(est) for est in estimators):
        states, fields = upgrade.rows(estimators[0], states), _fields(estimators[0])
    if any(_fields(est) != fields for est in estimators):
        raise InputError(
            f"the states in {path} are laid out otherwise than those of {estimators[0]!r}: "
            f"they have {', '.join(name for name, _ in fields)}. Were they written by another version?"
        )
    keys = [READ[kind](text) for text, kind in zip(words["key"], words["kind"])]
    found = numbers | loose
    arrays = {name: found[name] for name in header["arrays"]}
    return Kept(estimators, keys, states, numbers["group"], arrays, header["facts"])


def _with_facts(header: dict) -> dict:
    """Return a header of schema 1 as schema 2 has it: nothing was kept besides the fleet."""
    return header | {"schema": 2, "facts": {}, "arrays": []}


def _with_columns(header: dict) -> dict:
    """Return a header of schema 2 as schema 3 has it: columns that are missing at the end begin afresh."""
    return header | {"schema": 3}


def _with_names(header: dict) -> dict:
    """Return a header of schema 3 as schema 4 has it: `read` knows old names, and leaves empty parts out."""
    return header | {"schema": 4}


UPGRADES: dict[int, Callable[[dict], dict]] = {
    1: _with_facts,
    2: _with_columns,
    3: _with_names,
}  # from each schema to the next


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
    """Return names and sizes of the parts of a state, those of no size left out."""
    sizes = {name: int(np.prod(estimator.dtype[name].shape)) for name in estimator.dtype.names}
    return [[name, size] for name, size in sizes.items() if size]


def settings(estimator) -> dict:
    """Return what is kept of the settings of an estimator: all, unless policies are a user's own."""
    if is_described(estimator):
        return json.loads(describe(estimator))
    options = estimator.options
    return {"kind": type(estimator).__name__, "scales": {k: np.asarray(options[k]).tolist() for k in SCALES}}


def _estimator(found, given, path):
    """Return the estimator of such settings; ``given`` has the policies that were not saved."""
    if "scales" not in found:
        return rebuild(json.dumps(found))
    if not is_estimator(given) or type(given).__name__ != found["kind"]:
        raise InputError(
            f"{path} holds a fleet of {found['kind']} with a policy of your own, which is not in the file: "
            f"give that estimator, Fleet.load(path, {found['kind']}(..)), got {given!r}"
        )
    return type(given)(**{**given.options, **found["scales"]})
