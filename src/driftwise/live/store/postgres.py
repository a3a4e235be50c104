"""States in PostgreSQL, in the schema ``driftwise`` of a database; through restarts of the server."""

from __future__ import annotations

import time
import uuid
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from typing import Any

from ...engine.errors import InputError
from .base import Asleep, Change, StoreFull
from .sql import TABLES, VERSION, SqlStore, facts

LOCK = 0x647266  # of the database, while a service runs on it
ADDED = "recent", "past", "samples"  # tables whose rows are numbered as they come
PATIENCE = 10.0  # s that a server may take to start, or to notice that a service was killed
CONNECT = {"connect_timeout": 5, "tcp_user_timeout": 10_000, "keepalives_idle": 10}


class PostgresStore(SqlStore):
    """A database at a ``url``, "postgresql://user@host/database". One service at a time.

    A commit survives a service that is killed, and with ``is_safe`` a server that is killed; without it a server
    that is killed loses what it has not written yet, by default the last 0.6 s. The password is where libpq looks for
    it: ``PGPASSWORD``, or ``~/.pgpass``.
    """

    mark = "%s"

    def __init__(self, url: str, is_safe: bool = False):
        self.psycopg, self.url, self.is_safe = needed(), url, is_safe
        self.holder = str(uuid.uuid4())
        self._known: tuple[int, ...] = (0,) * len(ADDED)  # their highest numbers that are certain
        try:
            self.base = self._awaited()
            with self.base.transaction():
                self.base.execute("CREATE SCHEMA IF NOT EXISTS driftwise")
                self.base.execute(TABLES.format(blob="BYTEA", serial="BIGSERIAL PRIMARY KEY"))
                found = int(self._fact("version") or VERSION)
                if found > VERSION:
                    raise InputError(f"{url} was written by a later version ({found}, this one knows {VERSION})")
                self._put("facts", [("version", str(VERSION)), ("holder", self.holder)])
        except self.psycopg.Error as error:
            raise InputError(f"the store {url} cannot be opened: {_line(error)}") from None
        self._known = self._numbers()

    def _awaited(self) -> Any:
        """Return a connection to a server that may be starting."""
        until = time.monotonic() + PATIENCE
        while True:
            try:
                return self._connected()
            except self.psycopg.OperationalError:
                if time.monotonic() > until:
                    raise
                time.sleep(0.2)

    def _connected(self) -> Any:
        """Return a connection that has the database for itself."""
        base = self.psycopg.connect(self.url, autocommit=True, **CONNECT)
        try:
            base.execute("SET search_path TO driftwise")
            base.execute(f"SET synchronous_commit TO {'on' if self.is_safe else 'off'}")
            until = time.monotonic() + PATIENCE
            while not base.execute("SELECT pg_try_advisory_lock(%s)", (LOCK,)).fetchone()[0]:
                if time.monotonic() > until:
                    raise InputError(f"another service runs on the store {self.url}")
                time.sleep(0.1)
        except BaseException:
            base.close()
            raise
        return base

    @contextmanager
    def transaction(self) -> Iterator[None]:
        try:
            if self.base.broken or self.base.closed:
                self._again()
            with self.base.transaction():
                yield
        except (self.psycopg.OperationalError, self.psycopg.InterfaceError) as error:
            raise StoreFull(_line(error)) from None

    def _again(self) -> None:
        """Connect again, and take back what the last commit may have added without our being told."""
        self.base.close()
        try:
            base = self._connected()
        except InputError as error:
            raise StoreFull(str(error)) from None
        self.base = base
        if self._fact("holder") != self.holder:
            self.base.close()
            raise StoreFull("another service has written to it meanwhile; this one must be started again")
        with self.base.transaction():
            for table, number in zip(ADDED, self._known):
                self.base.execute(f"DELETE FROM {table} WHERE id > %s", (number,))

    def commit(self, change: Change) -> tuple[int, int]:
        numbers = super().commit(change)
        if change.history or change.past or change.samples:
            self._known = self._numbers()
        return numbers

    def asleep(self, key: str) -> Asleep | None:
        with self.transaction():  # which connects again
            return super().asleep(key)

    def _numbers(self) -> tuple[int, ...]:
        """Return the highest numbers in the tables that are added to."""
        asked = ", ".join(f"COALESCE((SELECT MAX(id) FROM {table}), 0)" for table in ADDED)
        return tuple(self.execute(f"SELECT {asked}").fetchone())

    def _fact(self, name: str) -> str | None:
        """Return a fact."""
        found = self.base.execute("SELECT value FROM facts WHERE name = %s", (name,)).fetchone()
        return found[0] if found else None

    def execute(self, text: str, values: tuple = ()) -> Any:
        try:
            return self.base.execute(text, values or None, binary=True)
        except (self.psycopg.OperationalError, self.psycopg.InterfaceError) as error:
            raise StoreFull(_line(error)) from None

    def execute_many(self, text: str, rows: list[tuple]) -> None:
        with self.base.cursor() as cursor:
            cursor.executemany(text, rows)

    def sync(self) -> None:
        """The server brings commits to its disk by itself."""

    def close(self) -> None:
        self.base.close()


def counted(url: str) -> list[str]:
    """Return what a store holds in words, also while a service writes to it."""
    psycopg = needed()
    try:
        with closing(psycopg.connect(url, autocommit=True, **CONNECT)) as base:
            base.execute("SET search_path TO driftwise")
            return facts(base.execute)
    except psycopg.errors.UndefinedTable:
        raise InputError(f"there is no store at {url}. Has a service run there?") from None
    except psycopg.Error as error:
        raise InputError(f"{url} cannot be read: {_line(error)}") from None


def _line(error: Exception) -> str:
    """Return the first line of what the database says."""
    with suppress(IndexError):
        return str(error).splitlines()[0]
    return type(error).__name__


def needed() -> Any:
    """Return psycopg."""
    try:
        import psycopg
    except ImportError:
        raise InputError("PostgreSQL needs psycopg: pip install 'driftwise[postgres]'") from None
    return psycopg
