"""What was measured as tables of words: a head and rows, for the terminal, the page and JSON alike."""

from __future__ import annotations

import numpy as np

from ..papers.verdict import Table
from .board import COLUMNS, DETECTORS, FADING, KALMAN, OURS, TRACKERS
from .run import Measured

NOISE = 0.3  # points of fit: one pass, one split, no more is known


def tables(found: Measured) -> list[Table]:
    """Return every table that has rows, the records where we lose first."""
    made = [fits(found), bars(found), changes(found), days(found), tracks(found), calibration(found)]
    return [table for table in made if table.rows]


def fits(found: Measured) -> Table:
    """Return fit of every method on every record, our worst lead first."""
    rows = sorted(found.rows.values(), key=lambda row: row.lead)
    return Table(
        f"One-step fit, %, second half. Behind the best opponent by more than {NOISE} points: "
        f"{sum(row.lead < -NOISE for row in rows)} of {len(rows)}; ahead: {sum(row.lead > NOISE for row in rows)}. "
        "ARX: the structure of the opponents; s: seconds driftwise took, compiling included",
        ["record", *COLUMNS, "lead", "best opponent", "ARX", "s"],
        [
            [
                row.name,
                *(_fixed(row.scores[c].fit, 1) for c in COLUMNS),
                f"{row.lead:+.1f}",
                row.best[0],
                ",".join(map(str, row.structure)),
                f"{row.seconds:.1f}",
            ]
            for row in rows
        ],
        True,
    )


def bars(found: Measured) -> Table:
    """Return NIS, coverage and log score of the three that claim error bars."""
    claim = (OURS, KALMAN, FADING)
    rows = sorted(found.rows.values(), key=lambda row: row.scores[OURS].log_score - row.density)
    return Table(
        "Error bars, second half: NIS (right: 1) / % in 95 % bands / log score (higher is better); worst lead in log "
        "score first",
        ["record", *claim, "lead"],
        [
            [
                row.name,
                *(_bar(row.scores[c]) for c in claim),
                f"{row.scores[OURS].log_score - row.density:+.2f}",
            ]
            for row in rows
        ],
        True,
    )


def changes(found: Measured) -> Table:
    """Return alarms and delays at labelled changes."""
    from .labels import CHANGES

    rows = []
    for one in found.labelled.values():
        for k, change in enumerate(c for c in CHANGES if c.record == one.name):
            rows.append([change.name, *(one.found[d][k].words for d in DETECTORS)])
    if found.pump:
        seen = {d: [one.found[d][0] for one in found.pump.values()] for d in DETECTORS}
        rows.append([f"pump rig, {len(found.pump)} files", *(_several(seen[d]) for d in DETECTORS)])
    return Table(
        "Labelled changes: false alarms per 1000 samples before / delay in samples", ["change", *DETECTORS], rows, True
    )


def days(found: Measured) -> Table:
    """Return alarms on the days of the air handler."""
    from .labels import FAULTS

    rows = [
        [name, "fault" if name in FAULTS else "nothing to see", *(_day(one.found[d][0]) for d in DETECTORS)]
        for name, one in sorted(found.day.items())
    ]
    return Table(
        "Air handler, after two clean days: minute of the day of the first alarm; faults begin at 0, work at 360",
        ["day", "", *DETECTORS],
        rows,
        True,
    )


def tracks(found: Measured) -> Table:
    """Return RMSE over that of the best fixed filter; ours worst first."""
    kinds = sorted(found.tracks.values(), key=lambda t: -np.median(t.ratio[OURS]))
    return Table(
        "Tracks: median over the series of RMSE / RMSE of the fixed filter that is best in hindsight (! above 2 "
        "somewhere)",
        ["set", "series", "plots", "best fixed filter", "its RMSE, m", *TRACKERS],
        [
            [
                t.name,
                str(len(t.rmse)),
                str(t.plots),
                t.reference,
                f"{np.median(t.rmse):.3g}",
                *(f"{np.median(t.ratio[m]):.2f}{'!' * bool(np.max(t.ratio[m]) > 2)}" for m in TRACKERS),
            ]
            for t in kinds
        ],
        True,
    )


def calibration(found: Measured) -> Table:
    """Return NIS, coverage and density on tracks."""
    claim = TRACKERS[:-1]
    return Table(
        "Tracks: NIS / % in 95 % bands / log density beside that of the best fixed filter, medians",
        ["set", *claim],
        [
            [
                t.name,
                *(
                    f"{np.median(t.nis[m]):.2f} / {np.median(t.share[m]):.0f} / {np.median(t.density[m]):+.2f}"
                    for m in claim
                ),
            ]
            for t in found.tracks.values()
        ],
        True,
    )


def _fixed(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if abs(value) < 1e4 else f"{value:.0e}"


def _bar(score) -> str:
    return f"{_fixed(score.nis, 2)} / {score.share:.0f} / {_fixed(score.log_score, 2)}"


def _several(seen) -> str:
    delays = [s.delay for s in seen if s.delay is not None]
    rate = 1000 * sum(s.before for s in seen) / max(sum(s.clean for s in seen), 1)
    return f"{rate:.1f} / {np.median(delays):.0f} ({len(delays)} found)" if delays else f"{rate:.1f} / none found"


def _day(seen) -> str:
    return "-" if seen.delay is None else str(seen.delay)
