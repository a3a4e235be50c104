"""The words and the looks of the report: plain HTML and CSS, nothing fetched from anywhere."""

from __future__ import annotations

from html import escape

__all__ = ["card", "page", "say", "section", "table"]

STYLE = """
:root { --ink:#1f2933; --quiet:#66758a; --line:#e4e8ee; --paper:#f5f7fa; --card:#fff; --blue:#2563eb;
        --good:#047857; --warn:#b45309; --bad:#b91c1c; }
* { box-sizing:border-box; }
body { margin:0; background:var(--paper); color:var(--ink); line-height:1.5; font-size:15px;
       -webkit-font-smoothing:antialiased;
       font-family:"Inter","Segoe UI",system-ui,-apple-system,"Helvetica Neue",Arial,sans-serif; }
main { max-width:1180px; margin:0 auto; padding:36px 24px 56px; }
header .brand { color:var(--blue); font-weight:650; letter-spacing:.02em; font-size:13px;
                text-transform:uppercase; }
h1 { font-size:30px; line-height:1.2; margin:4px 0 2px; letter-spacing:-.015em; overflow-wrap:anywhere; }
header .facts { color:var(--quiet); margin:0; }
.lead { font-size:18px; line-height:1.55; margin:22px 0 24px; padding:18px 22px; background:var(--card);
        border-radius:12px; border:1px solid var(--line); border-left:5px solid var(--blue); }
.cards { display:grid; grid-template-columns:repeat(auto-fit,minmax(165px,1fr)); gap:14px;
         margin-bottom:22px; }
.card { background:var(--card); border:1px solid var(--line); border-radius:12px; padding:14px 16px 13px;
        min-width:0; overflow:hidden; }
.card .name { color:var(--quiet); font-size:12.5px; }
.card .value { font-size:27px; font-weight:650; letter-spacing:-.02em; line-height:1.25;
               font-variant-numeric:tabular-nums; white-space:nowrap; }
.card .value small { font-size:15px; font-weight:500; color:var(--quiet); letter-spacing:0; }
.card .note { font-size:12.5px; color:var(--quiet); }
.card.good .value { color:var(--good); }
.card.warn .value { color:var(--warn); }
.card.bad .value { color:var(--bad); }
section { background:var(--card); border:1px solid var(--line); border-radius:12px;
          padding:18px 20px 16px; margin-bottom:20px; }
h2 { font-size:17px; margin:0; letter-spacing:-.01em; }
section > p.say { color:var(--quiet); margin:2px 0 10px; font-size:14px; max-width:130ch; }
.pair { display:grid; grid-template-columns:repeat(auto-fit,minmax(420px,1fr)); gap:20px;
        margin-bottom:20px; }
.pair > section { min-width:0; margin-bottom:0; }
.pair.flat { margin:6px 0 0; align-items:center; }
.many { display:grid; grid-template-columns:repeat(var(--columns,3),minmax(0,1fr)); gap:8px 18px;
        margin-top:12px; }
.center { display:flex; flex-wrap:wrap; justify-content:center; align-items:center; gap:4px 14px; }
.scroll + .scroll, .say + .scroll { margin-top:14px; }
.many > div, .plot { min-width:0; overflow:hidden; }
table { border-collapse:collapse; width:100%; font-size:14px; font-variant-numeric:tabular-nums; }
th { text-align:right; color:var(--quiet); font-weight:550; font-size:12.5px; padding:5px 10px;
     border-bottom:1px solid var(--line); }
td { text-align:right; padding:5px 10px; border-bottom:1px solid #f0f2f5; }
td:not(.text):not(:first-child) { white-space:nowrap; }
th:first-child, td:first-child { text-align:left; font-weight:600; }
td.text, th.text { text-align:left; font-weight:400; }
tr:last-child td { border-bottom:none; }
.scroll { max-height:330px; overflow:auto; }
.tag { display:inline-block; font-size:12px; border-radius:99px; padding:1px 9px; font-weight:600; }
.tag.good { color:var(--good); background:#e7f6ef; }
.tag.warn { color:var(--warn); background:#fdf2e0; }
footer { color:var(--quiet); font-size:13px; padding:4px 2px; }
@media (max-width:900px) { .many { grid-template-columns:repeat(2,minmax(0,1fr)); } }
@media (max-width:640px) { main { padding:20px 12px; } h1 { font-size:24px; } section { padding:14px 10px; }
  .pair, .many { grid-template-columns:minmax(0,1fr); } td, th { padding:4px 5px; } }
@media print { body { background:#fff; } section, .card, .lead { break-inside:avoid; } }
"""

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
<header><div class="brand">driftwise</div><h1>{title}</h1><p class="facts">{facts}</p></header>
<p class="lead">{lead}</p>
<div class="cards">{cards}</div>
{sections}
<footer>{footer}</footer>
</main>
{script}
</body>
</html>
"""


def page(*, title, facts, lead, cards, sections, footer, library, script) -> str:
    """Return the whole page. `library`, `script`, `cards` and `sections` are trusted markup."""
    return _PAGE.format(
        title=escape(title),
        facts=escape(facts),
        lead=escape(lead),
        cards="".join(cards),
        sections="\n".join(sections),
        footer=escape(footer),
        style=STYLE,
        library=library,
        script=script,
    )


def card(name: str, value: str, note: str = "", verdict: str = "", unit: str = "") -> str:
    """Return one key number; `verdict` is "good", "warn", "bad" or nothing."""
    small = f" <small>{escape(unit)}</small>" if unit else ""
    return (
        f'<div class="card {verdict}"><div class="name">{escape(name)}</div>'
        f'<div class="value">{escape(value)}{small}</div><div class="note">{escape(note)}</div></div>'
    )


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
