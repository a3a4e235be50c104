"""Which memories are public: files of states find them by name, ``--memory`` by a word."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from ..engine.registry import Registry


class Entry(NamedTuple):
    """A public memory: its settings, how the command line writes it, what it is for, what makes one of `Words`.

    ``example`` are settings with which it is tried on short records.
    """

    kind: Any
    forms: tuple[str, ...]
    about: str
    read: Callable[[Any], Any]
    example: dict[str, Any]


ENTRIES = Registry("driftwise.memory", "memory")


def register(
    *forms: str, about: str = "", read: Callable[[Any], Any] | None = None, **example: Any
) -> Callable[[type], type]:
    """Make a memory public: a file finds it by its name, the command line by its word.

    Parameters
    ----------
    *forms : how ``--memory`` writes it, as "window:T" or "restart", "restart:STEP"
    about : what it is, in a few words
    read : what makes it of the `Words` behind the colon; one number, if omitted
    **example : settings with which it is tried with every model, on short records, where those it has do not serve

    Examples
    --------
    >>> import driftwise as dw
    >>> public = dw.memory.register("restless:Q", about="a walk that hurries", q=1e-4)  # above the class, with @
    >>> public.__name__
    'add'
    """

    def add(kind: type) -> type:
        ENTRIES.add(Entry(kind, forms, about, read or (lambda words: kind(words.number())), example))
        return kind

    return add


def public() -> dict[str, Entry]:
    """Return all public memories by the names of their classes, driftwise's own and those that users registered."""
    return ENTRIES.public()
