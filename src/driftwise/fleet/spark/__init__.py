"""Fleets beyond one machine, by Apache Spark: `scan` a table, follow a `stream`; the numbers of one machine."""

from ...engine.lazy import lazily

_HOME = {"run_on_spark": "run", "scan": "batch", "scan_states": "batch", "fleet_of": "batch", "stream": "streaming"}

__all__ = list(_HOME)
__getattr__, __dir__ = lazily(__name__, _HOME)
