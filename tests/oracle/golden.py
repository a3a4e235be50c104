"""The golden cases, and the comparison their README defines."""

import json
from functools import cache
from pathlib import Path

import numpy as np

FILE = Path(__file__).parents[1] / "golden" / "salut.json"


@cache
def cases():
    return {case["id"].split("_")[0]: case for case in json.loads(FILE.read_text())["cases"]}


def case(name):
    """Inputs (a `base` resolved), expected values and tolerance of one case, as arrays."""
    found = cases()[name]
    inputs = dict(found["inputs"])
    if "base" in inputs:
        inputs = {**cases()[inputs.pop("base").split("_")[0]]["inputs"], **inputs}
    return arrays(inputs), arrays(found["expected"]), found["rtol"]


def arrays(values):
    """Lists of numbers become arrays; what is ragged or named stays as it is."""
    out = dict(values)
    for key, value in values.items():
        try:
            out[key] = np.array(value, dtype=float) if isinstance(value, list) else value
        except (TypeError, ValueError):
            continue
    return out


def worst(got, expected):
    """Largest |got - expected| / (1 + |expected|): a case passes when this is at most its tolerance."""
    got, expected = np.asarray(got, dtype=float), np.asarray(expected, dtype=float)
    if got.shape != expected.shape or not np.isfinite(got).all():
        return np.inf
    return float(np.max(np.abs(got - expected) / (1 + np.abs(expected))))


def assert_close(got, expected, tolerance, what=""):
    error = worst(got, expected)
    assert error <= tolerance, f"{what}: off by {error:.2g}, allowed {tolerance:.2g}"
