"""Verbs of results and estimators that stand on a higher floor: drawing, reporting, diagnosing; loaded when called."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ..engine.errors import InputError

VERBS: dict[str, dict[str, str]] = {  # verb, kind of result: module and function, asked with the result first
    "plot": {
        "ParameterTrace": "report.figure:plot",
        "ObserverTrace": "report.figure:plot_observer",
        "SmoothedParameters": "report.figure:plot_smoothed",
    },
    "plot outputs": {"ParameterTrace": "report.figure:plot_mimo"},
    "report": {
        "ParameterTrace": "report.run_page:write",
        "ObserverTrace": "report.observer_page:write",
        "StateTrace": "report.state_space_page:write",
        "GreyBoxTrace": "report.grey_box_page:write",
        "Identification": "report.identification_page:write",
        "Validation": "report.validation_page:write",
        "Tracks": "report.tracks_page:write",
    },
    "diagnose": {
        "ParameterTrace": "analysis.diagnose:diagnose",
        "ObserverTrace": "analysis.diagnose:of_observer",
    },
    "validate": {"ParameterTrace": "analysis.validation:validate"},
    "what_changed": {"ParameterTrace": "analysis.score_after_jump:what_changed"},
    "export": {"Estimator": "export.folder:export"},
    "write": {"Tracks": "tracking.write:write"},
}


def call(verb: str, result: Any, *args, **options) -> Any:
    """Return what a verb makes of a result, by the nearest of its kinds in the table."""
    kinds, names = VERBS[verb], [kind.__name__ for kind in type(result).__mro__]
    place = next((kinds[name] for name in names if name in kinds), None)
    if place is None:
        raise InputError(f"there is no {verb} of {names[0]}: of {', '.join(kinds)} there is")
    module, _, name = place.partition(":")
    return getattr(import_module(f"{__package__.partition('.')[0]}.{module}"), name)(result, *args, **options)
