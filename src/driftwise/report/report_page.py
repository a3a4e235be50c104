"""The building blocks of a page in plain HTML, nothing fetched from anywhere.

`page` puts them together: the answer in words, `group`s of `card`s with the numbers that matter, `section`s, and below
them `fold`s with the details. `verdict_list` is a table of verdicts. Text is escaped; what is called markup is trusted.
"""

from __future__ import annotations

import re
from html import escape

from driftwise.report.report_style import STYLE

__all__ = ["card", "fold", "group", "page", "say", "section", "table", "tag", "verdict_list"]

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>{style}</style>
{library}
</head>
<body>
<main>
<header><h1>{title}</h1><p class="facts">{facts}</p><div class="brand">driftwise</div></header>
<p class="lead">{lead}</p>
<div class="cards">{cards}</div>
{sections}
{folds}
<footer>{footer}</footer>
</main>
{script}
<script>
addEventListener("beforeprint", () => {{ // figures keep their size of the screen; on paper they shall fill the column
  const fit = 1180 / (document.querySelector("main").clientWidth - 48);
  for (const plot of document.querySelectorAll(".plot")) {{
    const look = {{"--fit": fit, "--height": `${{fit * plot.offsetHeight}}px`, "--contain": "size"}};
    for (const [name, value] of Object.entries(look)) plot.style.setProperty(name, value);
  }}
}});
</script>
</body>
</html>
"""


_MORE = """<div class="more"><h2>Details</h2><button type="button"
onclick="for (const fold of document.querySelectorAll('details')) fold.open = true">Unfold all</button></div>
"""


def page(*, title, facts, lead, cards, sections, footer, library, script, folds=()) -> str:
    """Return the whole page; `library`, `script`, `cards`, `sections` and `folds` are markup.

    The first sentence of the ``lead`` is its headline.
    """
    first, _, rest = re.sub(r"(?<=[.!?]) (?=\S)", "\n", lead, count=1).partition("\n")
    folds = [fold for fold in folds if fold]
    return _PAGE.format(
        title=escape(title),
        facts=escape(facts),
        lead=f"<strong>{escape(first)}</strong> {escape(rest)}",
        cards="".join(cards),
        sections="\n".join(sections),
        folds=_MORE + "\n".join(folds) if folds else "",
        footer=escape(footer),
        style=STYLE,
        library=library,
        script=script,
    )


def card(name: str, value: str, note: str = "", verdict: str = "", unit: str = "") -> str:
    """Return one key number; `verdict` is "good", "warn", "bad" or nothing."""
    small = f" <small>{escape(unit)}</small>" if unit else ""
    size = " long" if len(value) + len(unit) + 2 * bool(verdict) > 8 else ""
    return (
        f'<div class="card {verdict}{size}"><div class="name">{escape(name)}</div>'
        f'<div class="value">{escape(value)}{small}</div><div class="note">{escape(note)}</div></div>'
    )


def group(title: str, cards: list[str]) -> str:
    """Return cards side by side under a title: the question that they answer."""
    row = "".join(cards)
    return f'<div class="group" style="flex:{len(cards)}"><h2>{escape(title)}</h2><div class="row">{row}</div></div>'


def fold(name: str, title: str, hint: str, text: str, *body: str) -> str:
    """Return a section that opens when asked to; the `hint` beside its title says what one would find."""
    top = f'<summary><h2>{escape(title)}</h2><span class="hint">{escape(hint)}</span></summary>'
    return f'<details id="{name}">{top}{say(text)}{"".join(body)}</details>'


def tag(text: str, verdict: str) -> str:
    """Return a word with a verdict ("good", "warn" or "bad") to stand in a table."""
    return f'<span class="tag {verdict}">{escape(text)}</span>'


def verdict_list(verdicts) -> str:
    """Return a table of verdicts (name, value and threshold as they are shown, whether it is fine, advice)."""
    rows = [
        [name, tag("fine", "good") if is_fine else tag("look", "warn"), value, threshold, advice]
        for name, value, threshold, is_fine, advice in verdicts
    ]
    return table(["", "", "value", "fine where", "what it means"], rows, text=(1, 4))


def say(text: str) -> str:
    """Return a quiet paragraph, or nothing."""
    return f'<p class="say">{escape(text)}</p>' if text else ""


def section(name: str, title: str, text: str, *body: str) -> str:
    """Return one section; `body` is trusted markup."""
    return f'<section id="{name}"><h2>{escape(title)}</h2>{say(text)}{"".join(body)}</section>'


def table(head: list[str], rows: list[list], text: tuple[int, ...] = ()) -> str:
    """Return a table; columns in `text` are left-aligned, cells that start with "<" are trusted markup."""

    def cell(tag, j, value):
        value = str(value)
        shown = value if value.startswith("<span") else escape(value)
        return f"<{tag}{' class=text' if j in text else ''}>{shown}</{tag}>"

    top = "".join(cell("th", j, name) for j, name in enumerate(head))
    body = "".join("<tr>" + "".join(cell("td", j, value) for j, value in enumerate(row)) + "</tr>" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'
