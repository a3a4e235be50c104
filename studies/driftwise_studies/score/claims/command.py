"""The command of a study that draws records of several kinds and prints one table of them."""

from __future__ import annotations

import argparse
from collections.abc import Callable


def show(table: Callable[[int, int], str], doc: str | None, records: int) -> None:
    """Print ``table(seed, records)``, as options say; ``records`` are those of each kind without one."""
    parser = argparse.ArgumentParser(description=(doc or "").splitlines()[0])
    parser.add_argument("--records", type=int, default=records, help="of each kind")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    print(table(asked.seed, asked.records))
