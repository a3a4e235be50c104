"""The tables, and all that SQLite and PostgreSQL say alike."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import Any

from ..board import EventView
from .base import EVENT, Asleep, Change, Found, Group, Member, RowBytes, event_of

VERSION = 1
NAMES = ", ".join(EVENT)
MOST = (1 << 63) - 1  # number of an event that a database can be asked for
TABLES = """
CREATE TABLE IF NOT EXISTS facts (name TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS groups (
    number INTEGER PRIMARY KEY, words TEXT NOT NULL, fields TEXT NOT NULL, options TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS settings (
    grp INTEGER NOT NULL, number INTEGER NOT NULL, json TEXT NOT NULL, PRIMARY KEY (grp, number));
CREATE TABLE IF NOT EXISTS series (number INTEGER PRIMARY KEY, key TEXT UNIQUE NOT NULL, grp INTEGER);
CREATE TABLE IF NOT EXISTS resting (number INTEGER PRIMARY KEY);
CREATE TABLE IF NOT EXISTS states (number INTEGER PRIMARY KEY, numbers {blob} NOT NULL, held {blob} NOT NULL);
CREATE TABLE IF NOT EXISTS waiting (number INTEGER PRIMARY KEY, json TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS samples (id {serial}, number INTEGER NOT NULL, numbers {blob} NOT NULL);
CREATE TABLE IF NOT EXISTS events (
    number INTEGER PRIMARY KEY, key TEXT NOT NULL, time DOUBLE PRECISION NOT NULL, kind TEXT NOT NULL,
    sentence TEXT NOT NULL, odds DOUBLE PRECISION, acknowledged INTEGER NOT NULL);
CREATE INDEX IF NOT EXISTS events_of ON events (key, number);
CREATE TABLE IF NOT EXISTS recent (id {serial}, numbers {blob} NOT NULL);
CREATE TABLE IF NOT EXISTS past (id {serial}, numbers {blob} NOT NULL);
CREATE TABLE IF NOT EXISTS places (name TEXT PRIMARY KEY, json TEXT NOT NULL)
"""
PUT = {
    "facts": ("name", "value"),
    "groups": ("number", "words", "fields", "options"),
    "settings": ("grp", "number", "json"),
    "series": ("number", "key", "grp"),
    "states": ("number", "numbers", "held"),
    "waiting": ("number", "json"),
    "events": EVENT,
    "places": ("name", "json"),
    "resting": ("number",),
}
KEYS = {"settings": ("grp", "number"), "facts": ("name",), "places": ("name",)}  # of the others: number


class SqlStore:
    """A store in a database; what differs between databases are six small functions."""

    mark = "?"  # stands for a value

    def transaction(self) -> AbstractContextManager[None]:
        """Make all that is written inside one step; an error of the database becomes `StoreFull`."""
        raise NotImplementedError

    def execute(self, text: str, values: tuple = ()) -> Any:
        """Say something; return what can be fetched from."""
        raise NotImplementedError

    def execute_many(self, text: str, rows: list[tuple]) -> None:
        """Say the same of many rows."""
        raise NotImplementedError

    def _put(self, table: str, rows: list[tuple]) -> None:
        """Write rows in place of those with their keys."""
        if not rows:
            return
        names, keys = PUT[table], KEYS.get(table, ("number",))
        marks = ", ".join([self.mark] * len(names))
        said = ", ".join(f"{name} = excluded.{name}" for name in names if name not in keys)
        self.execute_many(
            f"INSERT INTO {table} ({', '.join(names)}) VALUES ({marks}) "
            f"ON CONFLICT ({', '.join(keys)}) DO {f'UPDATE SET {said}' if said else 'NOTHING'}",
            rows,
        )

    def _drop(self, table: str, numbers: list[int]) -> None:
        """Forget the rows of these series."""
        if numbers:
            self.execute_many(f"DELETE FROM {table} WHERE number = {self.mark}", [(number,) for number in numbers])

    def commit(self, change: Change) -> tuple[int, int]:
        with self.transaction():
            self._put("groups", [(g.number, g.words, g.fields, json.dumps(g.options)) for g in change.groups])
            self._put("settings", [(g.number, number, text) for g in change.groups for number, text in g.settings])
            self._put("series", [tuple(member) for member in change.members])
            self._put("states", [tuple(row) for row in change.rows])
            self._put("waiting", change.waiting)
            if change.samples:
                self.execute_many(
                    f"INSERT INTO samples (number, numbers) VALUES ({self.mark}, {self.mark})", change.samples
                )
            self._drop("samples", change.chosen)
            self._put("resting", [(number,) for number in change.resting])
            self._drop("resting", change.woken)
            self._put("events", [_row(event) for event in change.events])
            numbers = self._added("recent", change.history), self._added("past", change.past)
            self._put("places", [(name, json.dumps(place)) for name, place in change.places.items()])
        return numbers

    def _added(self, table: str, numbers: bytes) -> int:
        """Add rows of the past; return the number they have, 0 where there are none."""
        if not numbers:
            return 0
        told = self.execute(f"INSERT INTO {table} (numbers) VALUES ({self.mark}) RETURNING id", (numbers,))
        return int(told.fetchone()[0])

    def load(self) -> Found:
        settings: dict[int, list[str]] = {}
        for group, _, text in self.execute("SELECT grp, number, json FROM settings ORDER BY grp, number").fetchall():
            settings.setdefault(group, []).append(text)
        groups = [
            Group(number, words, fields, json.loads(options), settings.get(number, []))
            for number, words, fields, options in self.execute(
                "SELECT number, words, fields, options FROM groups ORDER BY number"
            ).fetchall()
        ]
        awake = "NOT IN (SELECT number FROM resting)"
        members = self.execute(f"SELECT number, key, grp FROM series WHERE number {awake} ORDER BY number").fetchall()
        rows = self.execute(f"SELECT number, numbers, held FROM states WHERE number {awake} ORDER BY number").fetchall()
        samples: dict[int, bytes] = {}
        for number, numbers in self.execute(
            f"SELECT number, numbers FROM samples WHERE number {awake} ORDER BY id"
        ).fetchall():
            samples[number] = samples.get(number, b"") + bytes(numbers)
        last = self.execute("SELECT MAX(number) FROM events").fetchone()[0]
        highest = self.execute("SELECT MAX(number) FROM series").fetchone()[0]
        keys = f"key IN (SELECT key FROM series WHERE number {awake})"
        opened = self.execute(
            f"SELECT {NAMES} FROM events WHERE {keys} AND (acknowledged = 0 OR number IN "
            "(SELECT MAX(number) FROM events GROUP BY key)) ORDER BY number"
        ).fetchall()
        waiting = self.execute(f"SELECT number, json FROM waiting WHERE number {awake}").fetchall()
        return Found(
            groups,
            [Member(*row) for row in members],
            {row[0]: RowBytes(row[0], bytes(row[1]), bytes(row[2])) for row in rows},
            dict(waiting),
            samples,
            {name: json.loads(text) for name, text in self.execute("SELECT name, json FROM places").fetchall()},
            last or 0,
            [event_of(row) for row in opened],
            self.execute("SELECT COUNT(*) FROM resting").fetchone()[0],
            -1 if highest is None else highest,
        )

    def asleep(self, key: str) -> Asleep | None:
        found = self.execute(f"SELECT number, key, grp FROM series WHERE key = {self.mark}", (key,)).fetchone()
        if found is None:
            return None
        member = Member(*found)

        def of(names: str, table: str, more: str = "") -> list:
            said = f"SELECT {names} FROM {table} WHERE number = {self.mark} {more}"
            return self.execute(said, (member.number,)).fetchall()

        row = next(iter(of("number, numbers, held", "states")), None)
        opened = self.execute(
            f"SELECT {NAMES} FROM events WHERE key = {self.mark} AND (acknowledged = 0 OR number = "
            f"(SELECT MAX(number) FROM events WHERE key = {self.mark})) ORDER BY number", (key, key),
        ).fetchall()  # fmt: skip
        return Asleep(
            member,
            None if row is None else RowBytes(row[0], bytes(row[1]), bytes(row[2])),
            next((one[0] for one in of("json", "waiting")), None),
            b"".join(bytes(one[0]) for one in of("numbers", "samples", "ORDER BY id")),
            [event_of(one) for one in opened],
        )

    def keys(self, numbers: Sequence[int]) -> dict[int, str]:
        found = {}
        for number in numbers:
            said = self.execute(f"SELECT key FROM series WHERE number = {self.mark}", (number,)).fetchone()
            if said is not None:
                found[number] = said[0]
        return found

    def events(self, since: int, key: str | None, most: int | None = None, latest: bool = False) -> list[EventView]:
        since = min(max(since, 0), MOST)
        values = (since,) if key is None else (since, key)
        only = "" if key is None else f" AND key = {self.mark}"
        order, limit = "DESC" if latest else "ASC", "" if most is None else f" LIMIT {int(most)}"
        found = self.execute(
            f"SELECT {NAMES} FROM events WHERE number > {self.mark}{only} ORDER BY number {order}{limit}", values
        ).fetchall()
        return [event_of(row) for row in (reversed(found) if latest else found)]

    def acknowledge(self, number: int) -> EventView:
        if number > MOST:
            raise KeyError(number)
        with self.transaction():
            self.execute(f"UPDATE events SET acknowledged = 1 WHERE number = {self.mark}", (number,))
        row = self.execute(f"SELECT {NAMES} FROM events WHERE number = {self.mark}", (number,)).fetchone()
        if row is None:
            raise KeyError(number)
        return event_of(row)

    def recent(self, table: str = "recent") -> list[tuple[int, bytes]]:
        found = self.execute(f"SELECT id, numbers FROM {table} ORDER BY id").fetchall()
        return [(number, bytes(numbers)) for number, numbers in found]

    def forget(self, upto: int, table: str = "recent") -> None:
        with self.transaction():
            self.execute(f"DELETE FROM {table} WHERE id <= {self.mark}", (upto,))


def facts(execute: Callable[[str], Any]) -> list[str]:
    """Return what tables hold in words; ``execute`` asks them."""
    series, chosen = execute("SELECT COUNT(*), COUNT(grp) FROM series").fetchone()
    resting = execute("SELECT COUNT(*) FROM resting").fetchone()[0]
    events, seen = execute("SELECT COUNT(*), SUM(acknowledged) FROM events").fetchone()
    last = execute("SELECT key, kind, sentence FROM events ORDER BY number DESC LIMIT 1").fetchone()
    found = [f"{series} series" + (f", of {series - chosen} the model is not chosen yet" if series > chosen else "")]
    found += [f"{resting} of them at rest"] if resting else []
    found.append(f"{events} events, {events - (seen or 0)} of them not acknowledged")
    return found + ([f"the last: {last[0]}: {last[1]}: {last[2]}"] if last else [])


def _row(event: EventView) -> tuple:
    """Return an event as the table has it."""
    return (
        event.number, event.key, event.time, event.kind, event.sentence, event.odds, int(event.acknowledged),
    )  # fmt: skip
