"""Upgrades of what earlier versions wrote, the only place that knows old names: its tables grow and never change."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ..engine.errors import InputError

SCHEMA = 5  # 5: policies and parts of a state carry the field's names; 4: a trace keeps the dof of each prediction

KINDS = {  # of schema 4, and what they are called since
    "Never": "Constant", "Walk": "RandomWalk", "Weighted": "ExponentialForgetting", "LimitedGain": "GainFloor",
    "UntilJump": "RestartOnChange", "Inflate": "CovarianceInflation", "RunLengths": "BayesianChangePoint",
    "Auto": "AutoMemory", "Bank": "MultipleModel", "Interacting": "IMM", "Correlation": "AutocovarianceLS",
    "Hinkley": "PageHinkley", "Score": "ScoreCUSUM", "VarianceChange": "VarianceCUSUM", "Gate": "InnovationGate",
    "UnknownScale": "InverseGamma",
}  # fmt: skip
SETTINGS = {  # of a kind of schema 4, those with another name since
    "Weighted": {"p": "lam"},
    "DirectionalForgetting": {"p": "lam"},
    "UntilJump": {"restart": "response"},
}
PARTS = {  # of a state of schema 4
    "cells": "memory_state", "marks": "detector_state", "unsure": "input_variance", "ydoubt": "ys_covariance",
    "udoubt": "us_variance", "doubt": "input_missed",
}  # fmt: skip


def upgraded(data: dict[str, Any]) -> dict[str, Any]:
    """Return the settings of an estimator as this version writes them; refuse those of any other."""
    found = data.get("schema")
    if found == 4:
        return {**data, "schema": SCHEMA, "options": {name: renamed(v) for name, v in data["options"].items()}}
    if found != SCHEMA:
        newer = isinstance(found, int) and found > SCHEMA
        advice = "update driftwise" if newer else "start afresh: a state of that version cannot be continued"
        raise InputError(f"written with schema {found}, this version reads 4 to {SCHEMA}; {advice}")
    return data


def renamed(value: Any) -> Any:
    """Return a setting of schema 4 under the names of schema 5."""
    if isinstance(value, list):
        return [renamed(one) for one in value]
    if not isinstance(value, dict) or value["kind"] == "estimator":  # whose text has a schema of its own
        return value
    names = SETTINGS.get(value["kind"], {})
    fields = {names.get(name, name): renamed(one) for name, one in value.items() if name != "kind"}
    return {"kind": KINDS.get(value["kind"], value["kind"]), **fields}


def parts(fields: list) -> list:
    """Return [name, size] of the parts of a state of schema 4, those of no size left out, under today's names."""
    return [[PARTS.get(name, name), size] for name, size in fields if size]


# --- rows of AutoMemory, which kept two more banks before its trials were what they are, and of an average, whose mean
# was by likelihood alone ----------------------------------------------------------------------------------------------


class Piece(NamedTuple):
    """Neighbouring numbers of a row: how many there were, how many there are, what makes them, and of what they are."""

    before: int
    now: int
    again: Any = None  # function of the numbers and of this
    owner: Any = None


def rows(estimator, found: np.ndarray) -> np.ndarray:
    """Return rows of states, (.., numbers), as this version lays them out; any that are not of the former, as they are.

    What `AutoMemory` had learnt goes on: its filters, speeds, outliers. A trial that ran is begun again if need be. An
    average goes on from its weights by likelihood.
    """
    pieces = list(_pieces(estimator))
    if not found.ndim or found.shape[-1] != sum(p.before for p in pieces):
        return found
    parts, at = [], 0
    for piece in pieces:
        part = found[..., at : at + piece.before]
        parts.append(part if piece.again is None else piece.again(part, piece))
        at += piece.before
    return np.concatenate(parts, axis=-1)


def table(estimator, found: np.ndarray, width: int) -> np.ndarray:
    """Return the table of a trace with a column for each of today's filters: those of trials had no weight."""
    from ..memory.auto import AutoMemoryKernel
    from ..memory.trial_state import COPIES

    if not any(isinstance(policy, AutoMemoryKernel) for policy in getattr(estimator, "policies", ())):
        return found
    if found.ndim != 2 or found.shape[1] != width - 3 * COPIES:
        return found
    return np.insert(found, [estimator.columns["mixture"].stop - 3 * COPIES] * 3 * COPIES, 0.0, axis=1)


def fields(estimator) -> list:
    """Return [name, size] of the parts of a state as they were, those of no size left out."""
    found: dict[str, int] = {}
    for name, sizes in _parts(estimator):
        found[name] = sum(piece.before for piece in sizes)
    return [[name, size] for name, size in found.items() if size]


def _pieces(estimator) -> Iterator[Piece]:
    for _, pieces in _parts(estimator):
        yield from pieces


def _parts(estimator) -> Iterator[tuple[str, list[Piece]]]:
    """Yield each part of a row, and the pieces it is made of."""
    from ..memory.auto import AutoMemoryKernel

    members = {f"member{i}": one for i, one in enumerate(getattr(estimator, "members", ()))}
    for name in estimator.dtype.names:
        size = estimator.dtype[name].itemsize // 8
        if name in members:
            yield name, list(_pieces(members[name]))
            continue
        if members and name == "own":
            yield name, [_average(estimator, size)]
            continue
        kept = []
        if name == "memory_state":
            policies = [policy for one in getattr(estimator, "parts", [estimator]) for policy in one.policies]
            kept = [policy for policy in policies if isinstance(policy, AutoMemoryKernel)]
        pieces = [_piece(memory) for memory in kept]
        yield name, pieces if sum(p.now for p in pieces) == size else [Piece(size, size)]


def _piece(memory) -> Piece:
    """Return how long the part of an `AutoMemory` was and is."""
    from ..memory.auto_state import HEAD, MODES
    from ..memory.bank import bank_size
    from ..memory.likelihood_drift import learner_size
    from ..memory.modes import size_of
    from ..memory.unknown_drift import drift_state_size

    N = memory.cap.size
    own = HEAD + bank_size(N, MODES) + 2 * MODES * size_of(N) + learner_size(N, N)
    return Piece(drift_state_size(N, own), memory.state_size(N), _auto, memory)


def _average(estimator, size: int) -> Piece:
    """Return how long what an average keeps of its own was and is."""
    start = estimator.start()["own"]
    before = sum(start[name].size for name in start.dtype.names[: start.dtype.names.index("brief")])
    return Piece(before, size, _blended, start)


def _blended(was: np.ndarray, piece: Piece) -> np.ndarray:
    """Return what an average keeps, with weights by squared errors: those by likelihood, for a beginning."""
    now = np.broadcast_to(np.atleast_1d(piece.owner).view(float), (*was.shape[:-1], piece.now)).copy()
    now[..., : piece.before] = was
    found = now.view(piece.owner.dtype)[..., 0]
    found["brief"] = found["lasting"] = found["logs"]
    return now


def _auto(was: np.ndarray, piece: Piece) -> np.ndarray:
    """Return what one `AutoMemory` keeps; it kept on, age, jumped, louder, verdict, rho, clean, and three banks."""
    from ..memory.auto_constants import ISOLATED
    from ..memory.auto_state import CLEAN, HEAD, IS_ISOLATED, MODES, RHO
    from ..memory.bank import bank_size
    from ..memory.likelihood_drift import learner_size
    from ..memory.unknown_drift import drift_state_size

    N = piece.owner.cap.size
    begin, learner = drift_state_size(N), learner_size(N, N)
    filters = begin + HEAD + bank_size(N, MODES)
    now = np.zeros((*was.shape[:-1], piece.now))
    now[..., :filters] = was[..., :filters]
    now[..., -learner:] = was[..., -learner:]
    head = now[..., begin : begin + HEAD]
    rho, clean = head[..., 5].copy(), head[..., 6].copy()
    head[...] = 0.0
    head[..., RHO], head[..., CLEAN], head[..., IS_ISOLATED] = rho, clean, clean >= ISOLATED
    return now
