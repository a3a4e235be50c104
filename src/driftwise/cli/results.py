"""Results as JSON: those of a run, and the writing of any."""

from __future__ import annotations

import json
import math
import sys

from driftwise.engine.atomic import write_text
from driftwise.report.printed import as_json


def content(job) -> dict:
    """Return what was estimated, from what, and how well."""
    estimator, record = job.estimator, job.record
    return {
        "file": job.file,
        "columns": {"output": record.output, "inputs": list(record.inputs), "time": record.time},
        "estimator": {
            "model": job.model, "order": None if job.model else job.order,
            "inputs": len(record.inputs), "direct": job.direct, "noise": job.noise,
            "memory": job.memory_word, "jumps": job.jumps, "gate": job.gate,
            "dt": estimator.dt, "names": list(estimator.names),
        },
        "offsets": job.offsets.values,
        "words": job.words,
        "time": {
            "origin": record.clock.origin, "duplicates": record.clock.duplicates,
            "decreases": record.clock.decreases, "gaps": record.clock.gaps, "missing": record.clock.missing,
        },
        "ragged_rows": record.source.ragged,
        "bad_cells": record.bad,
        "notes": job.notes,
        "summary": job.summary.as_dict(),
        "verdicts": job.trace.diagnosis.as_dict(),
        "jumps": [{"sample": event.sample, "time": event.time, "words": event.text} for event in job.keeper.jumps],
        "identifiability": job.study.as_dict(),
        "orders": None if job.evidence is None else job.evidence.as_dict(),
        "smoothed": None if job.smoothed is None else _smoothed(job.smoothed),
    }  # fmt: skip


def write(content, path: str) -> None:
    """Write JSON to a file, or to standard output where the path is -; what is not finite becomes null."""
    text = line(content, indent=2)
    if path == "-":
        if not (sys.stdout.encoding or "").lower().startswith("utf"):  # JSON has its own spelling of every letter
            text = json.dumps(json.loads(text), indent=2) + "\n"
        sys.stdout.write(text)
        return
    write_text(path, text)


def line(content, indent: int | None = None) -> str:
    """Return JSON with its end of line; what is not finite becomes null."""
    return as_json(_plain(content), indent) + "\n"


def _smoothed(smoothed):
    """Return the smoothed parameters at the first and the last sample; all of them are in the saved table."""
    rows = zip(smoothed.names, smoothed.parameters[0], smoothed.parameters_std[0],
               smoothed.parameters[-1], smoothed.parameters_std[-1])  # fmt: skip
    names = ("name", "first", "first_std", "last", "last_std")
    found = {"lag": smoothed.lag, "parameters": [dict(zip(names, row)) for row in rows]}
    return found if smoothed.estimator.model.n else found | _hindsight(smoothed)


def _hindsight(smoothed):
    """Return what the record says of the drift."""
    return {
        "drift": smoothed.drift, "nvr": dict(zip(smoothed.names, smoothed.nvr)), "noise_std": smoothed.noise_std,
        "jumps": [{"sample": jump.sample, "time": jump.time, "words": jump.text} for jump in smoothed.jumps],
        "words": smoothed.words,
    }  # fmt: skip


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
