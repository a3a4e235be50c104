"""What `driftwise run` says beside the numbers: what was estimated, what to beware of, names for the axes."""

from __future__ import annotations

from shlex import quote

from driftwise.cli.run_options import AUTO
from driftwise.detect.registry import by_word
from driftwise.results.numbers import number
from driftwise.results.sentences import named_model_words
from driftwise.tables.table_words import taken_words

STOPPED = "stopped early; the results are those of the rows read so far."
SHOWN = ("excitation", "identifiability")  # a line of their own says it


def unreadable(cells: int) -> str:
    """Return what is said of cells that could not be read, without the full stop."""
    if cells == 1:
        return "1 cell is neither a number below 1e100 nor a time, and was taken as missing"
    return f"{cells} cells are neither numbers below 1e100 nor times, and were taken as missing"


def clock_notes(record) -> list[str]:
    """Return a sentence about the column that looks like the clock, where none was named."""
    table = record.table
    if table is None or table.time is None:
        return []
    step = f" (a row {table.step})" if table.timed else ""
    return [
        f"column {table.time!r} looks like the clock{step}: --time {quote(table.time)}; without it, times are in "
        "samples."
    ]


def described(job) -> list[str]:
    """Return what kind of model was estimated, in a few words."""
    from driftwise.detect.average_run_length import rate

    inputs = len(job.inputs)
    order = f"order {job.order}" + (" (the most probable)" if job.is_chosen else "")
    found = [
        job.model.upper().replace(":", " ") if job.model else order,
        "no input" if not inputs else "1 input" if inputs == 1 else f"{inputs} inputs",
    ]
    found += ["direct term"] if job.direct else []
    memories = {
        "auto": "parameters that may drift or jump",
        "constant": "constant parameters",
        "restart": "parameters that may jump",
    }
    if job.jumps:
        kind, _, numbers = job.jumps.partition(":")
        memories["constant"] = memories["restart"]
        restart = [f"alarms at {by_word()[kind].about}, 1 false in {number(rate(numbers.partition(',')[0]))} samples"]
    if not job.model:
        found.append("unknown noise colour" if job.noise == "unknown" else job.noise)
    found += [memories.get(job.memory_word, job.memory_word), *(restart if job.jumps else [])]
    return [
        *found,
        *([f"gate {job.gate:g}"] if job.gate else []),
        f"dt {number(job.estimator.dt, 4)} s" if job.has_clock else "no clock",
    ]


def model_words(job) -> str:
    """Return which columns were taken, where nobody named them, which model, and why."""
    found = job.table
    taken = [] if found is None else [taken_words(found)] if found.is_ambiguous else [found.words]
    name = job.model.upper().replace(":", " ") if job.model else f"the joint filter of order {job.order}"
    if job.model:
        why = "--model names it, and no other was tried (--model auto compares)"
    elif job.is_chosen:
        why = f"the most probable of the orders {job.orders or AUTO}"
    elif "--order" in job.changed:
        why = "--order names it, and no other was tried (--order auto compares)"
    else:
        why = f"neither --model nor --order was named beside {', '.join(job.changed)} (--model auto compares)"
    return " ".join([*taken, named_model_words(name, job.offset, why)])


def labels(job) -> dict:
    """Return names with units for the axes."""
    record = job.record
    if record.time is None:
        time = "time (s)" if job.has_clock else "sample"
    else:
        time = f"time since {record.clock.origin} (s)" if record.clock.origin else job.named(record.time)
    found = {"output": job.named(record.output), "inputs": [job.named(name) for name in record.inputs], "time": time}
    return found | ({"origin": record.clock.origin} if record.time and record.clock.origin else {})


def notes(job) -> list[str]:
    """Return a sentence for each thing to beware of in what a run brought."""
    record, summary, offsets = job.record, job.summary, job.offsets
    said = [STOPPED] if job.is_stopped else []
    said += [] if job.table is None else job.table.notes
    said += [*record.otherwise, *clock_notes(record)]
    if record.source.ragged:
        said.append(f"{_rows(record.source.ragged)} too many or too few cells; each was counted as a missing sample.")
    cells = record.bad - record.source.ragged * len(record.columns)
    if cells > 0:
        where = f" (first: {record.first_bad})" if record.first_bad else ""
        said.append(f"{unreadable(cells)}{where}.")
    said += [f"{text[:-1]} (--raw takes them as they stand)." for text in record.code_notes()]
    said += record.unit_notes()
    for name, value, row in offsets.extremes:
        said.append(
            f"{name!r} is {value:g} in row {row + 1}, ten thousand times farther out than the rest: an error code? "
            "Blank it, or the results are about that row."
        )
    is_said = job.study.is_poor and len(record.inputs) == 1  # by the verdict about the record
    for name, value in offsets.constants if not is_said else []:
        said.append(f"input {name!r} stayed at {value:g} in the first chunk: its effect cannot be learned there.")
    if offsets.values:
        values = ", ".join(f"{name} {number(value)}" for name, value in offsets.values.items())
        why = "the offset counts from them" if job.is_estimated else "--offset estimated estimates what is left"
        said.append(
            f"{job.center}s of the first chunk were subtracted: {values} ({why}; --offset none keeps the data)."
        )
    said += record.clock.notes()
    if job.smoothing_note:
        said.append(job.smoothing_note)
    if job.evidence is not None and not job.is_chosen and job.evidence.best != job.order:
        said.append(f"order {job.order} was estimated; the data speak for another: --order {job.evidence.best}.")
    if job.evidence is not None and job.gate:
        said.append("orders were compared without the gate, which would reject other samples for each.")
    said += [f"{text}." for text in summary.notes]
    if offsets.values and not job.is_estimated and not summary.whiteness.is_white and not summary.jumps:
        said.append(
            f"the innovations are not white: a {job.center} is not always an operating point, so try "
            "--offset estimated before a higher order."
        )
    return said


def verdicts(diagnosis) -> list[str]:
    """Return a sentence for each verdict that is not fine and not shown anyway."""
    unsaid = [v for v in diagnosis.not_fine if v.name not in SHOWN]
    return [f"{v.name} {v.shown} (fine: {v.limits}): {v.advice}." for v in unsaid]


def _rows(count: int) -> str:
    return "1 row has" if count == 1 else f"{count} rows have"
