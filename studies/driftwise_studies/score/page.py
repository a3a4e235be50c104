"""The page of the documentation: what stands between its two markers is written here, the rest by hand."""

from __future__ import annotations

from pathlib import Path

from driftwise.engine.errors import InputError

from ..papers.verdict import Table, Verdict

BEGIN, END = "<!-- score: begin -->", "<!-- score: end -->"


def write(path: Path, verdicts: list[Verdict], tables: list[Table], *frozen: str) -> None:
    """Put the results between the markers of a page; ``frozen``: commits that changed what answers, and its numbers."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror or error}); the results go into a page") from None
    if text.count(BEGIN) != 1 or text.count(END) != 1 or text.index(BEGIN) > text.index(END):
        raise InputError(f"{path} must have the line {BEGIN} and after it the line {END}, once each, for the results")
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    path.write_text(f"{before}{BEGIN}\n{measured_at(*frozen)}{results(verdicts, tables)}{END}{after}", encoding="utf-8")


def measured_at(answers: str = "", numbers: str = "") -> str:
    """Return the sentence that names the commits the results stand for, or nothing where they are not known."""
    if not answers:
        return ""
    held = f"the numbers that were chosen, [all in one file](constants.txt), by `{numbers[:8]}`"
    return f"\nWhat answers was last changed by commit `{answers[:8]}`; {held}.\n"


def results(verdicts: list[Verdict], tables: list[Table]) -> str:
    """Return the results as Markdown."""
    parts = []
    for table in tables:
        parts.append(f"\n**{table.caption}**\n\n{markdown(table.head, table.rows)}")
    mark = {True: "met", False: "**missed**", None: "skipped"}
    rows = [[v.source.rsplit("row ")[-1], v.name, v.value, v.expected, mark[v.confirmed]] for v in verdicts]
    parts.append(f"\n## Targets\n\n{headline(verdicts)}\n\n{markdown(['row', 'what', 'found', 'target', ''], rows)}")
    return "".join(parts)


def headline(verdicts: list[Verdict]) -> str:
    """Return how many targets are met."""
    missed, skipped = sum(v.fails for v in verdicts), sum(v.confirmed is None for v in verdicts)
    met = len(verdicts) - missed - skipped
    return f"{met} of {len(verdicts)} targets met, {missed} missed" + (f", {skipped} skipped" if skipped else "") + "."


def markdown(head: list[str], rows: list[list[str]]) -> str:
    """Return a table in Markdown.

    Examples
    --------
    >>> print(markdown(["a", "b"], [["1", "x|y"]]), end="")
    | a | b |
    |---|---|
    | 1 | x\\|y |
    """
    lines = [head, ["---"] * len(head), *rows]
    text = ("|" + "|".join(cells) + "|" if cells[0] == "---" else _line(cells) for cells in lines)
    return "\n".join(text) + "\n"


def _line(cells) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
