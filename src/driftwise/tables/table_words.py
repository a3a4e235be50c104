"""What was recognised of a table, as claims in plain sentences."""

from __future__ import annotations

from typing import Any

from ..results.claims import Claim, told
from ..results.numbers import count_of, lasting, listed, percent
from .counts import SPREADSHEET
from .sampling import LONGEST_GAP, RESTART_ROWS

SHOWN = 3  # segments that a note lists
MOST_LIKELY = 0.9  # of two readings together, below which a third is spoken of


def words_of(table: Any) -> str:
    """Return the proposal in one paragraph."""
    return told(column_claims(table))


def column_claims(table: Any) -> list[Claim]:
    """Return what the columns are taken for."""
    output = table[table.output]
    inputs = [table[name] for name in table.inputs]
    found = [Claim("column", "output", f"The output is {_called(output)} ({output.why}).", table.output)]
    driven = "No column drives it."
    if inputs:
        driven = f"It is driven by {listed([f'{_called(c)} ({c.why})' for c in inputs])}."
    if any(column.helps for column in inputs):
        driven += (
            " Percentages are what its past takes off the error variance of a prediction, beside inputs that help more."
        )
    found.append(Claim("column", "inputs", driven, tuple(table.inputs)))
    if table.sampling.kind == "none":
        still = f"{table.time!r} does not tick" if table.time else "There is no clock"
        apart = lasting(table.dt) if table.timed else "one step"
        clock = f"{still}: rows are samples {apart} apart."
    else:
        step = lasting(table.sampling.dt) if table.timed else f"{table.sampling.dt:.6g} in its own unit"
        clock = f"The clock is {table.time!r}, one sample every {step}."
    found.append(Claim("clock", table.time or "", clock, table.dt))
    reasons: dict[str, list[str]] = {}
    for column in table.columns:
        if column.role not in ("time", "output", "input"):
            reasons.setdefault(column.why or column.role, []).append(repr(column.name))
    if reasons:
        shown = [f"{listed(names[:6] + ['others'] * (len(names) > 6))} ({why})" for why, names in reasons.items()]
        names = tuple(c.name for c in table.columns if c.role not in ("time", "output", "input"))
        found.append(Claim("column", "left out", f"Left out: {'; '.join(shown)}.", names))
    if not {"output", "inputs"} <= table.given:
        found.append(Claim("column", "advice", "Name the columns if that is not what you meant."))
    return found


def reading_words(reading: Any) -> str:
    """Return one way to read a table in a few words."""
    driven = f"driven by {listed([repr(name) for name in reading.inputs])}" if reading.inputs else "with no input"
    return f"{reading.output!r} {driven}"


def taken_words(table: Any) -> str:
    """Return which of the readings that are left open was taken."""
    first, *others = table.alternatives
    rest = " or ".join(f"{reading_words(one)} ({_likely(one)})" for one in others)
    return (
        f"The columns can be read in more than one way, and the likelier is taken: {reading_words(first)} "
        f"({_likely(first)}), not {rest}."
    )


def asked_words(table: Any, commands: list[str]) -> list[str]:
    """Return the readings that are left open as lines, each with its evidence and the command that takes it."""
    lines = ["The columns can be read in more than one way, and nothing decides: nothing was estimated."]
    for count, (one, command) in enumerate(zip(table.alternatives, commands), 1):
        lines += [f"{count}. {reading_words(one)}, {_likely(one)}: {one.evidence}.", f"   {command}"]
    rest = [repr(name) for name in table.rivals if name not in {one.output for one in table.alternatives}]
    if rest and sum(one.share for one in table.alternatives) < MOST_LIKELY:
        lines += [f"Nor is it known that the output is none of {listed(rest)}: whoever knows names it, with -o."]
    return [*lines, "Or let the likelier be taken: --take-best."]


def _likely(reading: Any) -> str:
    return f"{100 * reading.share:.0f} %"


def notes_of(table: Any) -> list[str]:
    """Return what an engineer should know of the table, a sentence each."""
    return [claim.text for claim in table_claims(table)]


def table_claims(table: Any) -> list[Claim]:
    """Return what is odd in the table."""
    otherwise = [Claim("table", "rows", said) for said in table.otherwise]
    return [*otherwise, *_sampling_notes(table), *_value_notes(table)]


def _sampling_notes(table: Any) -> list[Claim]:
    s, unit = table.sampling, " s" if table.timed else ""
    notes: list[Claim] = []

    def add(text, value=None):
        notes.append(Claim("table", table.time or "", text, value))

    if table.count.origin == SPREADSHEET:
        add(f"{table.time!r} is taken for days since 1900, as a spreadsheet counts them.")
    if s.rest is not None:
        add(f"{table.time!r} leaves out two days of each week: a sample is a working day, and spans count these alone.")
    if s.kind == "uneven":
        add(
            f"{table.time!r} steps unevenly, {s.low:.3g} to {s.high:.3g}{unit}: samples are taken as {s.dt:.4g}{unit} "
            "apart, which blurs time constants by about that spread.",
            s.dt,
        )
    if s.kind == "irregular":
        add(
            f"{table.time!r} steps by {s.low:.3g} to {s.high:.3g}{unit}: rows are sampled every {s.dt:.4g}{unit}. "
            "Inputs are held between rows, outputs are missing there, and of rows closer than that the last counts.",
            s.dt,
        )
    if s.gaps:
        add(
            f"{count_of(s.gaps, 'gap')} in {table.time!r}, the longest {s.longest:.6g}{unit}: missing samples are "
            "put in, so that time moves.",
            s.gaps,
        )
    if s.restarts:
        add(
            f"{table.time!r} starts again {count_of(s.restarts, 'time')} (it goes back, or is silent for more than "
            f"{LONGEST_GAP} samples): {RESTART_ROWS} missing samples stand for each break.",
            s.restarts,
        )
    if s.set_back:
        add(
            f"{table.time!r} was set back {count_of(s.set_back, 'time')} while rows went on: they are counted on, and "
            "dates are those of the table.",
            s.set_back,
        )
    if table.stacked:
        names = listed(list(map(repr, table.stacked))) + (" names" if len(table.stacked) == 1 else " name")
        add(
            f"{names} {table.recordings} recordings, one below the other, and one plant is fitted to all of them: keep "
            "the rows of one to learn of that one alone. What changes from one to the next is not told.",
            table.recordings,
        )
    if s.shared is not None:
        add(
            f"Rows share stamps of {table.time!r}, which shows steps of {s.shared.tick:.6g}{unit}: they are taken as "
            f"{s.shared.step:.4g}{unit} apart.",
            s.shared.step,
        )
    elif s.duplicates:
        add(
            f"{count_of(s.duplicates, 'stamp')} of {table.time!r} repeat the one before; the first row counts.",
            s.duplicates,
        )
    if s.late:
        add(f"{count_of(s.late, 'stamp')} of {table.time!r} come late; those rows are left out.", s.late)
    return notes


def _value_notes(table: Any) -> list[Claim]:
    notes: list[Claim] = []

    def add(column, text, value=None):
        notes.append(Claim("table", column.name, text, value))

    for column in table.columns:
        if column.role not in ("output", "input", "stuck"):
            continue
        called = _called(column)
        if column.ten:
            add(column, f"{called} is counted in units of 1e{column.ten}.", column.ten)
        belief = column.belief
        if column.doubted:
            what = []
            if belief.codes:
                what.append(f"{listed([f'{code:g}' for code in belief.codes])} for a missing value")
            if belief.rail == belief.rail:
                what.append(f"drop-outs to {belief.rail:g}")
            if belief.seen:
                what.append("single samples far outside that return")
            add(
                column,
                f"{count_of(column.doubted, 'value')} of {called} not believed ({listed(what)}) and taken as missing; "
                f"the rest is between {belief.low:.6g} and {belief.high:.6g}.",
                column.doubted,
            )
        if column.missing > 0.0:
            add(column, f"{percent(column.missing)} of {called} is missing.", column.missing)
        if column.role == "stuck":
            add(column, f"{called} {column.why}: stuck, and left out.")
        elif column.stuck:
            where = _stuck(column.stuck, table.rows)
            add(column, f"{called} {where}: stuck, and taken as missing there.", len(column.stuck))
        if column.resolution and column.role == "output":
            step = column.resolution
            add(column, f"{called} is written in steps of {step:g}: nothing finer can be known of it.", step)
    return notes


def _stuck(segments: Any, rows: int) -> str:
    """Return which reading was repeated where, rows counted from 1."""
    said = []
    for start, stop, value in segments[:SHOWN]:
        where = f"from row {start + 1} on" if stop == rows else f"from row {start + 1} to {stop}"
        said.append(f"{value:.6g} {where}")
    return f"reads {listed(said)}" + (f" and {len(segments) - SHOWN} times more" if len(segments) > SHOWN else "")


def _called(column: Any) -> str:
    return f"{column.name!r}" + (f" in {column.unit}" if column.unit and column.unit not in column.name else "")
