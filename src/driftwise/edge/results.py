"""The results of a run as JSON."""

from __future__ import annotations

import json
import math
import sys

__all__ = ["write_json"]


def write_json(plan, record, estimator, summary, offsets, notes) -> None:
    """Write what was estimated, from what, and how well."""
    import driftwise

    content = {
        "driftwise": driftwise.__version__,
        "file": plan.file,
        "columns": {"output": record.output, "inputs": list(record.inputs), "time": record.time},
        "estimator": {
            "order": plan.order, "inputs": len(record.inputs), "direct": plan.direct, "noise": plan.noise,
            "memory": plan.memory, "gate": plan.gate, "dt": estimator.dt, "names": list(estimator.names),
        },
        "offsets": offsets.values,
        "time": {
            "origin": record.clock.origin, "duplicates": record.clock.duplicates,
            "decreases": record.clock.decreases, "gaps": record.clock.gaps, "missing": record.clock.missing,
        },
        "ragged_rows": record.ragged,
        "bad_cells": record.bad,
        "notes": notes,
        "summary": summary.as_dict(),
    }  # fmt: skip
    text = json.dumps(_plain(content), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    if plan.json == "-":
        sys.stdout.write(text)
        return
    with open(plan.json, "w", encoding="utf-8") as file:
        file.write(text)


def _plain(value):
    """Return the value in types that JSON knows; what is not finite becomes null."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, complex):
        return {"re": _plain(value.real), "im": _plain(value.imag)}
    if isinstance(value, bool | str | int) or value is None:
        return value
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    return float(value) if math.isfinite(value) else None
