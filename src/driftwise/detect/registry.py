"""Which detectors and gates are public: files of states find them by name, ``--jumps`` by a word."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from ..engine.registry import Registry


class Entry(NamedTuple):
    """A public detector: its settings, its word, what it watches, what SIZE is, and what makes one of (rate, sizes)."""

    kind: type
    word: str
    about: str
    size: str
    is_whole: bool
    is_each: bool
    read: Callable[..., Any]


ENTRIES = Registry("driftwise.detect", "detector")


def register(
    word: str = "",
    about: str = "",
    size: str = "",
    *,
    is_whole: bool = False,
    is_each: bool = False,
    read: Callable[..., Any] | None = None,
) -> Callable[[type], type]:
    """Make a detector or a gate public: a file finds it by its name, the command line by its word.

    Parameters
    ----------
    word : what ``--jumps WORD:RATE,SIZE`` calls it; none, if omitted
    about : what it watches, in a few words
    size : what SIZE is
    is_whole : whether SIZE is a whole number
    is_each : whether there may be a SIZE for each parameter, of whose slopes it is told
    read : what makes it of the rate of false alarms, a text, and SIZE, if given; those in this order, if omitted

    Examples
    --------
    >>> import driftwise as dw
    >>> public = dw.detect.register("streak", "shifts of any distribution")  # above the class, with @
    >>> public.__name__
    'add'
    """

    def add(kind: type) -> type:
        ENTRIES.add(Entry(kind, word, about, size, is_whole, is_each, read or kind))
        return kind

    return add


def by_word() -> dict[str, Entry]:
    """Return the public detectors that have a word, by it."""
    return {entry.word: entry for entry in ENTRIES.public().values() if entry.word}
