"""What was measured, as the terminal and the documentation show it."""

from __future__ import annotations

from typing import Any

from .groups import GROUPS
from .verdicts import Table, Verdict, number

Found = list[tuple[str, Verdict | Table]]  # the part, and what it yielded

HEAD = """# Benchmarks

Written by `make bench`: CPU time of one run, opponents alternating with driftwise, medians of several rounds. What was
missed is printed as plainly as what was met, and where others are faster is a section of its own. Wall time only
where it says so (start-up, threads), which wants an idle machine. `python -m bench --only fleets` repeats one part,
`--big` takes a thousand samples of each series and 1e8 rows of Parquet.

Measured on {machine}.

This run: {met} budgets met, {missed} missed; {plain} numbers that nothing was promised about.
"""


def page(found: Found, machine: dict[str, str]) -> str:
    """Return the Markdown page."""
    verdicts = [one for _, one in found if isinstance(one, Verdict)]
    missed = [one for one in verdicts if not one.kept]
    plain = sum(one.expected.startswith("no budget") for one in verdicts)
    told = ", ".join(f"{name} {what}" for name, what in machine.items())
    met = len(verdicts) - len(missed) - plain
    parts = [HEAD.format(machine=told, met=met, missed=len(missed), plain=plain)]
    if missed:
        parts += ["## What was missed\n", _verdicts(missed)]
    parts += [_faster(verdicts)]
    for group in GROUPS:
        here = [one for part, one in found if part in group.parts]
        if here:
            parts += [f"## {group.title}\n", group.text + "\n" if group.text else "", _mixed(here)]
    return "\n".join(part for part in parts if part).rstrip() + "\n"


def _faster(verdicts: list[Verdict]) -> str:
    """Return the section on those who are faster, the farthest ahead first."""
    rows = [
        (one.rival, one.name, f"{number(one.ahead)} x", one.why)
        for one in sorted(verdicts, key=lambda one: -one.ahead)
        if one.ahead > 1
    ]
    if not rows:
        return "## Where others are still faster\n\nNowhere in this run.\n"
    return "## Where others are still faster\n\n" + markdown(("who", "where", "how much", "why"), rows)


def _mixed(found: list[Verdict | Table]) -> str:
    """Return verdicts that follow each other as one table, tables with their titles."""
    parts: list[str] = []
    together: list[Verdict] = []
    for one in [*found, None]:
        if isinstance(one, Verdict):
            together.append(one)
            continue
        if together:
            parts.append(_verdicts(together))
            together = []
        if one is not None:
            parts += [f"### {one.title}\n", one.text + "\n" if one.text else "", markdown(one.columns, one.rows)]
    return "\n".join(part for part in parts if part)


def _verdicts(verdicts: list[Verdict]) -> str:
    rows = [
        (one.name, number(one.value), one.expected, "met" if one.kept else "**missed**", one.note)
        if not one.expected.startswith("no budget")
        else (one.name, f"{number(one.value)} {one.expected[len('no budget (') : -1]}".strip(), "", "", one.note)
        for one in verdicts
    ]
    return markdown(("what", "measured", "budget", "", "note"), rows)


def markdown(columns, rows) -> str:
    """Return a Markdown table; columns of numbers stand to the right."""
    right = [all(not isinstance(row[c], str) for row in rows) for c in range(len(columns))]
    lines = [columns, ["---:" if at else "---" for at in right], *rows]
    return "\n".join("| " + " | ".join(map(number, line)) + " |" for line in lines) + "\n"


def terminal(one: Verdict | Table) -> Any:
    """Return what rich prints of one finding."""
    from rich.table import Table as Rich

    if isinstance(one, Table):
        out = Rich(*one.columns, title=one.title, title_justify="left")
        for row in one.rows:
            out.add_row(*map(number, row))
        return out
    is_promised = not one.expected.startswith("no budget")
    told = ("met   " if one.kept else "MISSED") if is_promised else "      "
    return f"{told} {one.name}: {number(one.value)} ({one.expected}) {one.note}"
