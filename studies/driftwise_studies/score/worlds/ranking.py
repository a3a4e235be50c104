"""Rank every memory on the choosing systems, and say which win nowhere.

Run: python -m driftwise_studies.score.worlds.ranking

The tables go between the markers of docs/worlds.md. Options: --systems 300 --records 6 --processes 1 --only NAME
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from .entrants import AUTO, ENTRANTS
from .field import Line, by_size, by_trouble, geometric, mean, play, table, total
from .judged import ROOT
from .system import ALONE

CHOOSING = 0
PAGE = ROOT / "docs" / "worlds.md"
BEGIN, END = "<!-- worlds: begin -->", "<!-- worlds: end -->"
CLEARLY = 1.02  # a win that is no luck of the draw


def families(names) -> dict[str, list[str]]:
    """Return the entrants of each family."""
    found: dict[str, list[str]] = {}
    for name in names:
        found.setdefault(ENTRANTS[name].family, []).append(name)
    return found


def best(lines: list[Line], names: list[str]) -> str:
    """Return the entrant of a family with the smallest mean ratio."""
    return min(names, key=lambda name: geometric([line.found[name].ratio for line in lines]))


def ranks(lines: list[Line], names) -> str:
    """Return the memories by the mean of their ratios."""
    made = [(total(lines, name), name) for name in names]
    rows = []
    for found, name in sorted(made, key=lambda each: each[0].mean):
        share = found.told / found.tellable if found.tellable else 0.0
        ns = np.median([line.found[name].ns for line in lines])
        rows.append([
            f"`{name}`", f"{found.mean:.2f}", f"{found.median:.2f}", f"{found.high:.1f}", f"{found.worst:.0f}",
            f"{found.inside:.2f}", f"{found.after:.2f}", f"{share:.2f}", f"{found.false:.2f}", f"{ns:.0f}",
        ])  # fmt: skip
    head = ("memory", "mean", "median", "95th", "worst", "bars hold", "after a jump", "told", "false", "ns")
    return table(head, rows)


def wins(lines: list[Line], names) -> str:
    """Return where each family wins, with the best of its numbers on every system."""
    groups = families(names)
    ratios = np.array([[min(line.found[name].ratio for name in some) for some in groups.values()] for line in lines])
    order = np.sort(ratios, axis=1)
    first, second = order[:, :1], order[:, 1:2]
    is_best, is_clear = ratios == first, (ratios == first) & (second > CLEARLY * first)
    single = {name: [x for x in lines if x.system.troubles == (name,)] for name in ALONE}
    kings: dict[str, list[str]] = {}
    for trouble, some in single.items():
        if some:
            means = {name: geometric([x.found[name].ratio for x in some]) for name in names}
            king = ENTRANTS[min(means, key=lambda name: means[name])].family
            kings.setdefault(king, []).append(trouble)
    rows = [
        [
            family,
            f"`{best(lines, some)}`",
            f"{geometric(ratios[:, i]):.2f}",
            f"{is_best[:, i].sum()}",
            f"{is_clear[:, i].sum()}",
            f"{(ratios[:, i] < 1.05 * first[:, 0]).sum()}",
            ", ".join(kings.get(family, [])),
        ]
        for i, (family, some) in enumerate(groups.items())
    ]
    head = ("family", "best setting", "mean, best for each", "wins", "by 2 % and more", "within 5 %", "best alone at")
    return table(head, sorted(rows, key=lambda row: -int(row[3])))


def alone(lines: list[Line], names) -> str:
    """Return the mean ratio of each family's best setting, by the trouble that is alone."""
    there = [t for t in ALONE if any(x.system.troubles == (t,) for x in lines)]
    rows = []
    for some in families(names).values():
        name = best(lines, some)
        values = [geometric([x.found[name].ratio for x in lines if x.system.troubles == (t,)]) for t in there]
        rows.append((mean(np.log(values)), [f"`{name}`", *(f"{v:.2f}" for v in values)]))
    return table(("memory", *there), [row for _, row in sorted(rows)])


def main(arguments=None) -> None:
    """Run, print, and write the page where everything was run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--systems", type=int, default=300)
    parser.add_argument("--records", type=int, default=6)
    parser.add_argument("--processes", type=int, default=1, help="0: all cores")
    parser.add_argument("--only", default="", help="only entrants with this in their name")
    parser.add_argument("--page", action="store_true", help="write docs/worlds.md")
    asked = parser.parse_args(arguments)
    names = [name for name in ENTRANTS if asked.only in name]
    lines = play(CHOOSING, range(asked.systems), asked.records, names, asked.processes or None)
    said = f"Seed {CHOOSING}, {asked.systems} systems, {asked.records} records of each."
    parts = [said, ranks(lines, names), wins(lines, names), alone(lines, names)]
    if AUTO in names:
        parts += [f"`{AUTO}` by trouble:", by_trouble(lines, AUTO), by_size(lines, AUTO)]
    print("\n".join(parts))
    if asked.page:
        write("\n".join(parts), PAGE)


def write(text: str, page: Path) -> None:
    """Put the tables between the markers of a page."""
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    page.write_text(f"{before}{BEGIN}\n{text.rstrip()}\n{END}{rest.split(END)[1]}", encoding="utf-8")


if __name__ == "__main__":
    main()
