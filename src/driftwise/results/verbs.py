"""Verbs of a result that stand on a higher floor: drawing, reporting, diagnosing; loaded when called."""

from __future__ import annotations

from importlib import import_module
from typing import Any

VERBS: dict[str, dict[str, str]] = {  # verb, kind of result: module and function, asked with the result first
    "plot": {
        "Trace": "report.figure:plot",
        "TraceMIMO": "report.figure:plot_mimo",
        "ObserverTrace": "report.figure:plot_observer",
        "SmoothedParameters": "report.figure:plot_smoothed",
    },
    "report": {
        "Trace": "report.run_page:write",
        "ObserverTrace": "report.observer_page:write",
        "Identification": "report.identification_page:write",
        "Tracks": "report.tracks_page:write",
    },
    "diagnose": {
        "Trace": "analysis.diagnose:diagnose",
        "TraceMIMO": "analysis.diagnose:of_equations",
        "ObserverTrace": "analysis.diagnose:of_observer",
    },
    "what_changed": {"Trace": "analysis.score_after_jump:what_changed"},
    "write": {"Tracks": "tracking.write:write"},
}


def call(verb: str, result: Any, *args, **options) -> Any:
    """Return what a verb makes of a result, by the nearest of its kinds in the table."""
    kinds = VERBS[verb]
    place = next(kinds[kind.__name__] for kind in type(result).__mro__ if kind.__name__ in kinds)
    module, _, name = place.partition(":")
    return getattr(import_module(f"{__package__.partition('.')[0]}.{module}"), name)(result, *args, **options)
