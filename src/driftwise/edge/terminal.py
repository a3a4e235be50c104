"""What `driftwise run` prints: what the plant is, how far to trust it, what went wrong."""

from __future__ import annotations

from driftwise.edge.wording import fixed, number, plus_minus

__all__ = ["console", "show"]


def console(stderr: bool = False):
    """Return a rich console; plain text where the output is no terminal."""
    from rich.console import Console

    found = Console(stderr=stderr, highlight=False)
    if not found.is_terminal:
        found = Console(stderr=stderr, highlight=False, width=110)
    return found


def show(summary, *, title: str, facts: list[str], notes: list[str], out=None) -> None:
    """Print the results of a run."""
    from rich.columns import Columns
    from rich.padding import Padding
    from rich.text import Text

    out = out or console()
    out.print()
    out.print(Text(title, style="bold"))
    out.print(Text(" \u00b7 ".join(facts), style="dim"))
    out.print()
    out.print(Columns([_parameters(summary), _poles(summary), _quality(summary)], padding=(0, 4)))
    for text in _unlearned(summary):
        out.print(Text("not identified: ", style="yellow") + Text(text))
    out.print()
    out.print(Padding(Text(summary.words), (0, 0, 0, 0)))
    for note in notes:
        out.print(Text("note: ", style="yellow") + Text(note))
    out.print()


def _table(*columns: tuple[str, str]):
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    for name, justify in columns:
        table.add_column(name, justify=justify, no_wrap=True, header_style="dim")  # type: ignore[arg-type]
    return table


def _parameters(summary):
    table = _table(("parameter", "left"), ("estimate", "right"))
    for name, value, std in summary.parameters:
        table.add_row(name, plus_minus(value, std))
    return table


def _poles(summary):
    table = _table(("pole", "right"), ("size", "right"), ("+-", "right"))
    for pole, std in summary.poles:
        pole = complex(pole)
        if pole.imag < 0:
            continue
        shown = number(pole.real, 4) if pole.imag == 0 else f"{number(pole.real, 4)} \u00b1 {number(pole.imag, 4)}j"
        table.add_row(shown, f"{abs(pole):.4f}", number(std, 2), style="red" if abs(pole) >= 1 else None)
    return table


def _quality(summary):
    white = tuple(summary.whiteness)
    table = _table(("quality", "left"), ("", "right"), ("", "left"))
    table.add_row("one-step fit", f"{fixed(summary.fit, 1)} %", "")
    table.add_row("noise std", number(summary.noise_std, 3), "")
    table.add_row("NIS", fixed(summary.nis, 3), "ideal 1")
    table.add_row("95 % bands hold", f"{100 * summary.coverage:.1f} %", "ideal 95")
    table.add_row("innovations", *_whiteness(white))
    for name, count in (
        ("missing outputs", summary.missing_outputs),
        ("missing inputs", summary.missing_inputs),
        ("rejected", summary.rejected),
        ("bad cells", summary.bad_values),
    ):
        if count:
            table.add_row(name, str(count), f"of {summary.samples}")
    return table


def _unlearned(summary) -> list[str]:
    return [f"{text} (ratio {number(ratio, 2)})" for text, ratio in summary.unlearned]


def _whiteness(white) -> tuple[str, str]:
    _, _, p_value, is_white = white
    if p_value != p_value:
        return "too few", "to judge"
    return "white" if is_white else "not white", f"p = {p_value:.2g}"
