"""The page of a fleet: who needs a look and why, when series jumped, what the fleet is like, whom to believe."""

from __future__ import annotations

from html import escape
from pathlib import Path

from driftwise.report import fleet_words, report_fleet_plots
from driftwise.report import report_page as html
from driftwise.report import report_parts as common
from driftwise.report.fleet_words import shown
from driftwise.report.wording import fixed, number

__all__ = ["write"]

LISTED, OF_EACH = 300, 60  # series in the table, and of each kind before the others come
PARAMETERS = 12  # of which the spread is shown
SHORT = {
    "jumped": "jumped", "drifts": "drifts", "differs": "differs", "noise": "noise", "untaught": "not identifiable",
    "bars": "error bars", "data": "poor data",
}  # fmt: skip


def write(told, path) -> Path:
    """Write the page of a fleet that was run (`fleet_words.Told`) and return its path."""
    figures, found = {}, told.outliers
    names = _compared(told)
    for j in names:
        figures[f"spread{j}"] = report_fleet_plots.spread(
            found.census.theta[:, j], found.census.names[j], found.keys, _odd(told, j), worth=found.rest.z[:, j]
        )
    figures["spreadnoise"] = report_fleet_plots.spread(
        found.census.noise, "standard deviation of the noise", found.keys, found.found["noise"].rows,
        worth=found.rest.noise_z,
    )  # fmt: skip
    if pair := _pair(told, names):
        x, y = (found.census.theta[:, j] for j in pair)
        labels = tuple(found.census.names[j] for j in pair)
        figures["against"] = report_fleet_plots.against(x, y, labels, found.keys, found.found["differs"].rows)
    jumped = _jumped(told)
    if jumped is not None:
        figures["jumps"] = jumped
    figures |= _trust(told)
    script, parts = common.components(figures)
    sections = [_table(told), _when(parts), _spreads(parts, names), _bars(parts), _quality(told)]
    return common.write(
        path,
        title=f"{told.title}: {told.output}",
        facts=" \u00b7 ".join([*told.facts, *told.cost]),
        lead=fleet_words.lead(told),
        cards=_cards(told),
        sections=[section for section in sections if section],
        folds=[_parameters(told), _judged(), _notes(told)],
        script=script,
    )


def _compared(told) -> list[int]:
    """Return the parameters that are compared over the fleet, those with most outliers first where they are many."""
    import numpy as np

    z = told.outliers.rest.z
    seen = [j for j in range(z.shape[1]) if np.isfinite(z[:, j]).any()]
    if len(seen) <= PARAMETERS:
        return seen
    worst = sorted(seen, key=lambda j: -float(np.nanmax(np.abs(z[:, j]))))[:PARAMETERS]
    return sorted(worst)


def _odd(told, j: int):
    """Return the rows that differ in parameter j."""
    import numpy as np

    rows = told.outliers.found["differs"].rows
    z = np.nan_to_num(told.outliers.rest.z[rows])
    return rows[np.abs(z[:, j]) >= 0.5 * np.abs(z).max(axis=1)] if len(rows) else rows


def _pair(told, names) -> tuple[int, int] | None:
    """Return the two parameters in which most series differ."""
    if len(names) < 2:
        return None
    first, second = sorted(names, key=lambda j: (-len(_odd(told, j)), j))[:2]
    return min(first, second), max(first, second)


def _jumped(told):
    import numpy as np

    last = told.tally["last_jump"]
    time = last[np.isfinite(last)]
    if not len(time) or told.span is None or not told.span[1] > told.span[0]:
        return None
    span, origin = told.span, None
    if told.is_dated:
        origin, span, time = "1970-01-01", (span[0], span[1]), time
    return report_fleet_plots.jumps(time, span, told.outliers.together, origin, "time")


def _trust(told) -> dict:
    """Return how NIS and coverage are spread over the fleet."""
    import numpy as np

    from driftwise.fleet.counters import FEW
    from driftwise.fleet.outliers import HELD, NIS

    scored = told.tally["scored"]
    with np.errstate(divide="ignore", invalid="ignore"):
        nis = np.where(scored >= FEW, told.tally["z2"] / scored, np.nan)
        held = np.where(scored >= FEW, 100 * told.tally["inside"] / scored, np.nan)
    if not np.isfinite(nis).any():
        return {}
    keys, odd = told.outliers.keys, told.outliers.found["bars"].rows
    percent = (100 * HELD[0], 100 * HELD[1])
    return {
        "trustnis": report_fleet_plots.spread(nis, "NIS", keys, odd, worth=nis - 1, ideal=NIS),
        "trustheld": report_fleet_plots.spread(
            held, "samples inside their 95 % bands (%)", keys, odd, worth=held - 95, ideal=percent
        ),
    }


def _cards(told) -> list[str]:
    found, many = told.outliers.found, len(told.fleet)
    there = [html.card("Series", shown(many), f"{_large(told.samples)} samples")]

    def counts(*kinds) -> list[str]:
        numbers = [(name, len(found[kind].rows), note) for kind, name, note in kinds]
        return [html.card(name, shown(count), note, "warn" if count else "good") for name, count, note in numbers]

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
        html.group("What was there", there),
        html.group("Who stands out", odd),
        html.group("Whom not to believe", sure),
    ]


def _large(count: int) -> str:
    """Return a number in few letters."""
    return shown(count) if count < 1_000_000 else f"{number(count / 1e6, 3)} million"


def _table(told) -> str:
    found = told.outliers
    if not len(found.rows):
        return html.section("look", "Who needs a look", "Nobody.")
    reasons: dict[int, list[str]] = {}
    chosen: list[int] = []
    for depth in (OF_EACH, LISTED):  # the worst of each kind first, then the others
        for kind, (rows, _) in found.found.items():
            for row in rows[:depth].tolist():
                reasons.setdefault(row, [])
                if kind not in reasons[row]:
                    reasons[row].append(kind)
                if row not in chosen and len(chosen) < LISTED:
                    chosen.append(row)
    chosen.sort(key=lambda row: (-len(reasons[row]), min(list(found.found).index(kind) for kind in reasons[row])))
    body = [[_key(found.keys[row]), _tags(reasons[row]), _why(told, row, reasons[row])] for row in chosen]
    words = "Those with most against them first."
    if len(found.rows) > len(chosen):
        words += f" {shown(len(chosen))} of {shown(len(found.rows))} are listed; the files name all."
    return html.section("look", "Who needs a look", words, html.table([told.by, "", "why"], body, text=(0, 1, 2)))


def _key(key) -> str:
    return f'<span style="white-space:nowrap">{escape(str(key))}</span>'


def _tags(kinds) -> str:
    return "<span>" + " ".join(html.tag(SHORT[kind], "warn") for kind in kinds) + "</span>"


def _why(told, row: int, kinds) -> str:
    return "; ".join(told.outliers.words(kind, row) for kind in kinds)


def _when(parts) -> str:
    if "jumps" not in parts:
        return ""
    words = (
        "Each series counts where it jumped last, as the jump was noticed: some samples after it happened. Where many "
        "jump within 20 samples, and chance does not explain it (1 in 1000), look for what they have in common."
    )
    return html.section("jumps", "When they jumped", words, common.plot(parts["jumps"]))


def _spreads(parts, names) -> str:
    words = (
        "How each parameter is spread over the fleet. Marked are series that differ by more than their own deviation "
        "and the spread of the fleet explain; those far outside stand at the edge. Point at a mark for its name."
    )
    divs = [parts[f"spread{j}"] for j in names] + [parts["spreadnoise"]]
    more = [common.plot(parts["against"])] if "against" in parts else []
    return html.section("fleet", "The fleet at a glance", words, *common.grid(divs, 2), *more)


def _bars(parts) -> str:
    divs = common.of(parts, "trustnis") + common.of(parts, "trustheld")
    if not divs:
        return ""
    words = (
        "NIS is 1 and 95 % of the samples lie inside their bands where the error bars are right; shaded is what is "
        "close enough. Series with fewer than 30 scored samples are left out."
    )
    return html.section("bars", "Can the error bars be believed?", words, *common.grid(divs, 2))


def _quality(told) -> str:
    rows = [
        [what, shown(count), f"{fixed(100 * share, 2)} %", shown(series)]
        for what, count, share, series in fleet_words.quality(told)
    ]
    if not rows:
        return html.section("data", "The data", "Every row was used: nothing missing, late or broken.")
    words = "Rows that were missing, broken or out of order are counted, never used in silence."
    return html.section("data", "The data", words, html.table(["", "rows", "share", "series"], rows))


def _parameters(told) -> str:
    rest, names = told.outliers.rest, told.outliers.census.names
    rows = [
        [name, number(rest.median[j], 4), number(rest.spread[j], 2)]
        for j, name in enumerate(names)
        if rest.median[j] == rest.median[j]
    ]
    rows.append(["noise", number(rest.noise, 4), ""])
    words = "Medians over the fleet, and how far its members differ beyond their own deviations."
    return html.fold("rest", "What the rest is like", f"{len(rows)} numbers", words,
                     html.table(["", "median", "spread"], rows))  # fmt: skip


def _judged() -> str:
    words = (
        "Differences, noise and error bars are judged so that of those named 1 % are named wrongly (Benjamini and "
        "Hochberg); in a fleet of one kind, one fleet in a hundred has anybody named at all. Drift is told where "
        "standing still is less than 20 % likely at the end of the record. Jumps are those that the memory told, false "
        "alarms and all. A combination of parameters is not identifiable where its variance is more than half of what "
        "it was before any data. Offsets are not compared."
    )
    return html.fold("judged", "How they were judged", "rates and thresholds", words)


def _notes(told) -> str:
    said = [*told.notes, *told.files]
    return html.fold("notes", "Files and notes", str(len(said)), "", "".join(map(html.say, said))) if said else ""
