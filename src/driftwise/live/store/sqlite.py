"""States in one file: SQLite, with a log that is written ahead (WAL)."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path
from typing import Any

from ...engine.alone import alone
from ...engine.errors import InputError
from .base import StoreFull
from .sql import TABLES, VERSION, SqlStore, facts

NAME = "live.sqlite"
PAGES = 4000  # of the log, 16 MB: beyond, a commit brings it into the file itself


class SqliteStore(SqlStore):
    """A folder with ``live.sqlite``. One process at a time.

    A commit survives a process that is killed; one that is not older than the last `sync` may not survive the machine
    (``is_safe``: every commit does, and takes as long as the disk).
    """

    def __init__(self, folder: str | Path, is_safe: bool = False):
        self.path = Path(folder) / NAME
        try:
            Path(folder).mkdir(parents=True, exist_ok=True)
            with ExitStack() as opened:
                opened.enter_context(alone(folder, f"another service runs on the store in {folder}"))
                self.base = sqlite3.connect(self.path, isolation_level=None, check_same_thread=False, timeout=1.0)
                opened.enter_context(closing(self.base))
                self._prepare(is_safe)
                self._opened = opened.pop_all()
        except sqlite3.OperationalError as error:
            why = "another process has it" if "locked" in str(error) else str(error)
            raise InputError(f"the store in {folder} cannot be opened: {why}") from None
        except sqlite3.DatabaseError as error:
            raise InputError(f"{folder}/{NAME} is no store: {error}") from None
        except OSError as error:
            raise InputError(f"the store in {folder} cannot be made: {error.strerror or error}") from None

    def _prepare(self, is_safe: bool) -> None:
        """Make tables that are not there, unless a later version made them."""
        self.base.execute("PRAGMA journal_mode = WAL")
        self.base.execute(f"PRAGMA synchronous = {'FULL' if is_safe else 'NORMAL'}")
        self.base.execute(f"PRAGMA wal_autocheckpoint = {PAGES}")
        found = self.base.execute("PRAGMA user_version").fetchone()[0]
        if found > VERSION:
            raise InputError(f"{self.path} was written by a later version ({found}, this one knows {VERSION})")
        self.base.executescript(
            "BEGIN;" + TABLES.format(blob="BLOB", serial="INTEGER PRIMARY KEY AUTOINCREMENT") + ";COMMIT"
        )
        self.base.execute(f"PRAGMA user_version = {VERSION}")

    @contextmanager
    def transaction(self) -> Iterator[None]:
        try:
            self.base.execute("BEGIN")
            yield
            self.base.execute("COMMIT")
        except sqlite3.OperationalError as error:
            with suppress(sqlite3.Error):
                self.base.execute("ROLLBACK")
            raise StoreFull(str(error)) from None
        except BaseException:
            with suppress(sqlite3.Error):
                self.base.execute("ROLLBACK")
            raise

    def execute(self, text: str, values: tuple = ()) -> Any:
        return self.base.execute(text, values)

    def execute_many(self, text: str, rows: list[tuple]) -> None:
        self.base.executemany(text, rows)

    def sync(self) -> None:
        """Return when the log is on the disk, and bring it into the file, so that no commit has to; for a thread."""
        with suppress(FileNotFoundError):
            number = os.open(f"{self.path}-wal", os.O_RDWR)
            try:
                os.fsync(number)
            finally:
                os.close(number)
        with suppress(sqlite3.OperationalError), closing(sqlite3.connect(self.path, timeout=0.1)) as beside:
            beside.execute("PRAGMA wal_checkpoint(PASSIVE)")  # waits for nobody; what it cannot do is done next time

    def close(self) -> None:
        self._opened.close()


def counted(folder: str | Path) -> list[str]:
    """Return what a store holds in words, also while a service writes to it."""
    path = Path(folder) / NAME
    if not path.exists():
        raise InputError(f"there is no store in {folder}: no {NAME}. Has a service run there?")
    with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=2.0)) as base:
        try:
            return facts(base.execute)
        except sqlite3.DatabaseError as error:
            raise InputError(f"{path} cannot be read: {error}") from None
