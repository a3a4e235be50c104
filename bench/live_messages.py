"""Messages for `driftwise live`, of two hundred series in turn."""

from __future__ import annotations

import json

import numpy as np

TOPICS = 200


def messages(count: int, size: int, first: int = 0) -> list[tuple[str, bytes]]:
    """Return so many messages of so many samples, of 200 series in turn."""
    rng, found = np.random.default_rng(1), []
    for i in range(count):
        at = first + i // TOPICS * size
        times, values = [1e9 + at + j for j in range(size)], rng.standard_normal(size).round(4).tolist()
        body = {"time": times, "value": values} if size > 1 else {"time": times[0], "value": values[0]}
        found.append((f"s{i % TOPICS}", json.dumps(body).encode()))
    return found
