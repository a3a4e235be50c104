"""Fleets beyond one machine, by Apache Spark: `scan` a table, follow a `stream`; the numbers of one machine."""

import importlib

_HOME = {"run_on_spark": "run", "scan": "batch", "scan_states": "batch", "fleet_of": "batch", "stream": "streaming"}

__all__ = list(_HOME)


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module 'driftwise.spark' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"driftwise.spark.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__():
    return sorted([*globals(), *__all__])
