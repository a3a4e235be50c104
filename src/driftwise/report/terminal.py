"""What the commands print: what was found, how far to trust it, what went wrong."""

from __future__ import annotations

import functools
from math import inf
from typing import Any

from driftwise.engine.errors import brief
from driftwise.report.printed import console, say
from driftwise.report.roots import own_zeros
from driftwise.results.numbers import SAMPLES, bound, chance, fixed, near_one, number, percent, plus_minus, probable
from driftwise.results.sentences import SOMETHING

JUMPS = 8  # times of jumps printed
GAP = 3  # columns between tables
SO_FAR = {"mean": "mean so far"}  # a forecast knows no other
CANDIDATES = 6  # that are listed
MOST_TRACKS = 20  # listed
MOST_SERIES = 3  # of each kind


# --- building blocks -----------------------------------------------------------------------------------------


def head(out, title: str, *lines) -> None:
    """Print a title, and quiet lines of what there was in a few words each."""
    from rich.text import Text

    out.print()
    out.print(Text(title, style="bold"))
    for words in lines:
        out.print(Text(brief(" \u00b7 ".join(filter(None, words))), style="dim"))
    out.print()


def foot(out, *, beware=(), label: str = "note") -> None:
    """Print sentences behind a label that stands out."""
    from rich.text import Text

    for text in beware:
        out.print(Text(f"{label}: ", style="yellow") + Text(brief(text)))


def table(*columns: tuple[str, str]) -> Any:
    """Return an empty table of columns (name, "left" or "right")."""
    from rich import box

    table = _table_or_list()(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    for name, justify in columns:
        table.add_column(name, justify=justify, no_wrap=True, header_style="dim")
    return table


@functools.cache
def _table_or_list() -> type:
    from rich.measure import Measurement
    from rich.padding import Padding
    from rich.table import Table
    from rich.text import Text

    class TableOrList(Table):
        """A table where there is room for it; no number is ever cut: else a list, each row under its first cell."""

        def __rich_console__(self, console, options):
            whole = Measurement.get(console, options.update(max_width=10_000), self)
            if whole.minimum <= options.max_width:
                yield from super().__rich_console__(console, options)
                return
            names = [" ".join(str(column.header).replace("-\n", "").split()) for column in self.columns]
            rows = zip(self.rows, zip(*(column._cells for column in self.columns)))
            for row, (first, *cells) in rows:
                said = [f"{name} {cell}".strip() for name, cell in zip(names[1:], map(str, cells)) if cell]
                yield Text(f"{names[0]} {first}".strip(), style=row.style or "bold", no_wrap=False, overflow="fold")
                yield Padding(Text(" \u00b7 ".join(said), no_wrap=False, overflow="fold"), (0, 0, 0, 2))

    return TableOrList


def shelves(tables, out) -> list:
    """Return the tables side by side, as many in a row as there is room for."""
    from rich.measure import Measurement
    from rich.table import Table

    rows: list[list] = [[]]
    room = out.width
    for table in tables:
        width = Measurement.get(out, out.options, table).maximum
        if rows[-1] and width > room:
            rows.append([])
            room = out.width
        rows[-1].append(table)
        room -= width + GAP
    shelves = []
    for row in rows:
        grid = Table.grid(padding=(0, GAP, 0, 0))
        for _ in row:
            grid.add_column(no_wrap=True)
        grid.add_row(*row)
        shelves.append(grid)
    return shelves


def _parameters(summary):
    shown = table(("parameter", "left"), ("estimate", "right"))
    for name, value, std in summary.parameters:
        shown.add_row(name, plus_minus(value, std))
    return shown


def _roots(what: str, roots, edge: float = inf):
    shown = table((what, "right"), ("size", "right"), ("+-", "right"))
    for root, std in roots:
        root = complex(root)
        if root.imag < 0:
            continue
        text = number(root.real, 4) if root.imag == 0 else f"{number(root.real, 4)} \u00b1 {number(root.imag, 4)}j"
        size = f"{abs(root):.4f}" if abs(root) < 1e4 else number(abs(root), 2)
        shown.add_row(text, size, bound(std), style="red" if abs(root) >= edge else None)
    return shown


# --- a run ---------------------------------------------------------------------------------------------------


def show_run(run, *, title: str, facts: list[str], notes: list[str], out=None) -> None:
    """Print the results of a run."""
    from rich.text import Text

    out, summary = out or console(), run.summary
    head(out, title, facts)
    tables = [_parameters(summary)]
    if not summary.is_static:
        zeros = [pair for i in range(summary.model.form.inputs) for pair in own_zeros(summary.model, i)]
        tables += [_roots("pole", summary.moduli, 1.0)]
        tables += [_roots("zero", zeros)] if zeros and summary.is_enough else []
    for k, shelf in enumerate(shelves([*tables, _quality(summary)], out)):
        if k:
            out.print()
        out.print(shelf)
    if run.evidence is not None:
        out.print()
        out.print(_orders(run.evidence))
        out.print(Text(f"{run.evidence.words}."))
    foot(out, label="not identified", beware=[f"{d} (ratio {number(ratio, 2)})" for d, ratio in summary.unlearned])
    foot(out, label="record", beware=[run.study.words] if run.study.is_poor else [])
    foot(out, label="noise", beware=filter(None, [run.study.trust]))
    out.print()
    out.print(Text(f"{run.words} {summary.words}"))
    if run.keeper.jumps:
        foot(out, label="jumps noticed at", beware=[_times(run.keeper.jumps, summary.unit)])
    if run.smoothed is not None and not run.estimator.model.n:
        out.print(Text(run.smoothed.words))
    foot(out, beware=notes)
    out.print()


def _orders(evidence):
    shown = table(*((name, "right") for name in ("order", "log evidence", "probability", "fit %", "NIS")))
    for order, log_evidence, p, fit, _, nis in zip(*evidence.columns().values()):
        style = "bold" if order == evidence.best else None
        shown.add_row(str(order), fixed(log_evidence, 1), probable(p), fixed(fit, 1), fixed(nis, 2), style=style)
    return shown


def _times(jumps, unit: str) -> str:
    form = "sample {}" if unit == SAMPLES else "{} s"
    moved = [event.moved if event.moved != SOMETHING else "" for event in jumps[:JUMPS]]
    shown = ", ".join(form.format(number(event.time)) + f" ({text})" * bool(text) for event, text in zip(jumps, moved))
    return shown + (f" and {len(jumps) - JUMPS} more" if len(jumps) > JUMPS else "")


def _quality(summary):
    shown = table(("quality", "left"), ("", "right"), ("", "left"))
    _, _, p_value, is_white = summary.whiteness
    white = (
        ("white" if is_white else "not white", chance(p_value, 2)) if p_value == p_value else ("too few", "to judge")
    )
    nis = summary.nis_interval
    shown.add_row("one-step fit", f"{fixed(summary.fit, 1)} %", "")
    shown.add_row("noise std", number(summary.noise_std, 3), "")
    shown.add_row("NIS", fixed(summary.nis, 3), near_one(nis.low, nis.high, "\u2026") if nis.samples else "ideal 1")
    shown.add_row("95 % bands hold", f"{fixed(100 * summary.coverage, 1)} %", "ideal 95")
    shown.add_row("innovations", *white)
    for name, count in (
        ("missing outputs", summary.missing_outputs),
        ("missing inputs", summary.missing_inputs),
        ("outliers", summary.rejected + summary.happened["outliers"][0]),
        ("bad cells", summary.bad_values),
    ):
        if count:
            shown.add_row(name, str(count), f"of {summary.samples}")
    return shown


# --- an identification ---------------------------------------------------------------------------------------


def show_identification(found, *, title: str, taken: float, notes: list[str], stderr: bool = False) -> None:
    """Print the answer of an identification in words, the numbers behind it, the candidates."""
    from rich.text import Text

    from driftwise.analysis.claims import TABLE
    from driftwise.results.claims import told

    out, t, s = console(stderr=stderr), found.table, found.summary
    head(out, title, [f"{s.samples} samples", t.step, f"{len(found.rivals)} models compared", f"took {taken:.2f} s"])
    warned = [claim for claim in found.claims if claim.kind == "note"]
    said = [claim for claim in found.claims if claim.kind not in ("note", *TABLE)]
    for text in filter(None, (told(said), told(warned), found.table_words)):
        out.print(Text(text))
        out.print()
    tables = [_parameters(s), _roots("pole", s.moduli, 1.0), _forecast(found)] if s.is_enough else []
    for shelf in shelves([*tables, _candidates(found)] if found.is_judged else tables, out):
        out.print(shelf)
        out.print()
    if len(t.inputs) > 1:
        by = ", ".join(f"b.{k} of {name}" for k, name in enumerate(t.inputs, 1))
        out.print(Text(f"Parameters by input: {by}.", style="dim"))
    foot(out, beware=notes)


def _forecast(found):
    f, name = found.quoted, f"forecast of {found.chosen.name}" if found.is_alone else "forecast"
    shown = table((name, "left"), ("", "right"))
    shown.add_row("one-step fit", f"{fixed(f.fit, 1)} %")
    shown.add_row("error (rms)", number(f.rmse, 3))
    for name, error in found.naive.items() if found.is_judged else ():
        shown.add_row(f"that of the {SO_FAR.get(name, name)}", number(error, 3))
    shown.add_row("NIS", fixed(f.nis, 2))
    shown.add_row("95 % bands hold", f"{fixed(100 * f.coverage, 1)} %")
    return shown


def _candidates(found):
    shown = table(("model", "left"), ("unknowns", "right"), ("log odds", "right"), ("error (rms)", "right"))
    for rival in found.rivals[:CANDIDATES]:
        cells = rival.name, str(rival.unknowns), fixed(rival.evidence, 1), number(rival.rmse, 3)
        shown.add_row(*cells, style="bold" if rival.name == found.chosen.name else None)
    return shown


# --- a validation --------------------------------------------------------------------------------------------


def show_validation(found, *, title: str, facts: list[str], notes: list[str], out) -> None:
    """Print the tests of a validation, its fits on fresh data, its poles in time."""
    from rich.text import Text

    from driftwise.analysis.validation import FIT_HEAD, fit_rows, mode_head, mode_rows

    head(out, title, facts)
    shown = table(("test", "left"), ("value", "right"), ("fine", "left"), ("", "left"))
    shown.columns[3].no_wrap = False
    for v in found.verdicts:
        shown.add_row(*map(Text, (v.name, v.shown, v.limits, v.advice)), style=None if v.is_fine else "bold")
    out.print(shown)
    out.print()
    tables = []
    for names, rows in ((FIT_HEAD, fit_rows(found)), (mode_head(found), mode_rows(found))):
        one = table(*((name, "right" if k else "left") for k, name in enumerate(names)))
        for cells in rows:
            one.add_row(*map(Text, cells))
        tables += [one] if rows else []
    for shelf in shelves(tables, out):
        out.print(shelf)
        out.print()
    foot(out, beware=notes)
    out.print()


# --- a fleet -------------------------------------------------------------------------------------------------


def show_fleet(report, out) -> None:
    """Print how much there was, who needs a look and why, where the files are."""
    from rich.text import Text

    from driftwise.report import fleet_report

    head(out, report.title, report.facts, report.cost)
    if len(report.outliers.rows):
        out.print(_worst(report))
        out.print()
    out.print(Text(fleet_report.lead(report)))
    for what, count, share, series in fleet_report.quality(report):
        of = f"{what}: {fleet_report.shown(count)} ({percent(share)}) in {fleet_report.shown(series)} series"
        out.print(Text(of, style="dim"))
    foot(out, beware=report.notes)
    for line in report.files:
        say(line, stderr=out.stderr)
    out.print()


def _worst(report):
    """Return the table of the worst of each kind, in words."""
    from driftwise.fleet.outliers import KINDS
    from driftwise.report.fleet_report import shown as count

    shown = table(("what", "left"), ("series", "right"), ("worst", "left"), ("why", "left"))
    shown.columns[3].no_wrap = False
    for kind, (rows, _) in report.outliers.found.items():
        for k, row in enumerate(rows[:MOST_SERIES].tolist()):
            first = (KINDS[kind], count(len(rows))) if k == 0 else ("", "")
            shown.add_row(*first, str(report.outliers.keys[row]), report.outliers.words(kind, row))
    return shown


# --- tracks --------------------------------------------------------------------------------------------------


def show_tracks(tracks, rows, *, title: str, took: str, out) -> None:
    """Print the tracks, the busiest first, the whole in a sentence, and what was skipped."""
    from rich.text import Text

    from driftwise.report import track_report

    plots = f"{sum(r.plots for r in rows)} plots on {len(rows)} track{'' if len(rows) == 1 else 's'}"
    head(out, title, [plots, took])
    if rows:
        out.print(track_table(rows))
        if rest := rows[MOST_TRACKS:]:
            out.print(Text(f"and {len(rest)} more tracks of {rest[-1].plots} to {rest[0].plots} plots", style="dim"))
        out.print()
    out.print(Text(track_report.lead(rows, tracks.counts)))
    foot(out, label="skipped", beware=filter(None, [track_report.fault_words(tracks.faults)]))
    said = track_report.counted(tracks.counts), track_report.hint(rows, tracks.counts)
    foot(out, beware=[f"{text}." for text in said if text])
    out.print()


def track_table(rows) -> Any:
    """Return the table of the busiest tracks."""
    from driftwise.report import track_report

    days = {track_report.when(t).partition(" ")[0] for r in rows for t in (r.start, r.end)}
    dated = bool(rows) and track_report.clock(rows[0].start) is not None and len(days) > 1
    narrow = {"manoeuvres": "man-\noeuvres", "in 95 %": "in\n95 %"}
    text = ("track", "name", "from", "to", "status")
    shown = table(*((narrow.get(name, name), "left" if name in text else "right") for name in track_report.HEAD))
    for r in rows[:MOST_TRACKS]:
        label, name, start, end, *numbers = track_report.cells(r, with_day=dated)
        shown.add_row(label, name, *(time[2:-3] if dated else time for time in (start, end)), *numbers)
    return shown
