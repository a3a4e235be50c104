"""Many records: what of them met, in tables by plant."""

from __future__ import annotations

import numpy as np

from .measured import Found

CONVERGED = 2.0  # log posterior below the batch fit's
INFORMATIVE = 0.1  # Cramer-Rao bound of a logarithm below which a record tells a parameter
BAR = 1.959963984540054


class Total:
    """Sums over records."""

    def __init__(self, found: list[Found]):
        self.records = len(found)
        self.converged = average([f.gap <= CONVERGED for f in found])
        told = [f.bound <= INFORMATIVE for f in found]
        self.informative = average(np.concatenate(told)) if found else np.nan
        self.error = rms([f.error[t] for f, t in zip(found, told)])
        self.batch_error = rms([f.batch_error[t] for f, t in zip(found, told)])
        self.held = average(np.concatenate([np.abs(f.bar) < BAR for f in found]))
        tellable = [f for f in found if f.is_tellable]
        self.tellable = len(tellable)
        self.alarmed = average([f.is_found for f in tellable])
        self.named = average([f.is_named for f in tellable])
        self.dated = average([f.is_dated for f in tellable])
        self.alone = average([f.is_dated and not f.others for f in tellable])
        self.false = average([f.false for f in found])


def average(values) -> float:
    """Return the mean; NaN of nothing."""
    return float(np.mean(values)) if len(values) else np.nan


def rms(parts) -> float:
    """Return the root of the mean square, each number at most 10."""
    every = np.concatenate(parts) if parts else np.zeros(0)
    return float(np.sqrt(np.mean(np.minimum(np.abs(every), 10.0) ** 2))) if every.size else np.nan


HEAD = (
    "", "records", "converged", "informative", "error / bound", "the batch's", "bars hold", "jumps tellable", "found",
    "named", "and dated", "and no other", "false",
)  # fmt: skip


def by_plant(found: list[Found]) -> str:
    """Return the table of all, and of each plant."""
    groups = [("all", found)] + [(n, [f for f in found if f.name == n]) for n in dict.fromkeys(f.name for f in found)]
    lines = [f"| {' | '.join(HEAD)} |", f"| {' | '.join(['---'] * len(HEAD))} |"]
    for name, some in groups:
        t = Total(some)
        cells = [
            name, str(t.records), f"{t.converged:.3f}", f"{t.informative:.2f}", f"{t.error:.3f}",
            f"{t.batch_error:.3f}", f"{t.held:.3f}", str(t.tellable),
            *(f"{share:.2f}" for share in (t.alarmed, t.named, t.dated, t.alone)), f"{t.false:.3f}",
        ]  # fmt: skip
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def worst(found: list[Found], count: int) -> str:
    """Return the records that did worst, a line each."""
    lines = []
    for f in sorted(found, key=lambda f: -f.gap)[:count]:
        lines.append(f"{f.name} {f.number}: log posterior {f.gap:.2f} below, errors over the bound {f.error.round(1)}")
    for f in [f for f in found if f.is_tellable and not f.is_dated][:count]:
        lines.append(f"{f.name} {f.number}: jump of parameter {f.jumped} at {f.at:.4g} s, told: {f.words or 'nothing'}")
    return "\n".join(lines)
