"""Bodies of requests become samples."""

from __future__ import annotations

from math import isnan

from driftwise.engine.errors import InputError
from driftwise.live.board import Sample
from driftwise.live.decode import influx_lines, json_lines


def samples_of(body: bytes, kind: str) -> tuple[list[Sample], list[str]]:
    """Return the samples of a body, and why lines of it were refused.

    Parameters
    ----------
    kind : "json" for JSON, a line each (an object, a list of them, lists of values by name), or "influx"
    """
    samples: list[Sample] = []
    refused = []
    for found in json_lines(body) if kind == "json" else influx_lines(body):
        if isinstance(found, InputError):
            refused.append(str(found).encode("utf-8", "replace").decode())
            continue
        times = [None if isnan(time) else time for time in found.time]
        names = list(found.fields)
        columns = zip(times, *found.fields.values())
        samples += [Sample(found.key, dict(zip(names, values)), time) for time, *values in columns]
    return samples, refused
