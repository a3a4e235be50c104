"""The panels of one track over time, and how another track is put into them."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from driftwise.models.quantities import NORMAL_95
from driftwise.report.axes import Timeline, across, legend, shade
from driftwise.report.figure import LINES, PALETTE, steady_range
from driftwise.report.plots import edges, limits
from driftwise.report.thin import together
from driftwise.report.track_report import clock

ROWS = 16_000  # drawn of all tracks together
CROWD = 1500  # rows from which dots are drawn smaller
RUN = 25  # plots in the running mean of the NIS
LIMITS = (0.647, 1.428)  # 95 % of chi-square with 2 RUN degrees of freedom, over these
ALTITUDE, SPEED, TURN, PROBABILITY, EAST, NORTH, NIS = (
    "altitude", "speed", "turn", "manoeuvre", "east", "north", "nis"
)  # fmt: skip

CHOOSE = """
const which = document.getElementById('which'), k = cb_obj.indices[0]
if (k === undefined || k >= sources.length) { // an empty place, or a track that has no panels
  if (cb_obj.indices.length !== 1 || k >= sources.length) cb_obj.indices = [Number(which.value)]
  return
}
which.value = k
shown.data = {...sources[k].data}
for (const [i, range] of ranges.entries()) {
  const [start, end] = spans[k][i]
  range.setv({start, end, reset_start: start, reset_end: end})
}
"""


class Panels:
    """Panels over one time axis that show the first of several tracks, and can show each of them.

    Parameters
    ----------
    rows : list of `track_report.Row`
        The tracks to choose from.
    """

    def __init__(self, rows):
        import numpy as np

        self.rows = rows
        most = max(ROWS // len(rows), 400)
        parts = [_columns(r.track, most) for r in rows]
        start = rows[0].start
        self.origin = 0.0 if clock(start) else start
        time = np.concatenate([part["t"] for part in parts])
        label = "time (s)"
        self.line = Timeline(time, label, clock(start), np.concatenate([part["k"] for part in parts]))
        ends = np.cumsum([0, *(len(part["t"]) for part in parts)])
        columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0] if name not in "tk"}
        self.sources = [self.line.source(np.arange(a, b), **columns) for a, b in pairwise(ends)]
        self.shown = self.line.source(np.arange(ends[1]), **columns)
        self.spans = [self._span(part) for part in parts]
        self.is_thinned = any(len(part["t"]) < len(r.track.trace.time) for part, r in zip(parts, rows))
        self.is_crowded = max(len(part["t"]) for part in parts) > CROWD
        self.has_altitude = any(np.isfinite(part[ALTITUDE]).any() for part in parts)
        first = self.spans[0]
        self.line.range.update(start=first[0][0], end=first[0][1])
        self.figures = list(self._draw())

    def link(self, source) -> None:
        """Let the selection of a source with one row for each track choose the track."""
        from bokeh.models import CustomJS

        ranges = [self.line.range, *(self._range[name] for name in self.spanned)]
        args = {"sources": self.sources, "shown": self.shown, "spans": self.spans, "ranges": ranges}
        source.selected.js_on_change("indices", CustomJS(args=args, code=CHOOSE))

    # what is drawn

    spanned = (ALTITUDE, SPEED, TURN, EAST, NORTH, NIS)

    def _draw(self):
        first = dict(zip(self.spanned, self.spans[0][1:]))
        self._range = {name: _range(first[name]) for name in self.spanned}
        if self.has_altitude:
            yield self._curve(ALTITUDE, "altitude (m)", LINES[5])
        yield self._curve(SPEED, "speed (m/s)", LINES[0])
        fig = self._curve(TURN, "turn rate (°/s)", LINES[2])
        across(fig, 0)
        yield fig
        yield self._probability()
        for name, axis in ((EAST, "east"), (NORTH, "north")):
            yield self._innovation(name, axis)
        yield self._nis()

    def _panel(self, name: str, label: str, *, is_named: bool = False):
        y_range = self._range.get(name) or _range((0.0, 1.04))
        fig = self.line.figure(178 if is_named else 126, label, is_named=is_named, y_range=y_range, name=name)
        fig.yaxis.ticker.desired_num_ticks = 4
        fig.xaxis.visible = is_named  # the last panel has the times of all
        return fig

    def _curve(self, name: str, label: str, colour: str):
        fig = self._panel(name, label)
        tips = [(label, name)]
        if name != ALTITUDE:
            fig.varea("t", f"{name}_low", f"{name}_high", source=self.shown, color=colour, alpha=0.22)
            tips += [("from", f"{name}_low"), ("to", f"{name}_high")]
        drawn = fig.line("t", name, source=self.shown, color=colour, width=1.8)
        self.line.hover(fig, [drawn], *tips)
        return fig

    def _probability(self):
        fig = self._panel(PROBABILITY, "manoeuvre")
        fig.varea("t", "zero", PROBABILITY, source=self.shown, color=PALETTE["alert"], alpha=0.22)
        drawn = fig.line("t", PROBABILITY, source=self.shown, color=PALETTE["alert"], width=1.6)
        fig.scatter(
            "t", "onset", source=self.shown, marker="inverted_triangle", size=10, color=PALETTE["alert"],
            line_color="#ffffff",
        )  # fmt: skip
        fig.yaxis.ticker = [0, 0.5, 1]
        self.line.hover(fig, [drawn], ("probability", PROBABILITY))
        return fig

    def _innovation(self, name: str, axis: str):
        fig = self._panel(name, f"{axis} (m)")
        fig.varea("t", f"{name}_low", f"{name}_high", source=self.shown, color=PALETTE["predicted"], alpha=0.16)
        look = {"size": 2.5, "alpha": 0.4} if self.is_crowded else {"size": 3.5, "alpha": 0.75}
        drawn = fig.scatter("t", name, source=self.shown, color=PALETTE["ink"], **look)
        tips = (f"{axis} innovation", name), ("from", f"{name}_low"), ("to", f"{name}_high")
        self.line.hover(fig, [drawn], *tips)
        return fig

    def _nis(self):
        fig = self._panel(NIS, "NIS", is_named=True)
        shade(fig, *LIMITS)
        across(fig, 1)
        dots = fig.scatter("t", "nis_one", source=self.shown, size=3, color=PALETTE["quiet"], alpha=0.6)
        drawn = fig.line("t", NIS, source=self.shown, color=LINES[3], width=2)
        self.line.hover(fig, [drawn], (f"mean of {RUN}", NIS), ("of this plot", "nis_one"))
        legend(fig, [(f"mean of {RUN} plots", [drawn]), ("each plot", [dots])])
        return fig

    def _span(self, part):
        """Return what the axes of a track reach over: time first, then those of `spanned`."""
        import numpy as np

        t = self.line.at(part["t"])
        found = [(float(t[0]), float(t[-1]) if t[-1] > t[0] else float(t[0]) + 1.0)]
        altitude = part[ALTITUDE][np.isfinite(part[ALTITUDE])]
        found.append(limits(altitude))
        for name in (SPEED, TURN):
            width = (part[f"{name}_high"] - part[f"{name}_low"]) / 4
            found.append(steady_range(part[name], width) or (0.0, 1.0))
        for name in (EAST, NORTH):
            size = np.abs(part[name][np.isfinite(part[name])])
            wide = 1.25 * float(np.quantile(part[f"{name}_high"][len(t) // 20 + 1 :], 0.98)) if len(t) > 1 else 0.0
            top = max(1.1 * float(np.quantile(size, 0.99)), wide) if len(size) else wide
            found.append((-top, top) if top > 0 else (-1.0, 1.0))
        running = part[NIS][np.isfinite(part[NIS])]
        found.append((0.0, max(2.5, 1.15 * float(np.quantile(running, 0.98)) if len(running) else 0.0)))
        return [tuple(map(float, pair)) for pair in found]


def _range(span) -> Any:
    from bokeh.models import Range1d

    return Range1d(start=span[0], end=span[1])


def running_mean(values, width: int):
    """Return the mean of the last ``width`` values that are there, NaN until so many came."""
    import numpy as np

    from driftwise.engine.holding import held

    found, seen = np.full(len(values), np.nan), np.flatnonzero(np.isfinite(values))
    if len(seen) >= width:
        total = np.cumsum(np.concatenate(([0.0], values[seen])))
        found[seen[width - 1 :]] = (total[width:] - total[:-width]) / width
    return held(found)  # a scan that was missed leaves it as it is


def _columns(track, most: int) -> dict:
    """Return what the panels show of a track, in at most about so many rows."""
    import numpy as np

    trace = track.trace
    time, speed, rate, half = np.asarray(trace.time, float), trace.speed, np.degrees(trace.turn_rate), trace.band(0.95)
    found = {
        "t": time, "k": np.arange(len(time)), ALTITUDE: np.asarray(track.altitude, float),
        SPEED: speed, TURN: rate, PROBABILITY: trace.manoeuvre,
        EAST: trace.innovation[:, 0], NORTH: trace.innovation[:, 1],
        NIS: running_mean(trace.nis, RUN), "nis_one": trace.nis, "zero": np.zeros(len(time)),
        "onset": np.where(trace.onset, 0.96, np.nan),
    }  # fmt: skip
    for name, middle, width in (
        (SPEED, speed, NORMAL_95 * trace.speed_sd), (TURN, rate, NORMAL_95 * np.degrees(trace.turn_rate_sd)),
        (EAST, 0 * time, half[:, 0]), (NORTH, 0 * time, half[:, 1]),
    ):  # fmt: skip
        found[f"{name}_low"], found[f"{name}_high"] = edges(middle, width)
    i = together(most, *(found[name] for name in (ALTITUDE, SPEED, TURN, PROBABILITY, EAST, NORTH)))
    i = np.union1d(i, np.flatnonzero(trace.onset)[:200])
    return {name: np.asarray(column)[i] for name, column in found.items()}
