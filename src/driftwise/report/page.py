"""One self-contained HTML page: an answer in words, numbers on cards, panels, and details that unfold.

A page is a list of panels over one result::

    line = Timeline(time, "time (s)")                                           # one time axis for all of them (axes)
    seen = output(line, y, prediction, half, "level (m)", marks=marks(events))                       # (plots, marks)
    panels = [Panel("prediction", "Forecast", "", (seen, zoom_words(line))), verdict_panel(trace, summary)]  # (panels)
    Page("A tank", panels, lead="It is slow. And more.", cards=[group("The plant", [card("Gain", "1.8")])]).write(path)

Text is escaped; what is called markup is trusted.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

from ..engine.atomic import write_text

MORE = """<div class="more"><h2>Details</h2><button type="button"
onclick="for (const fold of document.querySelectorAll('details')) fold.open = true">Unfold all</button></div>
"""


class Panel(NamedTuple):
    """A part of a page: a title, a quiet paragraph, and what stands below.

    Attributes
    ----------
    name : its anchor
    title, text : what is escaped
    body : markup, Bokeh figures that have a name, and tuples of figures that stand side by side in their own size
    hint : what one would find; where it is given, the panel is folded until one asks for it
    """

    name: str
    title: str
    text: str = ""
    body: tuple = ()
    hint: str | None = None

    @property
    def figures(self) -> Iterator[Any]:
        """Its figures in order."""
        for part in self.body:
            yield from part if isinstance(part, tuple) else () if isinstance(part, str) else (part,)

    def html(self, drawn: dict[str, str]) -> str:
        """Return its markup, given that of the figures by their names."""
        body = say(self.text) + "".join(_placed(part, drawn) for part in self.body)
        if self.hint is None:
            return f'<section id="{self.name}"><h2>{escape(self.title)}</h2>{body}</section>'
        top = f'<summary><h2>{escape(self.title)}</h2><span class="hint">{escape(self.hint)}</span></summary>'
        return f'<details id="{self.name}">{top}{body}</details>'


@dataclass
class Page:
    """A page: panels that are open first, then those that are folded; None among them is left out.

    Parameters
    ----------
    title : headline
    panels : list of `Panel`
    lead : the answer; its first sentence is set in large letters
    facts : what there was, in a few words each
    cards : `group`s of `card`s: the numbers that matter
    """

    title: str
    panels: Sequence[Panel | None]
    lead: str = ""
    facts: Sequence[str] = ()
    cards: Sequence[str] = ()

    def html(self) -> str:
        """Return the page, with all in it that a browser needs."""
        panels = [panel for panel in self.panels if panel is not None]
        script, drawn = _components([figure for panel in panels for figure in panel.figures])
        folds = [panel.html(drawn) for panel in panels if panel.hint is not None]
        first, _, rest = re.sub(r"(?<=[.!?]) (?=\S)", "\n", self.lead, count=1).partition("\n")
        parts = {
            "title": escape(self.title), "facts": escape(" \u00b7 ".join(self.facts)), "cards": "".join(self.cards),
            "lead": f"<strong>{escape(first)}</strong> {escape(rest)}",
            "sections": "\n".join(panel.html(drawn) for panel in panels if panel.hint is None),
            "folds": MORE + "\n".join(folds) if folds else "",
            "style": _beside("page.css"), "library": _library(), "script": script,
        }  # fmt: skip
        return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], _beside("page.html"))

    def write(self, path) -> Path:
        """Write the page and return its path."""
        path = Path(path)
        write_text(path, self.html())
        return path


def _beside(name: str) -> str:
    return Path(__file__).with_name(name).read_text(encoding="utf-8")


def _library() -> str:
    from bokeh.resources import Resources

    return Resources(mode="inline", components=["bokeh"], minified=True).render_js()


def _components(figures: list) -> tuple[str, dict[str, str]]:
    """Return the script that draws the figures, and the markup of each under its name."""
    if not figures:
        return "", {}
    from bokeh import embed
    from bokeh.document import Document

    document = Document()
    with document.models.freeze():  # else each figure asks for the models of all before it once more
        for figure in figures:
            document.add_root(figure)
    return embed.components({figure.name: figure for figure in figures})


def _placed(part, drawn: dict[str, str]) -> str:
    """Return markup as it is, and figures in their places."""
    if isinstance(part, str):
        return part
    if isinstance(part, tuple):
        return f'<div class="center">{"".join(drawn[figure.name] for figure in part)}</div>'
    return f'<div class="plot">{drawn[part.name]}</div>'


def named(kind: str, figures: list) -> list:
    """Return figures under numbered names."""
    for j, figure in enumerate(figures):
        figure.name = f"{kind}{j}"
    return figures


def stack(figures: list) -> list:
    """Return panels one above the other, so that the same instant is at the same place; in two columns from five on."""
    return figures if len(figures) <= 4 else columns(figures)


def columns(figures: list, most: int = 2) -> list:
    """Return figures in columns."""
    if not figures:
        return []
    return [f'<div class="many" style="--columns:{min(most, len(figures))}">', *figures, "</div>"]


class Card(NamedTuple):
    """One key number; ``verdict`` is "good", "warn", "bad" or nothing."""

    name: str
    value: str
    note: str = ""
    verdict: str = ""
    unit: str = ""


def group(title: str, cards: list[Card]) -> str:
    """Return cards side by side under a title: the question that they answer."""
    row = ""
    for name, value, note, verdict, unit in cards:
        small = f" <small>{escape(unit)}</small>" if unit else ""
        size = " long" if len(value) + len(unit) + 2 * bool(verdict) > 8 else ""
        row += (
            f'<div class="card {verdict}{size}"><div class="name">{escape(name)}</div>'
            f'<div class="value">{escape(value)}{small}</div><div class="note">{escape(note)}</div></div>'
        )
    return f'<div class="group" style="flex:{len(cards)}"><h2>{escape(title)}</h2><div class="row">{row}</div></div>'


def tag(text: str, verdict: str) -> str:
    """Return a word with a verdict ("good", "warn" or "bad") to stand in a table."""
    return f'<span class="tag {verdict}">{escape(text)}</span>'


def say(text: str) -> str:
    """Return a quiet paragraph, or nothing."""
    return f'<p class="say">{escape(text)}</p>' if text else ""


def table(head: list[str], rows: list[list], text: tuple[int, ...] = ()) -> str:
    """Return a table, or nothing without a row; columns in `text` are left-aligned, "<span" begins trusted markup."""
    if not rows:
        return ""

    def row(kind, cells):
        shown = (str(value) if str(value).startswith("<span") else escape(str(value)) for value in cells)
        marked = (f"<{kind}{' class=text' if j in text else ''}>{value}</{kind}>" for j, value in enumerate(shown))
        return f"<tr>{''.join(marked)}</tr>"

    body = "".join(row("td", cells) for cells in rows)
    return f'<div class="scroll"><table><thead>{row("th", head)}</thead><tbody>{body}</tbody></table></div>'
