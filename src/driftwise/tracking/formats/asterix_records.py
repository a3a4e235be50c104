"""ASTERIX by its structure: blocks, records and where each item of a record begins.

How long every item is, in every edition, stands in ``data/asterix.txt`` (made by ``scripts/asterix_table.py``, which
explains the notation). Nothing here knows what an item means. The rules are those of the strict decoder of libasterix
and two more: a record has at least one item, and a block at least one record.
"""

from __future__ import annotations

import re
from functools import cache
from importlib.resources import files
from typing import NamedTuple

from ...engine.errors import InputError


class Malformed(ValueError):
    """The bytes do not have the structure they should; the offset is where that shows."""

    def __init__(self, offset, what, blocks=()):
        super().__init__(what)
        self.offset, self.blocks = offset, list(blocks)


class List(NamedTuple):
    """Places a field specification speaks of: a record, or a compound item."""

    longest: int  # bytes of field specification
    places: tuple  # (name, shape), None where spare
    plans: dict  # field specification -> the places present; filled as they are met


class Extended(NamedTuple):
    groups: tuple  # bytes of each
    last: bool  # the last group ends with an extension bit, too


class Repeated(NamedTuple):
    counted: int  # bytes of the count; 0: the last bit says whether another follows
    size: int


EXPLICIT, RANDOM = "explicit", "random"  # length in the first byte; items in random order
PLANS = 4096  # field specifications remembered for a list: far more than one radar uses


def _shape(text, parts=()):
    kind, rest = text[0], text[1:]
    if kind.isdigit():
        return int(text)
    if kind == "x":
        return Extended(tuple(map(int, rest.rstrip(".").split(","))), not rest.endswith("."))
    if kind == "f":
        return Repeated(0, int(rest))
    if kind == "r":
        return Repeated(*map(int, rest.split("*")))
    return EXPLICIT if kind == "e" else List(int(rest), parts, {})


def _places(words):
    """Return the places named by an iterator of words, up to a closing bracket."""
    out = []
    for word in words:
        if word == ")":
            break
        if word in ("-", "RFS"):
            out.append(("RFS", RANDOM) if word == "RFS" else None)
        else:
            name, text = word.split(":")
            out.append((name, _shape(text, _places(words) if text[0] == "c" else ())))
    return tuple(out)


@cache
def table() -> dict[int, dict[str, dict[str, List]]]:
    """Return category -> edition, oldest first -> name of a list (``-`` where there is one) -> the list."""
    out: dict[int, dict[str, dict[str, List]]] = {}
    for line in (files("driftwise") / "data" / "asterix.txt").read_text().splitlines():
        category, edition, name, longest, items = line.split(" ", 4)
        places = _places(iter(re.sub(r"([()])", r" \1 ", items).replace(" ( ", " ").split()))
        out.setdefault(int(category), {}).setdefault(edition, {})[name] = List(int(longest), places, {})
    return out


def lists(editions=None) -> dict[int, dict[str, List]]:
    """Return category -> its lists of items in the editions asked for, the newest where none is."""
    out = {category: known[list(known)[-1]] for category, known in table().items()}
    for category, edition in (editions or {}).items():
        if category not in table():
            raise InputError(f"editions names category {category!r}; those read are {', '.join(map(str, table()))}")
        known = table()[category]
        if str(edition) not in known:
            raise InputError(f"editions: category {category} has editions {', '.join(known)}; got {edition!r}")
        out[category] = known[str(edition)]
    return out


def _plan(spec, b, i, end):
    """Return the places a field specification at ``i`` says are present, and where the items begin."""
    j = i
    while j < end and b[j] & 1:
        j += 1
    if j >= end:
        raise Malformed(i, "the field specification runs past the end")
    fspec = bytes(b[i : j + 1])
    plan = spec.plans.get(fspec)
    if plan is None:
        if len(fspec) > spec.longest:
            raise Malformed(i, f"a field specification of {len(fspec)} bytes, at most {spec.longest} are defined")
        flags = [byte >> bit & 1 for byte in fspec for bit in range(7, 0, -1)]
        plan = [spec.places[k] if k < len(spec.places) else None for k, flag in enumerate(flags) if flag]
        if None in plan:
            raise Malformed(i, "the field specification announces an item that is not defined")
        if len(spec.plans) >= PLANS:
            spec.plans.clear()
        spec.plans[fspec] = plan
    return plan, j + 1


def _items(spec, plan, b, i, end, found):
    """Write where each item of a plan begins into ``found``; return where they end."""
    for name, shape in plan:
        if found is not None:
            found[name] = i
        i = i + shape if type(shape) is int else _after(spec, name, shape, b, i, end)
        if i > end:
            raise Malformed(end, f"item {name} runs past the end of its block")
    return i


def _after(spec, name, shape, b, i, end):
    """Return where an item of variable length ends."""
    start = i
    try:
        if isinstance(shape, Extended):
            for k, size in enumerate(shape.groups):
                i += size
                follows = k + 1 < len(shape.groups) or shape.last
                if i > end or not follows or not b[i - 1] & 1:
                    return i
            raise Malformed(start, f"item {name} is longer than its {len(shape.groups)} parts")
        if isinstance(shape, Repeated):
            if shape.counted:
                return i + shape.counted + shape.size * int.from_bytes(b[i : i + shape.counted], "big")
            i += shape.size
            while i <= end and b[i - 1] & 1:
                i += shape.size
            return i
        if isinstance(shape, List):
            plan, i = _plan(shape, b, i, end)
            return _items(shape, plan, b, i, end, None)
        if shape is EXPLICIT:
            if b[i] == 0:
                raise Malformed(i, f"item {name} says it has no bytes, not even the one that says so")
            return i + b[i]
        count, i = b[i], i + 1
        for _ in range(count):
            place = spec.places[b[i] - 1] if 0 < b[i] <= len(spec.places) else None
            if place is None or place[1] is RANDOM:
                raise Malformed(i, f"item {name} announces an item that is not defined")
            i = _items(spec, (place,), b, i + 1, end, None)
        return i
    except IndexError:
        raise Malformed(end, f"item {name} runs past the end of its block") from None


def parts(spec, name, b, i, end) -> dict[str, int]:
    """Return where each part of the compound item ``name`` at ``i`` begins."""
    shape = next(place[1] for place in spec.places if place and place[0] == name)
    plan, i = _plan(shape, b, i, end)
    found: dict[str, int] = {}
    _items(shape, plan, b, i, end, found)
    return found


def record(spec, b, i, end) -> tuple[dict[str, int], int]:
    """Return where each item of the record at ``i`` begins, and where the record ends.

    Raises
    ------
    Malformed
        Where the bytes up to ``end`` are not such a record.
    """
    plan, j = _plan(spec, b, i, end)
    if not plan:
        raise Malformed(i, "a record without items")
    found: dict[str, int] = {}
    return found, _items(spec, plan, b, j, end, found)


def _which(lists, b, i, end):
    """Return the list a record of a category with several goes by: plots and tracks of category 1."""
    if len(lists) == 1:
        return lists["-"]
    plan, j = _plan(lists["track"], b, i, end)
    found: dict[str, int] = {}
    _items(lists["track"], [place for place in plan[:2] if place[0] in ("010", "020")], b, j, end, found)
    if "020" not in found:
        raise Malformed(i, "no target report descriptor (I020): neither plot nor track")
    return lists["track" if b[found["020"]] & 0x80 else "plot"]


def records(lists, b, i, end) -> list[tuple[List, dict[str, int], int, int]]:
    """Return the records of a block, ``b[i:end]`` without its header: list of items, items, first and last byte."""
    if i >= end:
        raise Malformed(i, "a block without records")
    out = []
    while i < end:
        spec = _which(lists, b, i, end)
        found, j = record(spec, b, i, end)
        out.append((spec, found, i, j))
        i = j
    return out


def blocks(b, i, end) -> list[tuple[int, int, int]]:
    """Return (category, first byte after the header, end) of each block of ``b[i:end]``.

    Raises
    ------
    Malformed
        Where a block has no or too few bytes; its ``blocks`` are those before.
    """
    out: list[tuple[int, int, int]] = []
    while i < end:
        size = int.from_bytes(b[i + 1 : i + 3], "big")
        if i + 3 > end or size < 3 or i + size > end:
            what = f"a block of {size} bytes" if i + 3 <= end else "a block header"
            raise Malformed(i, f"{what} where {end - i} bytes are left", out)
        out.append((b[i], i + 3, i + size))
        i += size
    return out
