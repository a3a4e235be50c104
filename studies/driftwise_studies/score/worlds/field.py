"""The field: memories over many systems, and what it all comes to, whole and by trouble."""

from __future__ import annotations

import os
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from itertools import pairwise
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np

from .drawing import draw
from .entrants import ENTRANTS
from .measured import Measured, measure
from .simulation import records
from .system import ALONE, System
from .told import Told, told

SIZES = (0.0, 1.0, 2.0, 3.0, 5.0, 9.0)  # of jumps, in deviations of the quietest noise
HEAD = (
    "systems", "mean", "median", "95th", "worst", "over the oracle", "bars hold", "after a jump",
    "after one tellable", "once told", "told", "false",
)  # fmt: skip


class Line(NamedTuple):
    """One system: who it is, what the references came to, how far each jump went, what each memory did."""

    system: System
    told: Told
    sizes: np.ndarray  # (S, J), deviations
    found: dict[str, Measured]


class Total(NamedTuple):
    """What a memory came to over many systems."""

    systems: int
    mean: float  # of the ratios, geometric
    median: float
    high: float  # their 95th percentile
    worst: float
    over_oracle: float  # geometric mean of the ratios to the filter that is told the jumps
    inside: float
    after: float
    after_tellable: float
    after_told: float
    told: int  # of the jumps that could be told
    tellable: int
    false: float  # jumps told a record of a system that rests

    @property
    def cells(self) -> list[str]:
        """Return it as the cells of a table, under `HEAD`."""
        share = f"{self.told}/{self.tellable} = {self.told / self.tellable:.2f}" if self.tellable else ""
        numbers = (self.inside, self.after, self.after_tellable, self.after_told)
        return [
            f"{self.systems}",
            *(f"{v:.2f}" for v in (self.mean, self.median, self.high, self.worst, self.over_oracle)),
            *("" if np.isnan(v) else f"{v:.3f}" for v in numbers),
            share,
            "" if np.isnan(self.false) else f"{self.false:.3f}",
        ]


def one(seed: int, number: int, count: int, names: list[str]) -> Line:
    """Draw a system, and run every memory over ``count`` of its records."""
    system = draw(seed, number)
    r = records(system, range(count))
    known = told(system, r)
    found = {}
    for name in names:
        entrant = ENTRANTS[name]
        found[name] = measure(system, r, known, entrant.make(system))
    return Line(system, known, np.abs(r.moved / np.array(system.deviations)).max(axis=2, initial=0.0), found)


def play(seed: int, numbers: Iterable[int], count: int, names: list[str], processes: int | None = 1) -> list[Line]:
    """Return a line for each system; on all cores where ``processes`` is None."""
    numbers, processes = list(numbers), processes or os.cpu_count() or 1
    if processes == 1:
        return [one(seed, number, count, names) for number in numbers]
    with ProcessPoolExecutor(processes, mp_context=get_context("forkserver")) as pool:
        made = [pool.submit(one, seed, number, count, names) for number in numbers]
        return [job.result() for job in made]


def total(lines: list[Line], name: str) -> Total:
    """Return what a memory came to: ratios and bars by system, jumps by jump, false ones by record."""
    found = [line.found[name] for line in lines]
    ratios = np.array([one.ratio for one in found])
    calm = [one.false for one, line in zip(found, lines) if line.system.rests]
    return Total(
        len(lines),
        geometric(ratios),
        float(np.median(ratios)),
        float(np.quantile(ratios, 0.95)),
        float(ratios.max()),
        geometric([one.over_oracle for one in found]),
        mean([one.inside for one in found]),
        mean([one.after for one in found]),
        mean([one.after_tellable for one in found]),
        mean([one.after_told for one in found]),
        int(sum((one.told & line.told.tellable).sum() for one, line in zip(found, lines))),
        int(sum(line.told.tellable.sum() for line in lines)),
        mean(calm),
    )


def geometric(values) -> float:
    """Return the geometric mean."""
    return float(np.exp(np.mean(np.log(values))))


def mean(values) -> float:
    """Return the mean of what is a number, NaN if nothing is."""
    values = np.asarray(values, float)
    values = values[~np.isnan(values)]
    return float(values.mean()) if len(values) else float("nan")


def table(head, rows) -> str:
    """Return a table of Markdown."""
    lines = [list(head), ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def by_trouble(lines: list[Line], name: str) -> str:
    """Return a memory's table: all systems, each trouble alone, all that have it, kinds of plants."""
    groups = [("all", lines)]
    groups += [(f"{trouble}, alone", [x for x in lines if x.system.troubles == (trouble,)]) for trouble in ALONE]
    groups += [(f"with {trouble}", [x for x in lines if trouble in x.system.troubles]) for trouble in ALONE[1:]]
    groups += [("outliers of the process", [x for x in lines if x.system.of_process])]
    groups += [("no outliers", [x for x in lines if "outliers" not in x.system.troubles])]
    groups += [
        ("regressions", [x for x in lines if x.system.na < 0]),
        ("no input", [x for x in lines if x.system.na > 0 and not x.system.nb]),
        ("ARX", [x for x in lines if x.system.na > 0 and x.system.nb]),
    ]
    return table(("", *HEAD), [[words, *total(some, name).cells] for words, some in groups if some])


def by_size(lines: list[Line], name: str) -> str:
    """Return what became of jumps, by their size."""
    rows = []
    for low, high in pairwise(SIZES):
        told, could, every = 0, 0, 0
        for line in lines:
            here = (line.sizes >= low) & (line.sizes < high)
            every += here.sum()
            could += (here & line.told.tellable).sum()
            told += (here & line.told.tellable & line.found[name].told).sum()
        rows.append([f"{low:g} to {high:g}", f"{every}", f"{could}", f"{told}", f"{told / max(could, 1):.2f}"])
    return table(("deviations", "jumps", "the oracle tells", "of these told", "share"), rows)


def worst(lines: list[Line], name: str, count: int = 20) -> str:
    """Return the systems on which a memory is worst, in words."""
    order = sorted(lines, key=lambda line: -line.found[name].ratio)[:count]
    rows = [
        [
            f"{x.found[name].ratio:.2f}",
            x.told.which,
            f"{x.found[name].inside:.2f}",
            f"{x.found[name].false:.2f}",
            f"{x.found[name].steps:.2f}",
            x.system.about,
        ]
        for x in order
    ]
    return table(("ratio", "reference", "bars hold", "false jumps", "noise told", "system"), rows)
