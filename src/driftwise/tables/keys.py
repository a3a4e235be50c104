"""Names of series as small numbers, in the order they are first met."""

from __future__ import annotations

from itertools import groupby
from typing import Any

from driftwise.engine.errors import InputError


class Keys:
    """Turns columns of keys into codes; ``names`` are the keys met so far, in order of appearance.

    Keys are whole numbers (also where a column writes them 7.0) or text; Python sees each of them once.
    """

    def __init__(self):
        self.names: list[Any] = []
        self._codes: dict[Any, int] = {}
        self._known: dict[str, tuple[Any, Any]] = {}  # by type: the keys met as an array, and their codes
        self._dictionary: tuple[Any, Any] | None = None  # the last one, and the codes of its entries, -1 where new

    def codes(self, arrays):
        """Return the codes of pyarrow arrays, one after the other, (n,) int64, -1 where there is no key."""
        import numpy as np
        import pyarrow as pa

        found: list[Any] = []
        for kind, alike in groupby(arrays, lambda array: array.type):
            if pa.types.is_dictionary(kind):
                found += map(self._worded, alike)
            else:
                found.append(self._coded(_plain(pa.concat_arrays(list(alike)))))
        return found[0] if len(found) == 1 else np.concatenate(found)

    def _worded(self, chunk):
        """Return the codes of a dictionary array; entries that no row names are not met."""
        import numpy as np

        words, last = chunk.dictionary, self._dictionary
        if last is None or not words.equals(last[0]):
            self._dictionary = last = words, np.full(len(words) + 1, -1)
        codes = last[1]
        at = _filled(chunk.indices, len(words))
        missing = at[(codes[at] < 0) & (at < len(words))]
        if len(missing):
            entries, first = np.unique(missing, return_index=True)
            entries = entries[np.argsort(first)]
            codes[entries] = self._coded(_plain(words.take(entries)))
        return codes[at]

    def _coded(self, column):
        """Return the codes of a plain column; look each up among those met, and add those that are new."""
        import numpy as np
        import pyarrow as pa
        import pyarrow.compute as pc

        kind = str(column.type)
        met, codes = self._known.get(kind, (pa.array([], column.type), np.array([-1])))
        found = codes[_filled(pc.index_in(column, value_set=met, skip_nulls=True), len(met))]
        new = found < 0
        if column.null_count:
            new &= pc.is_valid(column).to_numpy(zero_copy_only=False)
        if new.any():
            fresh = pc.unique(column.filter(pa.array(new)))
            more = np.array([self._code(name) for name in fresh.to_pylist()])
            met = pa.concat_arrays([met, fresh])
            codes = np.concatenate([codes[:-1], more, [-1]])
            self._known[kind] = met, codes
            found = codes[_filled(pc.index_in(column, value_set=met, skip_nulls=True), len(met))]
        return found

    def _code(self, name) -> int:
        if name == "":  # an empty cell of a CSV file
            return -1
        if name not in self._codes:
            self._codes[name] = len(self.names)
            self.names.append(name)
        return self._codes[name]


def _filled(indices, missing: int):
    """Return indices as (n,) int64, ``missing`` for null."""
    import numpy as np
    import pyarrow.compute as pc

    if indices.null_count:
        indices = pc.fill_null(indices, pc.cast(missing, indices.type))
    return indices.to_numpy().astype(np.int64)


def _plain(column):
    """Return keys as int64, or as text: of numbers that are not whole, and of anything else."""
    import pyarrow as pa
    import pyarrow.compute as pc

    from driftwise.tables.cells import is_text

    kind = column.type
    if kind in (pa.int64(), pa.large_string()):
        return column
    if pa.types.is_floating(kind):
        column = pc.if_else(pc.is_finite(column), column, pa.scalar(None, kind))
    try:
        is_number = pa.types.is_integer(kind) or pa.types.is_floating(kind)
        return column.cast(pa.int64()) if is_number else column.cast(pa.large_string())
    except pa.ArrowException:
        if is_text(kind) or not is_number:
            raise InputError(f"a column of type {kind} cannot be used as keys: whole numbers or text can") from None
        return column.cast(pa.large_string())
