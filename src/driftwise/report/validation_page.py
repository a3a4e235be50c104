"""The page of a validation, and its section on the pages of runs and identifications."""

from __future__ import annotations

from math import isfinite
from pathlib import Path

from driftwise.analysis.validation import FIT_HEAD, can_be_validated, fit_rows, frequency_unit, mode_head, mode_rows
from driftwise.report import curves
from driftwise.report.page import Card, Page, Panel, columns, group, say, table
from driftwise.report.panels import grade, verdict_table
from driftwise.results.numbers import fixed, grouped

SHOWN = 4  # inputs of which curves are drawn
SHADED = (
    "Shaded: where the largest stays by chance, or is no matter. Innovations go with an input at lags that the model "
    "lacks; an input that goes with what was new in the output before is steered by it."
)
HELD = "The model as it was after two thirds of the record, held: forecasts on these samples, and on the last third."


def write(found, path, title: str | None = None, notes=(), facts=()) -> Path:
    """Write the page of a `Validation` and return its path."""
    size = [f"{grouped(found.samples)} samples", *facts]
    lead = found.words if found.is_fine else f"{_asked(found)}. {found.words}"
    name = type(found.estimator).__name__
    return Page(title or f"Validation of {name}", _parts(found, notes), lead, size, _cards(found)).write(path)


def validation_panel(trace, found=None, labels=None) -> Panel | None:
    """Return the whole of it as one section, folded, of another page; nothing where the trace cannot be validated."""
    if found is None and trace.begun is not None and can_be_validated(trace):
        names = (labels or {}).get("inputs") or [(labels or {}).get("input")]
        found = trace.validate(names if len(names) == trace.u.shape[1] and all(names) else None)
    if found is None:
        return None
    body = [part for one in _parts(found) for part in (f"<h3>{one.title}</h3>", say(one.text), *one.body)]
    hint = "every test passed" if found.is_fine else _asked(found)
    return Panel("validation", "Would an engineer use this model?", "", tuple(part for part in body if part), hint)


def _asked(found) -> str:
    return f"{len(found.verdicts.not_fine)} of {len(found.verdicts)} tests ask for something"


def _parts(found, notes=()) -> list[Panel]:
    inputs = list(enumerate(found.inputs))[:SHOWN]

    def of(what: str, i: int) -> str:
        return f"{what} of {found.inputs[i]}" if len(found.inputs) > 1 else what

    left = []
    for j, (name, one) in enumerate(found.correlated.items()):
        if one.is_known:
            back = name.startswith("feedback")
            what = "input with output before" if back else "innovations with input"
            _, _, whose = name.partition(" of ")
            left.append(curves.correlated(f"crossed{j}", one, f"{what}{f' ({whose})' if whose else ''}"))
    parts = [
        Panel("tests", "What is left in the innovations", "Each test is at a level of 1 %.", (
            verdict_table(found.verdicts), *columns(left[: 2 * SHOWN]),
            say(SHADED) * bool(left),
        )),
    ]  # fmt: skip
    if found.fresh:
        parts.append(
            Panel(
                "ahead",
                "Forecasts on fresh data",
                HELD,
                (table(list(FIT_HEAD), list(map(list, fit_rows(found))), (0,)),),
            )
        )
    if inputs:
        steps = [curves.step(f"step{i}", found.steps[i], found.unit) for i, _ in inputs]
        parts.append(
            Panel(
                "steps",
                "Step response",
                f"{_order(found)}Shaded: 95 %, of draws from the posterior.",
                tuple(columns(steps)),
            )
        )
        for i, _ in inputs:
            one = found.frequencies[i]
            body = (
                *columns(curves.bode(f"bode{i}", one, f"frequency ({frequency_unit(found)})")),
                (curves.nyquist(f"nyquist{i}", one),),
            )
            words = "Gain and phase with 95 % bands; below in the plane, with 95 % ellipses; the cross is -1."
            parts.append(Panel(f"frequencies{i}", of("Bode and Nyquist", i), words, body))
    if found.modes:
        parts.append(Panel("modes", "Poles in time", "One of each pair; \u00b1 one standard error.",
                           (table(list(mode_head(found)), list(map(list, mode_rows(found))), (0,)),)))  # fmt: skip
    if notes:
        parts.append(Panel("notes", "Notes", "", tuple(map(say, notes))))
    return parts


def _order(found) -> str:
    return f"From {', '.join(found.inputs)}. " if len(found.inputs) > 1 else ""


def _cards(found) -> list[str]:
    tests = found.verdicts
    shown = [Card("Tests passed", f"{len(tests) - len(tests.not_fine)} of {len(tests)}",
                  ", ".join(v.name for v in tests.not_fine) or "nothing asks for attention",
                  grade(found.is_fine, len(tests.not_fine) < 2))]  # fmt: skip
    fits = [
        Card(f"Fit, {fit.name}", fixed(fit.fit, 1), "on fresh data", unit="%")
        for fit in found.fresh
        if isfinite(fit.fit) and fit.steps != 5
    ]
    return [group("Tests", shown), *([group("Fresh data", fits)] if fits else [])]
