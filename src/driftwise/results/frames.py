"""Columns as a data frame of the library you have."""

from __future__ import annotations

from typing import Any, cast

from ..engine.errors import InputError


def as_frame(columns, backend: str) -> Any:
    """Return columns by name as a data frame of "pandas", "polars" or "pyarrow" (through narwhals)."""
    import narwhals as nw

    try:
        return nw.from_dict(columns, backend=cast(Any, backend)).to_native()
    except ValueError:
        raise InputError(f"to_frame takes 'pandas', 'polars' or 'pyarrow', got {backend!r}") from None
    except ImportError:
        raise ImportError(
            f"to_frame({backend!r}) needs {backend}: pip install driftwise[frames]; or take to_frame('pyarrow')"
        ) from None
