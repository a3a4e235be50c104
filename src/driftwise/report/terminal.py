"""What `driftwise run` prints: what the plant is, how far to trust it, what went wrong."""

from __future__ import annotations

from math import inf, isfinite

from driftwise.report.wording import fixed, near_one, number, plus_minus, probable, zeros_told
from driftwise.results.clock_words import SAMPLES
from driftwise.results.events import SOMETHING
from driftwise.results.whiteness import chance

__all__ = ["console", "parameters", "roots", "shelves", "show", "table"]

JUMPS = 8  # times of jumps printed
GAP = 3  # columns between tables


def console(stderr: bool = False):
    """Return a rich console; plain text where the output is no terminal."""
    from rich.console import Console

    found = Console(stderr=stderr, highlight=False)
    if not found.is_terminal:
        found = Console(stderr=stderr, highlight=False, width=110)
    return found


def show(run, *, title: str, facts: list[str], notes: list[str], out=None) -> None:
    """Print the results of a run."""
    from rich.text import Text

    out, summary = out or console(), run.summary
    out.print()
    out.print(Text(title, style="bold"))
    out.print(Text(" \u00b7 ".join(facts), style="dim"))
    out.print()
    tables = [parameters(summary)]
    if not summary.is_static:
        zeros = [pair for i in range(summary.model.form.inputs) for pair in zeros_told(summary.model, i)]
        tables += [roots("pole", summary.moduli, 1.0)]
        tables += [roots("zero", zeros)] if zeros and summary.is_enough else []
    for k, shelf in enumerate(shelves([*tables, _quality(summary)], out)):
        if k:
            out.print()
        out.print(shelf)
    if run.evidence is not None:
        out.print()
        out.print(_orders(run.evidence))
        out.print(Text(f"{run.evidence.words}."))
    for label, text in _unlearned(run):
        out.print(Text(f"{label}: ", style="yellow") + Text(text))
    out.print()
    out.print(Text(summary.words))
    if run.keeper.jumps:
        out.print(Text("jumps noticed at: ", style="yellow") + Text(_times(run.keeper.jumps, summary.unit)))
    if run.smoothed is not None and not run.estimator.model.n:
        out.print(Text(run.smoothed.words))
    for note in notes:
        out.print(Text("note: ", style="yellow") + Text(note))
    out.print()


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


def table(*columns: tuple[str, str]):
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    for name, justify in columns:
        table.add_column(name, justify=justify, no_wrap=True, header_style="dim")  # type: ignore[arg-type]
    return table


def parameters(summary):
    shown = table(("parameter", "left"), ("estimate", "right"))
    for name, value, std in summary.parameters:
        shown.add_row(name, plus_minus(value, std))
    return shown


def roots(what: str, roots, edge: float = inf):
    shown = table((what, "right"), ("size", "right"), ("+-", "right"))
    for root, std in roots:
        root = complex(root)
        if root.imag < 0:
            continue
        text = number(root.real, 4) if root.imag == 0 else f"{number(root.real, 4)} \u00b1 {number(root.imag, 4)}j"
        size = f"{abs(root):.4f}" if abs(root) < 1e4 else number(abs(root), 2)
        spread = number(std, 2) if isfinite(std) else "no bound"
        shown.add_row(text, size, spread, style="red" if abs(root) >= edge else None)
    return shown


def _orders(evidence):
    shown = table(*((name, "right") for name in ("order", "log evidence", "probability", "fit %", "NIS")))
    for order, log_evidence, p, fit, _, nis in zip(*evidence.columns().values()):
        style = "bold" if order == evidence.best else None
        shown.add_row(str(order), fixed(log_evidence, 1), probable(p), fixed(fit, 1), fixed(nis, 2), style=style)
    return shown


def _times(jumps, unit: str) -> str:
    form = "sample {}" if unit == SAMPLES else "{} s"
    told = [event.moved if event.moved != SOMETHING else "" for event in jumps[:JUMPS]]
    shown = ", ".join(form.format(number(event.time)) + f" ({text})" * bool(text) for event, text in zip(jumps, told))
    return shown + (f" and {len(jumps) - JUMPS} more" if len(jumps) > JUMPS else "")


def _quality(summary):
    white = tuple(summary.whiteness)
    shown = table(("quality", "left"), ("", "right"), ("", "left"))
    shown.add_row("one-step fit", f"{fixed(summary.fit, 1)} %", "")
    shown.add_row("noise std", number(summary.noise_std, 3), "")
    shown.add_row("NIS", fixed(summary.nis, 3), _interval(summary.nis_interval))
    shown.add_row("95 % bands hold", f"{fixed(100 * summary.coverage, 1)} %", "ideal 95")
    shown.add_row("innovations", *_whiteness(white))
    for name, count in (
        ("missing outputs", summary.missing_outputs),
        ("missing inputs", summary.missing_inputs),
        ("outliers", summary.rejected + summary.happened["outliers"][0]),
        ("bad cells", summary.bad_values),
    ):
        if count:
            shown.add_row(name, str(count), f"of {summary.samples}")
    return shown


def _interval(nis) -> str:
    return near_one(nis.low, nis.high, "\u2026") if nis.samples else "ideal 1"


def _unlearned(run) -> list[tuple[str, str]]:
    """Return what the record leaves open: a label and what it is, one line each."""
    found = [("not identified", f"{text} (ratio {number(ratio, 2)})") for text, ratio in run.summary.unlearned]
    if run.study.is_poor:
        found.append(("record", run.study.words))
    if run.study.trust:
        found.append(("noise", run.study.trust))
    return found


def _whiteness(white) -> tuple[str, str]:
    _, _, p_value, is_white = white
    if p_value != p_value:
        return "too few", "to judge"
    return "white" if is_white else "not white", chance(p_value, 2)
