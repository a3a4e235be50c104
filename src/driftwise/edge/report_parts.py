"""What the pages of several estimators have in common: grids, cards of fit, NIS in words, the table of events."""

from __future__ import annotations

from pathlib import Path

from driftwise.edge import report_page as html
from driftwise.edge.wording import fixed, near_one, number

__all__ = [
    "EVENTS_SHOWN",
    "chosen",
    "event_table",
    "event_words",
    "fit_cards",
    "grade",
    "grid",
    "nis_words",
    "plot",
    "write",
]

EVENTS_SHOWN = 200


def plot(div: str) -> str:
    return f'<div class="plot">{div}</div>'


def grid(divs: list[str]) -> list[str]:
    """Return the figures in a grid with the number of columns that leaves the fewest holes."""
    if not divs:
        return []
    columns = len(divs) if len(divs) <= 3 else min((3, 2), key=lambda c: (-len(divs) % c, -c))
    return [
        f'<div class="many" style="--columns:{columns}">',
        *[f"<div>{div}</div>" for div in divs],
        "</div>",
    ]


def grade(good: bool, fair: bool) -> str:
    return "good" if good else "warn" if fair else "bad"


def fit_cards(summary, name: str = "") -> list[str]:
    """Return how well one output is predicted, on cards: fit, NIS and coverage; ``name`` tells outputs apart."""
    nis, coverage = float(summary.nis), float(summary.coverage)
    size = grade(0.8 <= nis <= 1.25, 0.5 <= nis <= 2)
    held = grade(0.92 <= coverage <= 0.975, coverage >= 0.85)
    of = f" of {name}" if name else ""
    return [
        html.card(f"One-step fit{of}", fixed(summary.fit, 1), "100 = perfect, 0 = no better than the mean", unit="%"),
        html.card(f"NIS{of}", fixed(nis, 2), _expected(summary.nis_interval), size),
        html.card(f"Held by 95 % bands{of}", fixed(100 * coverage, 1), "should be about 95", held, "%"),
    ]


def _expected(nis) -> str:
    if not nis.samples:
        return "1 = error bars of the right size"
    return f"1 = right error bars; 95 %: {near_one(nis.low, nis.high, ' to ')}"


def nis_words(nis) -> str:
    if not nis.samples:
        return "not known yet."
    found = f"{fixed(nis.value, 3)}; under the right model it lies between {near_one(nis.low, nis.high, ' and ')} "
    found += "in 95 of 100 records"
    if nis.is_consistent:
        return found + ", and so it does."
    size = 100 * abs(nis.value**0.5 - 1)
    return f"{found}. The error bars are {number(size, 2)} % too {'narrow' if nis.value > 1 else 'wide'}."


def chosen(events) -> list:
    """Return the events that are shown: jumps first, then the others while there is room, in order."""
    jumps = [event for event in events if event.kind == "JUMP"][:EVENTS_SHOWN]
    others = [event for event in events if event.kind != "JUMP"][: EVENTS_SHOWN - len(jumps)]
    return sorted([*jumps, *others], key=lambda event: event.sample)


def event_words(events) -> str:
    if not events:
        return "Nothing to report: no sample was rejected and no guard had to act."
    jumps = sum(event.kind == "JUMP" for event in events)
    shown = f", {EVENTS_SHOWN} shown" if len(events) > EVENTS_SHOWN else ""
    counted = f", the {f'{jumps} jumps' if jumps > 1 else 'jump'} of the parameters first" if jumps else ""
    return f"{len(events)} event{'s' if len(events) > 1 else ''}{counted}{shown}."


def event_table(events) -> str:
    if not events:
        return ""
    told = sorted(chosen(events), key=lambda event: event.kind != "JUMP")  # jumps first
    rows = [[event.sample, number(event.time), event.text] for event in told]
    return html.table(["sample", "time", "what happened"], rows, text=(2,))


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
