"""Names in what earlier versions wrote, the only place that knows them: its tables grow and never change."""

from __future__ import annotations

from typing import Any

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
