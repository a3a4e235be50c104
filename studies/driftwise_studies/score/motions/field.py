"""Many scenes in tables: by trouble, by class, the worst tracks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from .measured import LONG, Followed, Found
from .scene import ALONE, KINDS

HEAD = (
    "", "scenes", "tracks", "NIS in .5 to 1.5", "NIS above 3", "plots in 95 %", "position", "velocity",
    "within manoeuvres", "density", "error", "diverged, of 1000", "in one piece", "mixed", "false onsets, of 1000",
    "told", "delay, scans", "refused of wild",
)  # fmt: skip

MOST_NIS = 3.0  # of a track's mean
RATES = 0.0, 0.1, 1.0, 4.0, 12.0, 60.0, 600.0, np.inf  # s from plot to plot, of the table by rate
RATE_HEAD = (
    "s from plot to plot", "tracks", "NIS above 3", "velocity", "within manoeuvres", "quiet plots",
    "false onsets, of 1000", "told", "delay, s", "of the soonest 70 %", "delay, scans",
)  # fmt: skip
SOONEST = (
    0.7  # of all manoeuvres, told or not: by their median, who tells more than these is not later than who does not
)
SCANS, SOON = (1.0, 4.0), 6.0  # s from plot to plot at which it counts how soon a manoeuvre is told; s that are soon
SHARES = 0.1, 0.25, 0.5, 0.7  # of all manoeuvres, told or not: by when so many are told


class Total:
    """What scenes came to."""

    def __init__(self, found: Sequence[Found]):
        self.found = found
        self.tracks = [t for f in found for t in f.tracks]
        self.long = [t for t in self.tracks if t.plots >= LONG]
        self.nis = np.array([t.nis for t in self.long])
        self.pieces = np.array([n for f in found for n in f.pieces])
        self.mixed = sum(f.mixed for f in found)
        self.wild, self.refused = sum(f.wild for f in found), sum(f.refused for f in found)
        self.quiet, self.false = sum(t.quiet for t in self.tracks), sum(t.false for t in self.tracks)
        self.delays = np.array([d / t.scan for t in self.tracks for d in t.delays])
        self.diverged = sum(t.diverged > 0 for t in self.tracks)

    @property
    def good(self) -> float:
        """Share of long tracks whose mean NIS is in .5 to 1.5."""
        return mean((self.nis >= 0.5) & (self.nis <= 1.5))

    @property
    def sober(self) -> float:
        """Share of long tracks whose mean NIS is not above 3."""
        return mean(self.nis <= MOST_NIS)

    @property
    def calibrated(self) -> float:
        """Share of long tracks whose mean squared normal score is in .5 to 1.5: the same, whatever the tails."""
        scores = np.array([t.normal for t in self.long])
        return mean((scores >= 0.5) & (scores <= 1.5))

    @property
    def told(self) -> float:
        """Share of the manoeuvres that could be told that were."""
        return mean(np.isfinite(self.delays))

    @property
    def delay(self) -> float:
        """Median delay of those told, scans."""
        return float(np.median(self.delays[np.isfinite(self.delays)])) if np.isfinite(self.delays).any() else np.nan

    @property
    def seconds(self) -> np.ndarray:
        """Delays, s, of all manoeuvres where plots are a few seconds apart; infinite where none was told."""
        return np.array([d for t in self.tracks if SCANS[0] <= t.scan < SCANS[1] for d in t.delays])

    @property
    def soon(self) -> float:
        """Share of these that are told soon: who tells seven of ten, half of them within ``SOON``, has .35."""
        return mean(self.seconds <= SOON)

    @property
    def false_rate(self) -> float:
        """Onsets of 1000 quiet plots."""
        return 1000 * self.false / max(self.quiet, 1)

    @property
    def whole(self) -> float:
        """Share of objects that are one track."""
        return mean(self.pieces == 1)

    @property
    def lost(self) -> float:
        """Tracks that diverged, of 1000."""
        return 1000 * self.diverged / max(len(self.tracks), 1)

    def held(self, what: str) -> float:
        """Return the share in 95 % bands of ``position``, ``velocity``, ``turning``, each plot the same weight."""
        pairs = np.array([getattr(t, what) for t in self.tracks]).reshape(-1, 2)
        used = pairs[:, 1] > 0
        return float(np.average(pairs[used, 0], weights=pairs[used, 1])) if used.any() else np.nan

    def row(self, name: str) -> list[str]:
        """Return the cells of a table's row."""
        return [
            name, f"{len(self.found)}", f"{len(self.tracks)}", number(self.good), number(1.0 - self.sober),
            number(mean([t.plot_share for t in self.tracks])), number(self.held("position")),
            number(self.held("velocity")), number(self.held("turning")),
            number(mean([t.density for t in self.tracks]), 2),
            number(float(np.median([t.error for t in self.tracks])) if self.tracks else np.nan, 2),
            number(self.lost, 1), number(self.whole), f"{self.mixed}", number(self.false_rate, 2),
            f"{number(self.told, 2)} of {len(self.delays)}", number(self.delay, 1), f"{self.refused}/{self.wild}",
        ]  # fmt: skip


def number(value: float, digits: int = 3) -> str:
    """Return a cell; nothing where nothing is known."""
    return "" if np.isnan(value) else f"{value:.{digits}f}"


def mean(values) -> float:
    """Return the mean of what is finite; NaN where there is nothing."""
    values = np.asarray(values, float)
    values = values[np.isfinite(values)]
    return float(values.mean()) if values.size else np.nan


def table(rows: list[list[str]], head: Sequence[str] = HEAD) -> str:
    """Return rows as a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(cells) + " |\n" for cells in lines)


def by_trouble(found: list[Found]) -> str:
    """Return the table of each trouble, alone and with others."""
    rows = [Total(found).row("all")]
    for name in ALONE:
        alone = [f for f in found if f.scene.troubles == ((name,) if name != "nothing" else ())]
        rows += [Total(alone).row(f"{name}, alone")] if alone else []
    for name in ALONE[1:]:
        some = [f for f in found if name in f.scene.troubles and len(f.scene.troubles) > 1]
        rows += [Total(some).row(f"with {name}")] if some else []
    return table(rows)


def of_kinds(found: list[Any]) -> dict[str, list[Any]]:
    """Return what was found of the scenes of each class, by its name."""
    return {name: [f for f in found if f.scene.name == name] for name in KINDS}


def by_kind(found: list[Found], has_all: bool = False) -> str:
    """Return the table of each class of objects, after a row of all if so asked."""
    parts = ({"all": found} if has_all else {}) | of_kinds(found)
    return table([Total(some).row(name) for name, some in parts.items() if some])


def by_rate(found: list[Found]) -> str:
    """Return the table of tracks by how long it is from plot to plot."""
    rows = []
    for least, most in pairwise(RATES):
        some = Total([f._replace(tracks=tuple(t for t in f.tracks if least <= t.scan < most)) for f in found])
        delays = np.array([d for t in some.tracks for d in t.delays if np.isfinite(d)])
        rows += [[
            f"{least:g} to {most:g}", f"{len(some.tracks)}", number(1.0 - some.sober), number(some.held("velocity")),
            number(some.held("turning")), f"{some.quiet}", number(some.false_rate, 2),
            f"{number(some.told, 2)} of {len(some.delays)}",
            number(float(np.median(delays)) if len(delays) else np.nan, 1), number(soonest(some), 1),
            number(some.delay, 1),
        ]] if some.tracks else []  # fmt: skip
    return table(rows, RATE_HEAD)


def told_by(delays: np.ndarray) -> list[str]:
    """Return the cells that say how soon manoeuvres are told: the share of all that is soon, by when which share is."""
    by = np.quantile(delays, SHARES, method="lower") if len(delays) else np.full(len(SHARES), np.nan)
    return [number(mean(delays <= SOON), 2), *(number(float(s), 1) for s in by)]


def soonest(some: Total) -> float:
    """Return the median delay, s, of the soonest of all manoeuvres; infinite where fewer are told."""
    delays = np.sort([d for t in some.tracks for d in t.delays])
    return float(delays[int(SOONEST / 2 * len(delays))]) if len(delays) else np.nan


BAD: dict[str, Callable[[Followed], float]] = {
    "NIS": lambda t: t.nis if t.plots >= LONG else 0.0,
    "error, deviations": lambda t: t.worst,
    "false onsets": lambda t: t.false,
    "velocity out of its band": lambda t: (1 - t.velocity[0]) * (t.plots >= LONG),
}


def worst(found: list[Found], most: int) -> str:
    """Name the worst tracks by each measure."""
    tracks, lines = [t for f in found for t in f.tracks], []
    for name, of in BAD.items():
        lines.append(f"worst {name}:")
        lines += [f"  {of(t):10.3g}  {t.scene}" for t in sorted(tracks, key=lambda t: -np.nan_to_num(of(t)))[:most]]
    lines.append("in pieces:")
    broken = sorted((f for f in found if max(f.pieces) > 1 or min(f.pieces) < 1), key=lambda f: -max(f.pieces))
    return "\n".join(lines + [f"  {f.pieces}  {f.scene}" for f in broken[:most]])
