"""Where states are kept: SQLite, or PostgreSQL; history in Parquet."""

from __future__ import annotations

from typing import Any

from .base import Store


def opened(config: Any) -> Store:
    """Return the store of a `StoreConfig`."""
    from .sqlite import SqliteStore

    return SqliteStore(config.path, is_safe=config.fsync == 0)
