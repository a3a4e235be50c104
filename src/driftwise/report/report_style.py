"""The style sheet of the pages: light, system fonts, colours that everyone can tell apart, A4 in print."""

from __future__ import annotations

__all__ = ["STYLE"]

STYLE = """
:root { --ink:#1f2933; --quiet:#52606d; --line:#dfe4ea; --paper:#f5f7fa; --card:#fff; --blue:#0072b2;
        --good:#00664a; --warn:#7a5200; --bad:#a33f00; }
* { box-sizing:border-box; }
body { margin:0; background:var(--paper); color:var(--ink); line-height:1.5; font-size:15px;
       font-family:system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif; }
main { max-width:1180px; margin:0 auto; padding:22px 24px 48px; }
header { display:grid; grid-template-columns:1fr auto; align-items:baseline; gap:0 18px; }
header .brand { color:var(--blue); font-weight:650; grid-area:1/2; } header .facts { grid-area:2/1/3/3; }
h1 { font-size:25px; line-height:1.25; margin:0; letter-spacing:-.01em; overflow-wrap:anywhere; }
header .facts { color:var(--quiet); margin:0; }
.lead { margin:14px 0 16px; padding:14px 20px; background:var(--card); border-radius:10px;
        border:1px solid var(--line); border-left:5px solid var(--blue); max-width:none; }
.lead strong { display:block; font-size:19px; line-height:1.4; font-weight:600; margin-bottom:3px; }
.cards { display:flex; flex-wrap:wrap; gap:14px; margin-bottom:18px; }
.group { display:flex; flex-direction:column; min-width:min-content; }
.group h2 { font-size:13px; color:var(--quiet); font-weight:600; margin:0 0 5px 2px; }
.group .row, .cards .row { display:flex; flex-wrap:wrap; gap:10px; flex:1; }
.card { background:var(--card); border:1px solid var(--line); border-radius:10px; padding:10px 12px 11px;
        min-width:126px; flex:1; }
.card .name { color:var(--quiet); font-size:13px; }
.card .value { font-size:25px; font-weight:650; letter-spacing:-.015em; line-height:1.3;
               font-variant-numeric:tabular-nums; white-space:nowrap; }
.card .value small { font-size:14px; font-weight:500; color:var(--quiet); letter-spacing:0; }
.card .note { font-size:12.5px; line-height:1.35; color:var(--quiet); }
.card.long .value { font-size:19px; line-height:1.7; white-space:normal; }
.card.long .value small { font-size:13px; }
.card.good .value { color:var(--good); } .card.warn .value { color:var(--warn); }
.card.bad .value { color:var(--bad); }
.card.good .value::after { content:" \\2713"; font-size:17px; }
.card.warn .value::after { content:" !"; font-size:19px; }
.card.bad .value::after { content:" \\2717"; font-size:17px; }
section, details { background:var(--card); border:1px solid var(--line); border-radius:10px;
          padding:14px 18px 12px; margin-bottom:16px; }
section h2, summary h2 { font-size:17px; margin:0; letter-spacing:-.005em; display:inline; }
p.say { color:var(--quiet); margin:2px 0 8px; font-size:14px; max-width:130ch; }
p.howto { font-size:13px; margin:4px 0 0; }
summary { cursor:pointer; list-style-position:outside; margin-left:16px; padding-left:2px; }
summary .hint { color:var(--quiet); font-size:14px; margin-left:10px; }
details[open] > summary { margin-bottom:8px; }
details { padding-bottom:14px; } details.last { margin-bottom:22px; }
.more { display:flex; align-items:baseline; gap:14px; margin:24px 2px 10px; }
.more h2 { font-size:17px; margin:0; }
button { font:inherit; font-size:14px; color:var(--blue); background:none; border:1px solid var(--line);
         border-radius:6px; padding:2px 12px; cursor:pointer; }
.choice { margin:2px 0 6px; } .choice select { font:inherit; font-size:14px; color:var(--ink); background:var(--card);
         border:1px solid var(--line); border-radius:6px; padding:3px 8px; margin-left:6px; max-width:100%; }
.pair { display:grid; grid-template-columns:repeat(auto-fit,minmax(420px,1fr)); gap:20px; align-items:center; }
.pair > * { min-width:0; }
.many { display:grid; grid-template-columns:repeat(var(--columns,2),minmax(0,1fr)); gap:4px 18px; }
.center { display:flex; flex-wrap:wrap; justify-content:center; align-items:center; gap:4px 14px; }
.scroll + .scroll, .say + .scroll { margin-top:10px; }
.many > div, .plot { min-width:0; }
table { border-collapse:collapse; width:100%; font-size:14px; font-variant-numeric:tabular-nums; }
th { text-align:right; color:var(--quiet); font-weight:550; font-size:13px; padding:4px 10px;
     border-bottom:1px solid var(--line); }
td { text-align:right; padding:4px 10px; border-bottom:1px solid #eef1f4; vertical-align:baseline; }
td:not(.text):not(:first-child) { white-space:nowrap; }
th:first-child, td:first-child { text-align:left; font-weight:600; }
td.text, th.text { text-align:left; font-weight:400; }
tr:last-child td { border-bottom:none; }
.scroll { max-height:330px; overflow:auto; } #look .scroll { max-height:560px; }
#verdicts .scroll { max-height:none; }
.tag { display:inline-block; font-size:13px; border-radius:99px; padding:0 9px; font-weight:600; white-space:nowrap; }
.tag.good { color:var(--good); background:#e3f4ee; } .tag.good::before { content:"\\2713\\00a0"; }
.tag.warn { color:var(--warn); background:#fdf1d9; } .tag.warn::before { content:"!\\00a0"; }
.tag.bad { color:var(--bad); background:#fbe9df; } .tag.bad::before { content:"\\2717\\00a0"; }
footer { color:var(--quiet); font-size:13px; padding:4px 2px; }
@media (max-width:640px) { main { padding:14px 10px; } section, details { padding:12px 10px; }
  .pair, .many { grid-template-columns:minmax(0,1fr); } td, th { padding:4px 5px; }
  .group { flex:1 1 100% !important; } }
@page { size:A4 portrait; margin:12mm 11mm; }
@media print {
  html { zoom:.602; } /* 188 mm hold the 1180 pixels that the figures were drawn for */
  body { background:#fff; font-size:18px; print-color-adjust:exact; -webkit-print-color-adjust:exact; }
  main { padding:0; } .plot > div { zoom:var(--fit,1); }
  .plot { height:var(--height,auto); contain:var(--contain,none); } /* or Chromium makes the page smaller still */
  p.say, table, .tag { font-size:17px; }
  th, .card .note, .card .name { font-size:15px; }
  .group h2 { font-size:15px; }
  section, details, .card, .lead { border-color:#c3cad3; }
  .lead, .cards, .plot, .many > div, tr, summary, p.say { break-inside:avoid; }
  section h2, summary, p.say { break-after:avoid; }
  .scroll { max-height:none; overflow:visible; }
  details:not([open]), .more, button, .howto { display:none; } /* what is folded stays off the paper */
}
"""
