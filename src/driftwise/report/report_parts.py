"""What the pages of several estimators have in common: grids, cards of fit, NIS in words, the table of events.

How a page is put together from plain columns, whatever estimated them::

    line = Timeline(time, labels["time"], origin)                 # one time axis for all panels (report_axes)
    found = marks(events, time, status)                           # jumps, rises of the noise, outliers (report_marks)
    figures = {"output": output(line, y, prediction, half, "level (m)", outlier=outlier, marks=found)}
    figures |= named("input", inputs(line, u.T, ["valve (%)"]))                                  # (report_plots)
    figures |= named("parameter", panels(line, names, values, deviations, marks=found))
    figures |= {"weights": weights(line, shares, members), "innovations": innovations(line, z, outlier=outlier)}
    script, parts = components(figures)
    cards = [group("The plant", [card("Time constant", "1.8", unit="s")])]                       # (report_page)
    sections = [section("prediction", "Measured and predicted", zoom_words(line), plot(parts["output"]))]
    sections += [section("verdicts", "Verdicts", "", verdict_list(rows))]
    write(path, title=.., facts=.., lead=.., cards=cards, sections=sections, folds=[fold(..)], script=script)

The first sentence of the lead is the headline; sections are always open, folds open when asked to. The order: the
answer, the output with its inputs, parameters, innovations, verdicts, then the folds.
"""

from __future__ import annotations

from pathlib import Path

from driftwise.analysis.forecast_verdicts import off
from driftwise.report import report_page as html
from driftwise.report.wording import fixed, near_one

__all__ = [
    "EVENTS_SHOWN",
    "change_table",
    "chosen",
    "components",
    "event_table",
    "event_words",
    "fit_cards",
    "grade",
    "grid",
    "named",
    "nis_words",
    "of",
    "plot",
    "stack",
    "write",
    "zoom_words",
]

EVENTS_SHOWN = 200
CHANGES_SHOWN = 8


def named(kind: str, figures: list) -> dict:
    """Return figures under numbered names."""
    return {f"{kind}{j}": figure for j, figure in enumerate(figures)}


def of(parts: dict, kind: str) -> list[str]:
    """Return the markup of the figures that were `named` so."""
    return [part for name, part in parts.items() if name.rstrip("0123456789") == kind]


def components(figures: dict) -> tuple[str, dict[str, str]]:
    """Return the script that draws the figures, and the markup of each under its name."""
    try:
        from bokeh import embed
    except ImportError:
        raise ImportError("the report is drawn with Bokeh, which is not installed: pip install bokeh") from None
    for name, figure in figures.items():
        figure.name = name
    return embed.components(figures)


def zoom_words(line) -> str:
    """Return how to look closer at the panels over a `Timeline`, and what was left out of them; this is markup."""
    from driftwise.report.report_plots import POINTS

    words = (
        "Drag to zoom, Ctrl and wheel to zoom at the pointer, double click for the whole record: all time axes move "
        "together."
    )
    thinned = (
        " A long record: of every stretch the lowest and the highest sample are drawn and joined. No spike is lost, "
        "but what lies between them is not here to zoom into."
    )
    return f'<p class="say howto">{words}{thinned if line.rows[-1] >= POINTS else ""}</p>'


def plot(div: str) -> str:
    """Return a figure in its place."""
    return f'<div class="plot">{div}</div>'


def stack(divs: list[str]) -> list[str]:
    """Return panels one above the other, so that the same instant is at the same place; in two columns from five on."""
    return [plot(div) for div in divs] if len(divs) <= 4 else grid(divs, 2)


def grid(divs: list[str], columns: int = 2) -> list[str]:
    """Return the figures in columns."""
    if not divs:
        return []
    columns = min(columns, len(divs))
    return [
        f'<div class="many" style="--columns:{columns}">',
        *map(plot, divs),
        "</div>",
    ]


def grade(good: bool, fair: bool) -> str:
    return "good" if good else "warn" if fair else "bad"


def fit_cards(summary) -> list[str]:
    """Return how well one output is predicted, on cards: fit, NIS and coverage."""
    nis, coverage = float(summary.nis), float(summary.coverage)
    size = grade(0.8 <= nis <= 1.25, 0.5 <= nis <= 2)
    held = grade(0.92 <= coverage <= 0.975, coverage >= 0.85)
    return [
        html.card(
            "One-step fit", fixed(summary.fit, 1), "100 perfect, 0 as good as the mean",
            "bad" if summary.fit < 0 else "", "%",
        ),
        html.card("NIS", fixed(nis, 2), _expected(summary.nis_interval), size),
        html.card("95 % bands hold", fixed(100 * coverage, 1), "about 95 is right", held, "%"),
    ]  # fmt: skip


def _expected(nis) -> str:
    if not nis.samples:
        return "1: right error bars"
    return f"right error bars: {near_one(nis.low, nis.high, ' to ')}"


def nis_words(nis) -> str:
    if not nis.samples:
        return "not known yet."
    found = f"{fixed(nis.value, 3)}; under the right model it lies between {near_one(nis.low, nis.high, ' and ')} "
    found += "in 95 of 100 records"
    if nis.is_consistent:
        return found + ", and so it does."
    return f"{found}. The error bars are {off(nis.value)}."


def chosen(events) -> list:
    """Return the events that are shown: jumps first, then the others while there is room, in order."""
    jumps = [event for event in events if event.kind == "JUMP"][:EVENTS_SHOWN]
    others = [event for event in events if event.kind != "JUMP"][: EVENTS_SHOWN - len(jumps)]
    return sorted([*jumps, *others], key=lambda event: event.sample)


def event_words(events) -> tuple[str, str]:
    """Return how many events there are, and what is to be said of them."""
    if not events:
        return "none", "Nothing to report: no sample was rejected and no guard had to act."
    jumps = sum(event.kind == "JUMP" for event in events)
    shown = f", {EVENTS_SHOWN} shown" if len(events) > EVENTS_SHOWN else ""
    counted = f", the {f'{jumps} jumps' if jumps > 1 else 'jump'} of the parameters first" if jumps else ""
    count = f"{len(events)} event{'s' if len(events) > 1 else ''}"
    return count, f"{count}{counted}{shown}."


def event_table(events, line) -> str:
    """Return the table of what happened, jumps first; the `Timeline` says when."""
    if not events:
        return ""
    told = sorted(chosen(events), key=lambda event: event.kind != "JUMP")
    rows = [[event.sample, line.words(event.time), event.text] for event in told]
    return html.table(["sample", line.label, "what happened"], rows, text=(1, 2))


def change_table(events, line) -> str:
    """Return the table of the jumps, the last ones where they are many; nothing without any."""
    jumps = [event for event in events if event.kind == "JUMP"]
    rows = [[line.words(event.time), event.text] for event in jumps[-CHANGES_SHOWN:]]
    if not rows:
        return ""
    more = f"the last {CHANGES_SHOWN} of {len(jumps)} jumps" if len(jumps) > CHANGES_SHOWN else "what changed"
    return html.table([line.label, more], rows, text=(0, 1))


def write(path, **parts) -> Path:
    """Write a page of these parts (those of `report_page.page`), with all that Bokeh needs in it; return its path."""
    from bokeh.resources import Resources

    text = html.page(
        footer="Made by driftwise. The page is self-contained: nothing is loaded from the network.",
        library=Resources(mode="inline", components=["bokeh"], minified=True).render_js(),
        **parts,
    )
    path = Path(path)
    path.write_text(text, encoding="utf-8")
    return path
