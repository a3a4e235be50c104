"""Rank every memory on the choosing systems, and say which win nowhere.

Run: python -m driftwise_studies.score.worlds.ranking

The tables go between the markers of docs/worlds.md. Options: --systems 300 --records 6 --processes 1 --only NAME
"""

from __future__ import annotations

import argparse

import numpy as np

from .entrants import ENTRANTS
from .field import Line, geometric, mean, play, table, total
from .judged import CHOOSING, write
from .system import ALONE

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


def best_of_each(lines: list[Line], names) -> np.ndarray:
    """Return the ratio of each family (columns) on each system, with the best of its numbers there."""
    groups = families(names).values()
    return np.array([[min(line.found[name].ratio for name in some) for some in groups] for line in lines])


def winners(ratios) -> tuple[np.ndarray, np.ndarray]:
    """Return who is best on each system, and who is so clearly."""
    order = np.sort(ratios, axis=1)
    is_best = ratios == order[:, :1]
    return is_best, is_best & (order[:, 1:2] > CLEARLY * order[:, :1])


def wins(lines: list[Line], names) -> str:
    """Return where each family wins."""
    groups, ratios = families(names), best_of_each(lines, names)
    (is_best, is_clear), first = winners(ratios), ratios.min(axis=1)
    kings: dict[str, list[str]] = {}
    for trouble in ALONE:
        if some := [line for line in lines if line.system.troubles == (trouble,)]:
            means = {name: geometric([line.found[name].ratio for line in some]) for name in names}
            kings.setdefault(ENTRANTS[min(means, key=lambda name: means[name])].family, []).append(trouble)
    rows = [
        [
            family,
            f"`{best(lines, some)}`",
            f"{geometric(ratios[:, i]):.2f}",
            f"{is_best[:, i].sum()}",
            f"{is_clear[:, i].sum()}",
            f"{(ratios[:, i] < 1.05 * first).sum()}",
            ", ".join(kings.get(family, [])),
        ]
        for i, (family, some) in enumerate(groups.items())
    ]
    head = ("family", "best setting", "mean, best for each", "wins", "by 2 % and more", "within 5 %", "best alone at")
    return table(head, sorted(rows, key=lambda row: -int(row[3])))


def nowhere(lines: list[Line], names) -> str:
    """Return, in words, who wins nowhere."""
    counts = [won.sum(axis=0) for won in winners(best_of_each(lines, names))]
    each = list(zip(families(names), *counts))
    never = ", ".join(f"`{family}`" for family, won, _ in each if not won)
    hardly = ", ".join(f"`{family}`" for family, won, clear in each if won and not clear)
    return f"On no system the best: {never or 'none'}. Nowhere by 2 % and more: {hardly or 'none'}.\n"


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
    parts = [said, ranks(lines, names), wins(lines, names), nowhere(lines, names), alone(lines, names)]
    print("\n\n".join(parts))
    if asked.page:
        write("ranking", "\n".join(parts))


if __name__ == "__main__":
    main()
