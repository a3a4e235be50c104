"""What `driftwise run` says beside the numbers: what was estimated, what to beware of, names for the axes."""

from __future__ import annotations

from shlex import quote

from driftwise.cli.specs import DETECTORS
from driftwise.engine.errors import InputError
from driftwise.results.numbers import SAMPLES, SECONDS, number

__all__ = ["clock_notes", "counted_in", "described", "labels", "notes", "verdicts"]

SHOWN = ("excitation", "identifiability")  # a line of their own says it


def counted_in(plan) -> str:
    """Return the unit of time: samples where neither a clock nor a step was named."""
    return SAMPLES if plan.time is None and plan.dt is None else SECONDS


def clock_notes(record) -> list[str]:
    """Return a sentence about the column that looks like the clock, where the whole table was looked at for one."""
    from driftwise.tables.autoread import recognised

    if record.whole is None:
        return []
    try:
        table = recognised(record.whole, record.output, record.inputs)
    except InputError:  # a table that is not understood as a whole
        return []
    if table.time is None:
        return []
    step = f" (a row {table.step})" if table.timed else ""
    return [
        f"column {table.time!r} looks like the clock{step}: --time {quote(table.time)}; without it, times are in "
        "samples."
    ]


def described(plan, dt: float) -> list[str]:
    """Return what kind of model was estimated, in a few words."""
    from driftwise.detect.average_run_length import rate

    inputs = len(plan.inputs)
    order = f"order {plan.order}" + (" (the most probable)" if plan.chosen else "")
    found = [
        plan.model.upper().replace(":", " ") if plan.model else order,
        "no input" if not inputs else "1 input" if inputs == 1 else f"{inputs} inputs",
    ]
    found += ["direct term"] if plan.direct else []
    memories = {
        "auto": "parameters that may drift or jump",
        "constant": "constant parameters",
        "restart": "parameters that may jump",
    }
    if plan.jumps:
        kind, _, numbers = plan.jumps.partition(":")
        memories["constant"] = memories["restart"]
        restart = [f"alarms at {DETECTORS[kind][0]}, 1 false in {number(rate(numbers.partition(',')[0]))} samples"]
    if not plan.model:
        found.append("unknown noise colour" if plan.noise == "unknown" else plan.noise)
    found += [memories.get(plan.kept, plan.kept), *(restart if plan.jumps else [])]
    return [
        *found,
        *([f"gate {plan.gate:g}"] if plan.gate else []),
        "no clock" if counted_in(plan) == SAMPLES else f"dt {number(dt, 4)} s",
    ]


def labels(record, plan) -> dict:
    """Return names with units for the axes."""

    def named(name):
        unit = record.source.units.get(name)
        return f"{name} ({unit})" if unit else name

    if record.time is None:
        time = "sample" if counted_in(plan) == SAMPLES else "time (s)"
    else:
        time = f"time since {record.clock.origin} (s)" if record.clock.origin else named(record.time)
    found = {"output": named(record.output), "inputs": [named(name) for name in record.inputs], "time": time}
    return found | ({"origin": record.clock.origin} if record.time and record.clock.origin else {})


def notes(plan, record, found) -> list[str]:
    """Return a sentence for each thing to beware of; ``found`` is what the run brought."""
    summary, offsets = found.summary, found.offsets
    said = ["stopped early; the results are those of the rows read so far."] if found.stopped else []
    said += clock_notes(record)
    if record.source.ragged:
        said.append(
            f"{record.source.ragged} rows have too many or too few cells; each was counted as a missing sample."
        )
    cells = record.bad - record.source.ragged * len(record.columns)
    if cells > 0:
        where = f" (first: {record.first_bad})" if record.first_bad else ""
        said.append(f"{cells} cells are not finite numbers and were taken as missing{where}.")
    said += [f"{text[:-1]} (--raw takes them as they stand)." for text in record.code_notes()]
    for name, value, row in offsets.extremes:
        said.append(
            f"{name!r} is {value:g} in row {row + 1}, ten thousand times farther out than the rest: an error code? "
            "Blank it, or the results are about that row."
        )
    is_said = found.study.is_poor and len(record.inputs) == 1  # by the verdict about the record
    for name, value in offsets.constants if not is_said else []:
        said.append(f"input {name!r} stayed at {value:g} in the first chunk: its effect cannot be learned there.")
    if offsets.values:
        values = ", ".join(f"{name} {number(value)}" for name, value in offsets.values.items())
        said.append(f"{plan.center}s of the first chunk were subtracted: {values} (--center none keeps the data).")
    said += record.clock.notes()
    if found.smoothing_note:
        said.append(found.smoothing_note)
    if found.evidence is not None and not plan.chosen and found.evidence.best != plan.order:
        said.append(f"order {plan.order} was estimated; the data speak for another: --order {found.evidence.best}.")
    if found.evidence is not None and plan.gate:
        said.append("orders were compared without the gate, which would reject other samples for each.")
    said += [f"{text}." for text in summary.notes]
    if offsets.values and not summary.whiteness.is_white and not summary.jumps:
        said.append(
            "the innovations are not white: a mean is not always an operating point, so try --center none (or median) "
            "before a higher order."
        )
    return said


def verdicts(diagnosis) -> list[str]:
    """Return a sentence for each verdict that is not fine and not shown anyway."""
    told = [v for v in diagnosis.not_fine if v.name not in SHOWN]
    return [f"{v.name} {v.shown} (fine: {v.limits}): {v.advice}." for v in told]
