"""One self-contained HTML page of a reproduction; the figures also lie beside it as PNG."""

from __future__ import annotations

import base64
import io
import re
from html import escape as plain
from pathlib import Path

from driftwise.engine.errors import InputError

from .verdict import Reproduction, Section, Table, Verdict

STYLE = """
:root { --ink:#1f2933; --quiet:#5b6b80; --line:#e4e8ee; --paper:#f5f7fa; --blue:#0072b2;
        --good:#047857; --bad:#b91c1c; --warn:#92600a; }
* { box-sizing:border-box; }
body { margin:0; background:var(--paper); color:var(--ink);
       font:15px/1.5 "Inter","Segoe UI",system-ui,Arial,sans-serif; }
main { max-width:1160px; margin:0 auto; padding:36px 24px 56px; }
.brand { color:var(--blue); font-weight:650; letter-spacing:.02em; font-size:13px; text-transform:uppercase; }
h1 { font-size:29px; line-height:1.2; margin:4px 0 6px; letter-spacing:-.015em; }
h2 { font-size:19px; margin:0 0 8px; }
h3 { font-size:14px; margin:20px 0 6px; }
section { background:#fff; border:1px solid var(--line); border-radius:12px; padding:20px 22px 18px; margin:0 0 22px; }
p { margin:0 0 10px; max-width:110ch; }
.lead { font-size:17px; max-width:100ch; }
.count { font-size:17px; font-weight:650; }
.against { color:var(--warn); }
.tag { display:block; color:var(--warn); font-weight:550; font-size:12.5px; }
.quiet, figcaption { color:var(--quiet); font-size:13.5px; }
figure { margin:20px 0 6px; }
figure img { width:100%; height:auto; display:block; }
.scroll { overflow-x:auto; }
table { border-collapse:collapse; width:100%; font-size:13.5px; font-variant-numeric:tabular-nums; }
th { text-align:left; color:var(--quiet); font-weight:550; font-size:12.5px; padding:5px 9px;
     border-bottom:1px solid var(--line); vertical-align:bottom; }
td { padding:5px 9px; border-bottom:1px solid #f0f2f5; vertical-align:top; }
td:first-child { font-weight:600; }
tr:last-child td { border-bottom:none; }
.verdicts { table-layout:fixed; min-width:860px; }
.verdicts th:nth-child(1) { width:118px; }
.verdicts th:nth-child(2) { width:24%; }
.verdicts th:nth-child(5) { width:18%; }
.verdicts td:nth-child(5) { font-size:12.5px; }
.verdicts td:first-child, .statements td:first-child { white-space:nowrap; }
.statements { min-width:860px; }
.statements th:nth-child(2) { width:28%; } .statements th:nth-child(3) { width:32%; }
sub, sup { font-size:.75em; line-height:0; }
.good { color:var(--good); } .bad { color:var(--bad); } .skip { color:var(--warn); }
.missing { border-left:4px solid var(--warn); padding:8px 14px; background:#fdf8ee; margin:16px 0 4px; }
.missing p { margin:0 0 6px; } .missing p:last-child { margin:0; }
nav { margin:14px 0 24px; font-size:14px; }
nav a { color:var(--blue); text-decoration:none; margin-right:18px; white-space:nowrap; }
@media print { body { background:#fff; } section { break-inside:avoid; } }
"""


def escape(words: str) -> str:
    """Return words as markup, with real minus signs, indices set low and powers set high."""
    words = re.sub(r"(?<![\w)])-(?=[\d.])", "\u2212", plain(words))
    words = re.sub(r"\^(\u2212?\w+)", r"<sup>\1</sup>", words)
    return re.sub(r"\b([axbdQPKRSE])_([0-9\u03c0nD]|rr|opt|FA|jump)\b", r"\1<sub>\2</sub>", words)


def write(found: Reproduction, folder: str) -> Path:
    """Draw every figure into ``folder`` as PNG and write the page there; return the page's path."""
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
        pictures = {}
        for section in found.sections:
            for picture in section.pictures:
                buffer = io.BytesIO()
                picture.draw().savefig(buffer, format="png")
                pictures[picture.name] = buffer.getvalue()
                (path / f"{picture.name}.png").write_bytes(buffer.getvalue())
        target = path / f"{found.name}.html"
        target.write_text(page(found, pictures), encoding="utf-8")
    except OSError as error:
        raise InputError(f"{folder} cannot be written ({error.strerror or error}).") from None
    return target


def page(found: Reproduction, pictures: dict[str, bytes]) -> str:
    """Return the whole page, figures inside it."""
    color = "good" if found.passes else "bad"
    against = f'; <a class="against" href="#against">{escape(found.against)}</a>' if found.against else ""
    links = " ".join(f'<a href="#part{i}">{escape(s.title.split(":")[0])}</a>' for i, s in enumerate(found.sections))
    missing = [text for section in found.sections for text in section.missing]
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,"><title>{plain(found.title)}</title><style>{STYLE}</style></head>
<body><main>
<div class="brand">driftwise reproduce {escape(found.name)}</div>
<h1>{escape(found.title)}</h1>
<p class="lead">{escape(found.lead)}</p>
<p class="count"><span class="{color}">{escape(found.headline)}</span>{against}.</p>
<p class="quiet">{found.seeds} simulated records; the same command gives the same numbers. A finding is confirmed
where this run meets the numbers that it expects. {escape(found.note)}</p>
{_against(found)}
<nav>{links}</nav>
{_missing("What is not reproduced, and why", missing)}
{"".join(_section(i, section, pictures) for i, section in enumerate(found.sections))}
</main></body></html>
"""


def _against(found: Reproduction) -> str:
    """Return the statements of the paper that do not hold, with the numbers."""
    if not found.refuted:
        return ""
    rows = [[s.where, s.paper, s.truth, measured] for s, measured in found.refuted]
    table = _rows(["", "the paper says", "what holds", "measured"], rows, "statements")
    return f'<section id="against"><h2>What the paper says that does not hold</h2>{table}</section>'


def _missing(title, texts):
    body = "".join(f"<p>{escape(text)}</p>" for text in texts)
    return f"<section><h2>{escape(title)}</h2>{body}</section>" if texts else ""


def _section(number: int, section: Section, pictures) -> str:
    parts = [f"<p>{escape(text)}</p>" for text in section.words]
    parts += [_verdicts(section.verdicts)]
    parts += [_table(table) for table in section.tables]
    parts += [_figure(picture.caption, pictures[picture.name]) for picture in section.pictures]
    if section.missing:
        parts.append('<div class="missing">' + "".join(f"<p>{escape(text)}</p>" for text in section.missing) + "</div>")
    return f'<section id="part{number}"><h2>{escape(section.title)}</h2>{"".join(parts)}</section>'


def _figure(caption: str, png: bytes) -> str:
    image = f"data:image/png;base64,{base64.b64encode(png).decode()}"
    return f'<figure><img alt="{plain(caption)}" src="{image}"><figcaption>{escape(caption)}</figcaption></figure>'


def _table(table: Table) -> str:
    return f"<h3>{escape(table.caption)}</h3>{_rows(table.head, table.rows)}"


def _rows(head, rows, kind="") -> str:
    top = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    table = f'<table class="{kind}"><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>'
    return f'<div class="scroll">{table}</div>'


def _verdicts(verdicts: list[Verdict]) -> str:
    mark = {True: ("good", "✓ confirmed"), False: ("bad", "✗ not confirmed"), None: ("skip", "– skipped")}
    rows = "".join(
        f'<tr><td class="{mark[v.confirmed][0]}">{mark[v.confirmed][1]}</td><td>{escape(v.name)}{_tag(v)}</td>'
        f'<td>{escape(v.value)}</td><td>{escape(v.expected)}</td><td class="quiet">{escape(v.source)}</td></tr>'
        for v in verdicts
    )
    head = "".join(f"<th>{word}</th>" for word in ("", "finding", "found", "expected", "source"))
    return (
        f'<div class="scroll"><table class="verdicts"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'
    )


def _tag(verdict: Verdict) -> str:
    said = verdict.refutes
    return f'<span class="tag">against the paper, {escape(said.where)}</span>' if said else ""
