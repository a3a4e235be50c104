"""`Roster`: the series that are in memory, and the fleets they are rows of."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from ..engine.errors import InputError
from .config import SeriesConfig
from .rows import Rows
from .series import Series
from .store.base import Asleep, Group, Member, RowBytes


class Roster:
    """Series by key, by number and by slot, and the `Rows` of each model.

    A number counts all series that ever came; a slot is a place in columns, used again when its series has gone to
    rest; a code is a row within the group of a model.

    Parameters
    ----------
    config_of : what holds for a series of (key)
    """

    def __init__(self, config_of: Callable[[str], SeriesConfig]):
        self.config_of = config_of
        self.by_key: dict[str, Series] = {}
        self.by_number: dict[int, Series] = {}
        self.by_slot: list[Series | None] = []
        self.groups: list[Rows] = []
        self.words: list[str] = []  # of each group, JSON: model, options, inputs
        self.members: list[list[int]] = []  # of each group, the slots of its series by code
        self._free: list[int] = []

    def enter(self, number: int, key: str) -> Series:
        """Return a series that comes, without a model."""
        slot = self._free.pop() if self._free else len(self.by_slot)
        series = Series(number, key, self.config_of(key), slot)
        if slot == len(self.by_slot):
            self.by_slot.append(series)
        self.by_slot[slot] = self.by_key[key] = self.by_number[number] = series
        return series

    def assign(self, series: Series, words: str, make: Callable[[], Any]) -> None:
        """Give a series to the group of its model."""
        config = series.config
        options: dict[str, Any] = {"dt": config.dt, "first": config.first, "stuck": config.stuck}
        if config.model == "auto":
            options["window"] = config.identify
        name = json.dumps([words, options, config.inputs])
        if name not in self.words:
            self._add(Rows(make(), **options), name)
        self._join([series], self.words.index(name))

    def _add(self, rows: Rows, words: str) -> None:
        self.groups.append(rows)
        self.words.append(words)
        self.members.append([])

    def _join(self, some: list[Series], group: int, kept: list[RowBytes] | None = None) -> None:
        """Let series be the next rows of a group: with what was ``kept`` of each, or as they begin."""
        rows, members = self.groups[group], self.members[group]
        for series in some:
            series.group, series.code = group, len(members)
            members.append(series.slot)
        if kept:
            held = {i: np.frombuffer(row.held) for i, row in enumerate(kept) if row.held}
            numbers = np.frombuffer(b"".join(row.row for row in kept)).reshape(len(kept), -1)
            rows.put([one.key for one in some], numbers, held)
        else:
            rows.names += [one.key for one in some]

    def leave(self, some: Iterable[Series]) -> None:
        """Take series out of their groups."""
        gone: dict[int, list[int]] = {}
        for series in some:
            if series.group is not None:
                gone.setdefault(series.group, []).append(series.code)
                series.group = None
        for group, codes in gone.items():
            is_kept = self.groups[group].drop(codes).tolist()
            members = [slot for slot, is_left in zip(self.members[group], is_kept) if is_left]
            self.members[group] = members
            for code, slot in enumerate(members):
                self.at(slot).code = code

    def remove(self, some: list[Series]) -> None:
        """Forget series; their slots are used again."""
        self.leave(some)
        for series in some:
            del self.by_key[series.key], self.by_number[series.number]
            self.by_slot[series.slot] = None
            self._free.append(series.slot)

    def at(self, slot: int) -> Series:
        """Return the series in a slot that is used."""
        series = self.by_slot[slot]
        assert series is not None
        return series

    def model(self, series: Series) -> str:
        """Return the model of a series in words; "" while it has none."""
        return "" if series.group is None else str(json.loads(self.words[series.group])[0])

    # --- what a store has ----------------------------------------------------------------------------------

    def packed(self, some: Iterable[Series]) -> list[RowBytes]:
        """Return what is to be kept of series that have a model."""
        codes: dict[int, list[int]] = {}
        for series in some:
            if series.group is not None and series.code < len(self.groups[series.group].fleet):
                codes.setdefault(series.group, []).append(series.code)
        found = []
        for group, listed in sorted(codes.items()):
            at = np.array(sorted(listed), np.int64)
            numbers, held = self.groups[group].rows(at)
            none = np.zeros(0)
            found += [
                RowBytes(
                    self.at(self.members[group][code]).number, numbers[i].tobytes(), held.get(code, none).tobytes()
                )
                for i, code in enumerate(at.tolist())
            ]
        return found

    def new_groups(self) -> list[Group]:
        """Return groups with what is new of their settings."""
        found = []
        for number, (rows, words) in enumerate(zip(self.groups, self.words)):
            settings = rows.new_settings()
            if settings:
                found.append(Group(number, words, rows.fields, json.loads(words)[1], settings))
        return found

    def load(self, groups: list[Group], members: list[Member], rows: dict[int, RowBytes]) -> None:
        """Go on with groups and series as a store has them."""
        for group in groups:
            self._add(Rows.restored(group.settings, **group.options), group.words)
            if self.groups[-1].fields != group.fields:
                raise InputError(
                    f"the states of {group.words} were written by another version, and cannot be gone on with"
                )
        there: dict[int, list[Series]] = {}
        fresh: dict[int, list[Series]] = {}
        for member in members:
            series = self._member(member)
            if member.group is not None:
                (there if member.number in rows else fresh).setdefault(member.group, []).append(series)
        for number, some in there.items():
            self._join(some, number, [rows[one.number] for one in some])
        for number, some in fresh.items():
            self._join(some, number)

    def wake(self, found: Asleep) -> Series:
        """Return a series that was at rest, as it was."""
        series, group = self._member(found.member), found.member.group
        if group is not None:
            self._join([series], group, None if found.row is None else [found.row])
        return series

    def _member(self, member: Member) -> Series:
        """Return a series as a store lists it; it keeps the model it has, and so the inputs."""
        series = self.enter(member.number, member.key)
        if member.group is not None:
            series.config = replace(series.config, inputs=tuple(json.loads(self.words[member.group])[2]))
        return series
