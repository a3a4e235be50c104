"""Eight series in one processor register: the words of kernels that know of it.

A kernel translated for views of lanes in place of views of floats is the same source and does the same operations in
the same order, on eight series at once. Where a short way only gives numbers to variables and places, each lane keeps
what its own way gives. Where lanes disagree about any other branch it goes the way of "no" and counts a disagreement:
whoever runs it looks at `disagreements` before and after, and takes those samples one series at a time.
The same holds of a `rare` kernel that works on views: lanes do not go there at all.
"""

from __future__ import annotations

LANES = 8


def interleave(flat):
    """Return the view (m,) of lanes of 8 m numbers (translated code only)."""
    raise NotImplementedError


def own(count):
    """Return a view of so many lanes that nothing else sees, and registers may hold (translated code only)."""
    raise NotImplementedError


def finite(value) -> bool:
    """Say whether the numbers of all lanes are finite (translated code only)."""
    raise NotImplementedError


def gather(table, places, column):
    """Return the lanes that stand in one column of a table, each in its own row (translated code only)."""
    raise NotImplementedError


def collect(table, places, lanes):
    """Fill lanes with the rows of a table: each lane with the row that it has a place in (translated code only)."""
    raise NotImplementedError


def scatter(lanes, table, places):
    """Write lanes into the rows of a table, from the first column on (translated code only)."""
    raise NotImplementedError


def disagreements() -> int:
    """Return how often lanes have disagreed in this call (translated code only)."""
    raise NotImplementedError


WORDS = interleave, own, gather, collect, scatter, finite, disagreements
