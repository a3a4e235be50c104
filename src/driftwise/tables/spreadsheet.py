"""Text that a spreadsheet takes for text."""

from __future__ import annotations

from typing import Any

FORMULA = "=+-@\t\r"  # a cell that begins so is worked out


def harmless(cell: Any) -> Any:
    """Return a cell as a spreadsheet may open it: text that it would work out gets an apostrophe, numbers stay."""
    if not isinstance(cell, str) or not cell.startswith(tuple(FORMULA)):
        return cell
    try:
        float(cell)
    except ValueError:
        return f"'{cell}"
    return cell
