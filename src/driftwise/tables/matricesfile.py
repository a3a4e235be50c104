"""The user's own matrices from a TOML file: what `driftwise run --plant FILE` reads of a section [matrices]."""

from __future__ import annotations

from typing import Any

from driftwise import models
from driftwise.detect import InnovationGate
from driftwise.engine.errors import CommandError, InputError

from .plantfile import known, loaded

EXAMPLE = """\
[matrices]                       # x(t) = F x(t-1) + G u(t-1) + w, y(t) = H x(t) + D u(t) + v
states = ["position", "speed"]
F = [[1, 1], [0, 1]]
H = [1, 0]                       # a row for each output, in the order of --output
Q = [0, 0.01]                    # covariances of w and v: a matrix, its diagonal, or a number
R = 4.0
x0 = [0, 0]                      # the state before the first sample is seen; left out: zero, and
P0 = [100, 10]                   # as good as unknown
continuous = false               # true: F, G and Q are of x' = F x + G u + w, in seconds, samples at any instants
tune = "Q"                       # how large it is is learnt from the first rows; without scale also "R", ["Q", "R"]
scale = [2, 2]                   # alpha, beta: Q and R times a sigma^2 that is learnt; left out: it is 1
gate = 4.0                       # outliers beyond so many deviations count as missing
"""
MATRICES = ("F", "G", "H", "D", "Q", "R", "x0", "P0")
ENTRIES = (*MATRICES, "states", "continuous", "tune", "scale", "gate")


def read(path: str) -> tuple[dict[str, Any], list[str]]:
    """Return the options of a `StateSpace`, and the names of what is to be tuned."""
    found = loaded(path, EXAMPLE)
    try:
        known(found, ("matrices",), "section beside [matrices]")
        given = found["matrices"]
        if not isinstance(given, dict):
            raise InputError(f"[matrices] is a section. A file looks like this:\n{EXAMPLE}")
        known(given, ENTRIES, "entry of [matrices]")
        if missing := [name for name in ("F", "Q", "R") if name not in given]:
            raise InputError(f"[matrices] needs {missing[0]}. A file looks like this:\n{EXAMPLE}")
        options = {name: value for name, value in given.items() if name not in ("tune", "scale", "gate")}
        if "scale" in given:
            if not isinstance(given["scale"], list) or len(given["scale"]) != 2:
                raise InputError(f"scale is [alpha, beta] of an inverse gamma, got {given['scale']!r}")
            options["scale"] = models.InverseGamma(*given["scale"])
        if "gate" in given:
            options["gate"] = InnovationGate(given["gate"])
        tuned = given.get("tune", [])
        tuned = tuned if isinstance(tuned, list) else [tuned]
        if wrong := [name for name in tuned if name not in ("Q", "R")]:
            raise InputError(f'tune lists what is learnt from the record, ["Q", "R"], "Q" or "R"; got {wrong[0]!r}')
    except InputError as error:
        raise CommandError(f"--plant {path}: {error}") from None
    return options, tuned
