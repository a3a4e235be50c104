"""The page of a fleet: who needs a look and why, when series jumped, what the fleet is like, whom to believe."""

from __future__ import annotations

from html import escape
from pathlib import Path

from driftwise.report import fleet_plots, fleet_report
from driftwise.report.fleet_report import shown
from driftwise.report.page import Card, Page, Panel, columns, group, say, table, tag
from driftwise.results.numbers import fixed, number
from driftwise.results.sentences import HOW_JUMPS_COUNT, WHEN_JUMPED

LISTED, OF_EACH = 300, 60  # series in the table, and of each kind before the others come
PARAMETERS = 12  # of which the spread is shown
SHORT = {
    "jumped": "jumped", "drifts": "drifts", "differs": "differs", "noise": "noise", "untaught": "not identifiable",
    "bars": "error bars", "data": "poor data",
}  # fmt: skip


def write(report, path) -> Path:
    """Write the page of a fleet that was run (`fleet_report.FleetReport`) and return its path."""
    panels = [
        _look(report), _jumps(report), _spreads(report), _bars(report), _quality(report), _parameters(report),
        _judged(), _notes(report),
    ]  # fmt: skip
    title, facts = f"{report.title}: {report.output}", [*report.facts, *report.cost]
    return Page(title, panels, fleet_report.lead(report), facts, _cards(report)).write(path)


def _compared(report) -> list[int]:
    """Return the parameters that are compared over the fleet, those with most outliers first where they are many."""
    import numpy as np

    z = report.outliers.rest.z
    seen = [j for j in range(z.shape[1]) if np.isfinite(z[:, j]).any()]
    if len(seen) <= PARAMETERS:
        return seen
    worst = sorted(seen, key=lambda j: -float(np.nanmax(np.abs(z[:, j]))))[:PARAMETERS]
    return sorted(worst)


def _odd(report, j: int):
    """Return the rows that differ in parameter j."""
    import numpy as np

    rows = report.outliers.found["differs"].rows
    z = np.nan_to_num(report.outliers.rest.z[rows])
    return rows[np.abs(z[:, j]) >= 0.5 * np.abs(z).max(axis=1)] if len(rows) else rows


def _pair(report, names) -> tuple[int, int] | None:
    """Return the two parameters in which most series differ."""
    if len(names) < 2:
        return None
    first, second = sorted(names, key=lambda j: (-len(_odd(report, j)), j))[:2]
    return min(first, second), max(first, second)


def _jumps(report) -> Panel | None:
    """Return when series jumped last."""
    import numpy as np

    last = report.tally["last_jump"]
    time = last[np.isfinite(last)]
    if not len(time) or report.span is None or not report.span[1] > report.span[0]:
        return None
    origin = "1970-01-01" if report.is_dated else None
    figure = fleet_plots.jumps(time, report.span, report.outliers.together, origin, "time")
    return Panel("jumps", WHEN_JUMPED, HOW_JUMPS_COUNT, (figure,))


def _spreads(report) -> Panel:
    """Return how each number is spread over the fleet, and the two in which most differ against each other."""
    found, names, figures = report.outliers, _compared(report), []
    theta, labels, keys = found.census.theta, found.census.names, found.keys
    for j in names:
        figures.append(fleet_plots.spread(theta[:, j], labels[j], keys, _odd(report, j), worth=found.rest.z[:, j]))
        figures[-1].name = f"spread{j}"
    noisy = found.found["noise"].rows
    label, worth = "standard deviation of the noise", found.rest.noise_z
    figures.append(fleet_plots.spread(found.census.noise, label, keys, noisy, worth=worth))
    figures[-1].name = "spreadnoise"
    more = []
    if pair := _pair(report, names):
        x, y = (theta[:, j] for j in pair)
        more = [fleet_plots.against(x, y, tuple(labels[j] for j in pair), keys, found.found["differs"].rows)]
    words = (
        "How each parameter is spread over the fleet. Marked are series that differ by more than their own deviation "
        "and the spread of the fleet explain; those far outside stand at the edge. Point at a mark for its name."
    )
    return Panel("fleet", "The fleet at a glance", words, (*columns(figures), *more))


def _bars(report) -> Panel | None:
    """Return how NIS and coverage are spread over the fleet."""
    import numpy as np

    from driftwise.fleet.counters import FEW
    from driftwise.fleet.outliers import HELD, NIS

    scored = report.tally["scored"]
    with np.errstate(divide="ignore", invalid="ignore"):
        nis = np.where(scored >= FEW, report.tally["z2"] / scored, np.nan)
        held = np.where(scored >= FEW, 100 * report.tally["inside"] / scored, np.nan)
    if not np.isfinite(nis).any():
        return None
    keys, odd = report.outliers.keys, report.outliers.found["bars"].rows
    percent = (100 * HELD[0], 100 * HELD[1])
    figures = [
        fleet_plots.spread(nis, "NIS", keys, odd, worth=nis - 1, ideal=NIS),
        fleet_plots.spread(held, "samples inside their 95 % bands (%)", keys, odd, worth=held - 95, ideal=percent),
    ]
    for figure, name in zip(figures, ("trustnis", "trustheld")):
        figure.name = name
    words = (
        "NIS is 1 and 95 % of the samples lie inside their bands where the error bars are right; shaded is what is "
        "close enough. Series with fewer than 30 scored samples are left out."
    )
    return Panel("bars", "Can the error bars be believed?", words, tuple(columns(figures)))


def _cards(report) -> list[str]:
    def counts(*kinds) -> list[Card]:
        numbers = [(name, len(report.outliers.found[kind].rows), note) for kind, name, note in kinds]
        return [Card(name, shown(count), note, "warn" if count else "good") for name, count, note in numbers]

    samples = report.samples
    large = shown(samples) if samples < 1_000_000 else f"{number(samples / 1e6, 3)} million"
    odd = counts(
        ("jumped", "Jumped", "parameters changed at once"),
        ("drifts", "Drift", "parameters wander"),
        ("differs", "Differ", "not like the rest"),
        ("noise", "Noise", "louder or quieter"),
    )
    sure = counts(
        ("untaught", "Not identifiable", "nothing moves them"),
        ("bars", "Wrong error bars", "NIS or coverage"),
        ("data", "Poor data", "missing, late, too few"),
    )
    return [
        group("What was there", [Card("Series", shown(len(report.fleet)), f"{large} samples")]),
        group("Who stands out", odd),
        group("Whom not to believe", sure),
    ]


def _look(report) -> Panel:
    """Return who needs a look: the worst of each kind first, then the others; those with most against them on top."""
    found = report.outliers
    if not len(found.rows):
        return Panel("look", "Who needs a look", "Nobody.")
    reasons: dict[int, list[str]] = {}
    chosen: list[int] = []
    for depth in (OF_EACH, LISTED):
        for kind, (rows, _) in found.found.items():
            for row in rows[:depth].tolist():
                if kind not in reasons.setdefault(row, []):
                    reasons[row].append(kind)
                if row not in chosen and len(chosen) < LISTED:
                    chosen.append(row)
    chosen.sort(key=lambda row: (-len(reasons[row]), min(list(found.found).index(kind) for kind in reasons[row])))
    words = "Those with most against them first."
    if len(found.rows) > len(chosen):
        words += f" {shown(len(chosen))} of {shown(len(found.rows))} are listed; the files name all."
    body = []
    for row in chosen:
        key = f'<span style="white-space:nowrap">{escape(str(found.keys[row]))}</span>'
        tags = " ".join(tag(SHORT[kind], "warn") for kind in reasons[row])
        body.append([key, f"<span>{tags}</span>", "; ".join(found.words(kind, row) for kind in reasons[row])])
    return Panel("look", "Who needs a look", words, (table([report.by, "", "why"], body, text=(0, 1, 2)),))


def _quality(report) -> Panel:
    rows = [
        [what, shown(count), f"{fixed(100 * share, 2)} %", shown(series)]
        for what, count, share, series in fleet_report.quality(report)
    ]
    words = "Rows that were missing, broken or out of order are counted, never used in silence."
    if not rows:
        words = "Every row was used: nothing missing, late or broken."
    return Panel("data", "The data", words, (table(["", "rows", "share", "series"], rows),))


def _parameters(report) -> Panel:
    rest, names = report.outliers.rest, report.outliers.census.names
    rows = [
        [name, number(rest.median[j], 4), number(rest.spread[j], 2)]
        for j, name in enumerate(names)
        if rest.median[j] == rest.median[j]
    ]
    rows.append(["noise", number(rest.noise, 4), ""])
    words = "Medians over the fleet, and how far its members differ beyond their own deviations."
    shown = table(["", "median", "spread"], rows)
    return Panel("rest", "What the rest is like", words, (shown,), f"{len(rows)} numbers")


def _judged() -> Panel:
    words = (
        "Differences, noise and error bars are judged so that of those named 1 % are named wrongly (Benjamini and "
        "Hochberg); in a fleet of one kind, one fleet in a hundred has anybody named at all. Drift is told where "
        "standing still is less than 20 % likely at the end of the record. Jumps are those that the memory told, false "
        "alarms and all. A combination of parameters is not identifiable where its variance is more than half of what "
        "it was before any data. Offsets are not compared."
    )
    return Panel("judged", "How they were judged", words, (), "rates and thresholds")


def _notes(report) -> Panel | None:
    said = [*report.notes, *report.files]
    return Panel("notes", "Files and notes", "", tuple(map(say, said)), str(len(said))) if said else None
