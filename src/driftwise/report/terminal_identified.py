"""What `driftwise run FILE` prints: the answer in words, the numbers behind it, the candidates."""

from __future__ import annotations

from driftwise.analysis.identification_words import brief
from driftwise.report.terminal import console, parameters, roots, shelves, table
from driftwise.report.wording import fixed, number

__all__ = ["show"]

SO_FAR = {"mean": "mean so far"}  # a forecast knows no other
CANDIDATES = 6  # that are listed


def show(found, *, title: str, taken: float, notes: list[str], stderr: bool = False) -> None:
    """Print the answer of an identification."""
    from rich.text import Text

    out, t, s = console(stderr=stderr), found.table, found.summary
    out.print()
    out.print(Text(title, style="bold"))
    facts = [f"{s.samples} samples", t.step, f"{len(found.rivals)} models compared", f"took {taken:.2f} s"]
    out.print(Text(" \u00b7 ".join(facts), style="dim"))
    out.print()
    out.print(Text(brief(found)))
    out.print()
    out.print(Text(t.words))
    out.print()
    for verdict in found.diagnosis.not_fine if s.is_enough else ():
        out.print(Text("beware: ", style="yellow") + Text(f"{verdict.advice}."))
    if not found.diagnosis.is_fine and s.is_enough:
        out.print()
    tables = [parameters(s), roots("pole", s.moduli, 1.0), _quality(found)] if s.is_enough else []
    for shelf in shelves([*tables, _candidates(found)] if found.is_judged else tables, out):
        out.print(shelf)
        out.print()
    if len(t.inputs) > 1:
        told = ", ".join(f"b.{k} of {name}" for k, name in enumerate(t.inputs, 1))
        out.print(Text(f"Parameters by input: {told}.", style="dim"))
    for note in notes:
        out.print(Text("note: ", style="yellow") + Text(note))


def _quality(found):
    f, shown = (
        found.quoted,
        table((f"forecast of {found.chosen.name}" * found.is_alone or "forecast", "left"), ("", "right")),
    )
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
        style = "bold" if rival.name == found.chosen.name else None
        shown.add_row(
            rival.name, str(rival.unknowns), fixed(rival.evidence, 1), number(rival.rmse, 3), style=style
        )  # fmt: skip
    return shown
