"""What is reported of a fleet, on the terminal and on the page: who needs a look, and how much there was."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from driftwise.results.numbers import capital, count_of, grouped, instant, lasting, number
from driftwise.results.sentences import COUNT_JUMPED, NOTHING, burst_words, false_jumps_words

COUNTED = {  # of each kind, for one and for several
    "jumped": (COUNT_JUMPED, COUNT_JUMPED),
    "drifts": ("{} drifts", "{} drift"),
    "differs": ("{} is not like the rest", "{} are not like the rest"),
    "noise": ("{} is louder or quieter than the rest", "{} are louder or quieter than the rest"),
    "untaught": ("{} is not identifiable", "{} are not identifiable"),
    "bars": ("of {} the error bars cannot be believed", "of {} the error bars cannot be believed"),
    "data": ("{} has poor data", "{} have poor data"),
}
MOST_LATE = 0.5  # share of late rows beyond which the table stands in another order
SAME = 0.02  # of the span of a series: times that lie closer are the same
FEWEST = 3.0  # rows of a series, below which its key is doubted
COMMON = 0.9  # share of the series that has a step, from which on it is that of the fleet
MIXED = 0.1  # share of the fleet that differs, beyond which it is not of one kind
QUALITY = {
    "missing": "missing outputs", "bad": "rows with cells that cannot be read", "late": "late rows",
    "duplicate": "rows that came twice", "timeless": "rows without a time", "early": "rows before the first output",
    "gaps": "gaps in the clock", "filled": "missing ticks filled",
    "rejected": "outliers set aside by the gate", "outliers": "outliers that hardly counted",
    "lost": "states lost and restarted",
}  # fmt: skip


@dataclass(frozen=True)
class FleetReport:
    """A fleet that was run, and what is known of the run.

    Attributes
    ----------
    title, output, inputs, by : the table and its columns
    fleet, tally, outliers : what came of it
    model : the estimator in words
    is_dated : whether times are seconds since 1970
    dt : step of the clock, if one was given
    took : s of the run, None where that is not known
    files, notes : what was written, what to beware of
    """

    title: str
    by: str
    output: str
    inputs: tuple[str, ...]
    fleet: Any
    tally: Any
    outliers: Any
    model: str = ""
    took: float | None = None
    peak: float | None = None  # bytes of memory, at most
    rows: int | None = None
    dt: float | None = None
    is_dated: bool = False
    files: tuple[str, ...] = ()
    notes: tuple[str, ...] = field(default=())

    def when(self, time: float) -> str:
        """Return a time as it is written."""
        return instant(time, "1970-01-01") if self.is_dated else number(time)

    @property
    def span(self) -> tuple[float, float] | None:
        """The first and the last time of the fleet."""
        import numpy as np

        first, last = self.tally["first_time"], self.tally["last_time"]
        if not np.isfinite(first).any():
            return None
        return float(np.nanmin(first)), float(np.nanmax(last))

    @property
    def samples(self) -> int:
        return int(self.tally["samples"].sum())

    @property
    def facts(self) -> list[str]:
        """What there was, in a few words each."""
        found = [f"{shown(len(self.fleet))} series", f"{shown(self.samples)} samples"]
        if self.span:
            found.append(f"{self.when(self.span[0])} to {self.when(self.span[1])}")
        return found + [text for text in (self.model,) if text]

    @property
    def cost(self) -> list[str]:
        """What it took."""
        found = [f"{number(self.fleet.states.nbytes / 1e6, 3)} MB of states"]
        if self.took:
            rate = self.samples / self.took
            speed = f"{number(rate / 1e6, 3)} million" if rate >= 1e5 else number(rate, 3)
            found = [f"took {lasting(self.took)}", f"{speed} samples/s", *found]
        return found + ([f"{number(self.peak / 1e6, 3)} MB of memory at most"] if self.peak else [])


def shown(count: float) -> str:
    """Return a count with thin spaces between thousands, from ten thousand on."""
    return grouped(count, 10_000, "\u202f")


def counted(report: FleetReport) -> list[str]:
    """Return how many there are of each kind, in words."""
    found = []
    for kind, (rows, _) in report.outliers.found.items():
        if len(rows):
            text = COUNTED[kind][len(rows) > 1].format(shown(len(rows)))
            inside = sum(len(burst.rows) for burst in report.outliers.together)
            if kind == "jumped" and inside:
                text += f" ({shown(inside)} of them together)"
            found.append(text)
    return found


def lead(report: FleetReport) -> str:
    """Return the answer in a few sentences, the first of them the headline."""
    many, some = len(report.fleet), len(report.outliers.rows)
    if not some:
        return f"None of the {shown(many)} series stands out. {NOTHING}"
    headline = f"{shown(some)} of {shown(many)} series need{'s' if some == 1 else ''} a look."
    return " ".join([headline, f"{capital('; '.join(counted(report)))}.", *burst_notes(report), *fleet_notes(report)])


def burst_notes(report: FleetReport) -> list[str]:
    """Return a sentence for each time at which many jumped."""
    bursts = report.outliers.together[:3]
    return [burst_words(shown(len(burst.rows)), report.when(burst.start), report.when(burst.end)) for burst in bursts]


def fleet_notes(report: FleetReport) -> list[str]:
    """Return what the whole fleet says of the judgement itself."""
    from driftwise.fleet.outliers import ALARMS

    found, said = report.outliers.found, []
    alarms = ALARMS * report.samples
    if len(found["jumped"].rows) and alarms >= 1 and report.fleet.estimators[0].odds is not None:
        said.append(false_jumps_words(shown(alarms)))
    if report.tally["late"].sum() > MOST_LATE * _rows(report):
        said.append("Most rows are late: is the newest row first? Sort the table by time.")
    differ = len(found["differs"].rows)
    if differ > MIXED * len(report.fleet):
        said.append(
            f"As many as {shown(differ)} differ from the rest: the fleet is hardly of one kind; run each kind apart."
        )
    return said


def starts_anew(report: FleetReport) -> bool:
    """Whether the clock of each series is its own: without dates, all begin at one value and end at many."""
    import numpy as np

    first, last = (report.tally[name][np.isfinite(report.tally[name])] for name in ("first_time", "last_time"))
    if report.is_dated or first.size < 2:
        return False
    span = np.median(last) - np.median(first)
    begin, end = ((np.quantile(times, 0.95) - np.quantile(times, 0.05)) / max(span, 1e-300) for times in (first, last))
    return bool(begin < SAME <= end)


def key_notes(report: FleetReport) -> list[str]:
    """Return a sentence where the key names hardly more than one row."""
    import numpy as np

    rows = float(np.median(report.tally["samples"])) if len(report.fleet) > 1 else FEWEST
    if rows >= FEWEST:
        return []
    return [
        f"most series have {count_of(round(rows), 'row')}, from which nothing can be learnt: is {report.by!r} the "
        "column that names the series, and not the time?"
    ]


def gap_notes(report: FleetReport) -> list[str]:
    """Return a sentence about gaps in the clock that nobody has asked to fill, with the step that most series have."""
    import numpy as np

    if report.dt is not None or not report.tally["gaps"].any():
        return []
    steps = report.tally["step"][np.isfinite(report.tally["step"])]
    usual = float(np.median(steps))
    said = "samples on both sides of a gap in the clock were taken as neighbours"
    if np.mean(np.abs(steps - usual) < 0.1 * usual) < COMMON:
        return [f"{said}, and series differ in their step: run those of one step apart, each with its --dt."]
    return [f"{said}: --dt {number(usual)}, the usual step, makes missing samples of what lies between."]


def _rows(report: FleetReport) -> float:
    """Return the number of rows of all series, those that were filled in included."""
    from driftwise.fleet.counters import UNUSED

    return max(sum(float(report.tally[name].sum()) for name in ("samples", *UNUSED)), 1.0)


def quality(report: FleetReport) -> list[tuple[str, int, float, int]]:
    """Return (what, how many, share of the rows, in how many series) of everything that was wrong with the rows."""
    import numpy as np

    total, found = _rows(report), []
    for name, text in QUALITY.items():
        if name == "gaps" and report.dt is not None:
            continue  # they are filled
        column = report.tally[name]
        if column.any():
            found.append((text, int(column.sum()), float(column.sum() / total), int(np.count_nonzero(column))))
    return found
