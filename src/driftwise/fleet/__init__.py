"""Ten thousand plants: one row of numbers for each, found by its key."""

from ..engine.lazy import lazily

_HOME = {
    "FleetJob": "job",
    "run_fleet": "fleet_run",
    "Fleet": "fleet",
}

__all__ = list(_HOME)
__getattr__, __dir__ = lazily(__name__, _HOME)
