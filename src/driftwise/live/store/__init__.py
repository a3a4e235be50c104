"""Where states are kept: SQLite, or PostgreSQL; history in Parquet."""

from __future__ import annotations

from typing import Any

from .base import Store


def opened(config: Any) -> Store:
    """Return the store of a `StoreConfig`."""
    if config.url:
        from .postgres import PostgresStore

        return PostgresStore(config.url, is_safe=config.fsync == 0)
    from .sqlite import SqliteStore

    return SqliteStore(config.path, is_safe=config.fsync == 0)


def counted(config: Any) -> list[str]:
    """Return what the store of a `StoreConfig` holds in words, also while a service writes to it."""
    if config.url:
        from . import postgres

        return postgres.counted(config.url)
    from . import sqlite

    return sqlite.counted(config.path)
