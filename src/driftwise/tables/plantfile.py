"""A known plant from a TOML file: what `driftwise run --plant FILE` reads."""

from __future__ import annotations

import tomllib
from typing import Any

from driftwise import detect, models
from driftwise.engine.errors import CommandError, InputError

from .source import bounded

EXAMPLE = """\
[plant]                          # x' = A x + B u + disturbances, y = C x + D u, in seconds
states = ["position", "speed"]
A = [[0, 1], [0, -2.1]]
B = [0, 0.37]                    # one column of numbers for each input
C = [1, 0]

[[disturbance]]                  # a constant; degree = 1: a ramp; frequency = 50: a sinusoid, rad/s
name = "load"
into = [0, -0.01]                # how it enters each x'
prior_std = inf                  # what it may be; inf: nothing is known, 0: left out
walk = "tune"                    # it wanders: deviation it gains in a second, or tune

[derived.acceleration]           # further outputs with their error bars: a sum of states, disturbances and inputs
speed = -2.1
load = -0.01
u = 0.37

[observer]
window = inf                     # seconds looked back at; inf: all that came before; tune: what predicts best
noise_std = 6e-6                 # of the measurement; learn (without priors) or tune
hold = "zoh"                     # how u moves between its samples: zoh (held) or foh (straight lines)
"""
SECTIONS = ("plant", "disturbance", "derived", "observer")
OBSERVER = ("window", "noise_std", "hold", "irregular", "capacity", "tolerance", "x0", "x_std", "false_alarms")


def loaded(path: str, example: str) -> dict[str, Any]:
    """Return what a TOML file holds; ``example`` is shown where it is none."""
    try:
        with open(path, "rb") as file:
            return tomllib.loads(bounded(file, f"--plant {path}").decode())
    except OSError as error:
        raise CommandError(f"--plant {path}: {error.strerror or error}") from None
    except InputError as error:
        raise CommandError(str(error)) from None
    except RecursionError:
        raise CommandError(f"--plant {path} is nested too deep; a file begins like this:\n{example}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, ValueError) as error:
        raise CommandError(f"--plant {path} is not a TOML file: {error}. A file begins like this:\n{example}") from None


def sections(path: str) -> set[str]:
    """Return the names of what a TOML file holds; none of one that is none, which whoever reads it says."""
    try:
        return set(loaded(path, ""))
    except CommandError:
        return set()


def read(path: str, outputs: list[str], inputs: list[str]) -> tuple[Any, list[int]]:
    """Return the options of a `WindowObserver`, and the numbers of the disturbances whose walk is to be tuned."""
    found = loaded(path, EXAMPLE)
    try:
        known(found, SECTIONS, "section")
        for name in ("plant", "observer"):
            if not isinstance(found.get(name), dict):
                raise InputError(f"section [{name}] is missing. A file looks like this:\n{EXAMPLE}")
        plant = found["plant"]
        known(plant, ("states", "A", "B", "C", "D"), "entry of [plant]")
        if "A" not in plant:
            raise InputError("[plant] needs A, the state matrix")
        plant = models.Plant(**plant, inputs=inputs or None, outputs=outputs)
        listed = found.get("disturbance", [])
        listed = listed if isinstance(listed, list) else [listed]
        derived = found.get("derived", {})
        if not all(isinstance(table, dict) for table in (*listed, derived)):
            raise InputError(f"disturbances and derived outputs are sections. A file looks like this:\n{EXAMPLE}")
        tuned = [i for i, q in enumerate(listed) if q.get("walk") == "tune"]
        disturbances = tuple(map(_disturbance, listed))
        observer = dict(found["observer"])
        known(observer, OBSERVER, "entry of [observer]")
        if "window" not in observer or "noise_std" not in observer:
            raise InputError("[observer] needs window (seconds, or inf) and noise_std (of the measurement, or learn)")
        if observer["noise_std"] == "learn":
            observer["noise_std"] = None
        if "false_alarms" in observer:
            observer["detector"] = detect.Parity(observer.pop("false_alarms"))
        names = _checked(plant, disturbances, inputs)
        derived = {name: _row(name, row, names, inputs) for name, row in derived.items()}
    except InputError as error:
        raise CommandError(f"--plant {path}: {error}") from None
    options = dict(plant=plant, disturbances=disturbances, derived=derived or None, **observer)
    return options, tuned


def _checked(plant, disturbances, inputs) -> list[str]:
    from driftwise.models.plant import Augmented

    system = Augmented(plant, disturbances)
    if system.inputs != len(inputs):
        raise InputError(f"B has {system.inputs} columns, and {len(inputs)} inputs are named: --input COLUMN for each")
    return system.names


def known(table, names, what) -> None:
    for name in table:
        if name not in names:
            raise InputError(f"{name!r} is no {what}: they are {', '.join(names)}")


def _disturbance(table) -> Any:
    kinds = {"frequency": models.Sinusoid, "degree": models.Polynomial}
    known(table, ("name", "into", "outputs", "prior_std", "walk", *kinds), "entry of [[disturbance]]")
    table = dict(table)
    if table.get("walk") == "tune":
        table["walk"] = 1.0
    if "prior_std" not in table:
        raise InputError(
            "[[disturbance]] needs prior_std, what it may be: inf where nothing is known, 0 to leave it out"
        )
    table.setdefault("into", 0.0)
    if "frequency" in table:
        if "degree" in table:
            raise InputError("a [[disturbance]] has a frequency or a degree, not both: list two")
        return models.Sinusoid(table.pop("frequency"), **table)
    return models.Polynomial(**table)


def _row(name, row, names, inputs):
    """Return (row on z, row on u) of a derived output."""
    if not isinstance(row, dict):
        raise InputError(f"[derived.{name}] lists names with their factors, for example {names[0]} = 1.0; got {row!r}")
    own = inputs if set(inputs) & set(row) or len(inputs) != 1 else ["u"]
    known(row, (*names, *own), f"state, disturbance or input (in [derived.{name}])")
    for key, value in row.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError(f"[derived.{name}] {key} must be a number, got {value!r}")
    return [float(row.get(key, 0.0)) for key in names], [float(row.get(key, 0.0)) for key in own]
