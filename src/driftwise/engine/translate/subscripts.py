"""Read what is in brackets: elements and parts of views, items of tuples, entries of tables."""

from __future__ import annotations

import ast
from typing import Any

import numpy as np

from .tree import Column, Constant, Cut, Extent, Load, Look, Make, Name, Operation, Part
from .types import BOOL, FLOAT, INT, Known, Several, View


class Subscripts:
    """What is in brackets: an element, a row, a stretch of a view; an item of a tuple; an entry of a table."""

    # given by the reader and by `Expressions`
    is_own: bool
    error: Any
    ordered: Any
    keep: Any
    number: Any
    part: Any
    operate: Any

    def place(self, node) -> tuple[Any, list[Any]]:
        """Return the view and the indices of an element that is written."""
        view, indices = self.indexed(node)
        if not isinstance(view.type, View) or len(indices) != view.type.dims:
            raise self.error(node, "one number of a view is written, nothing else")
        return view, indices

    def indexed(self, node) -> tuple[Any, list[Any]]:
        """Return what is indexed, and integer indices."""
        nodes = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        view, *indices = self.ordered([node.value, *nodes])
        if isinstance(view.type, View):
            indices = [self.index(view, axis, value, node) for axis, value in enumerate(indices)]
            if not isinstance(view, Name) and not _is_path(view):
                view = self.keep(view)
        return view, indices

    def index(self, view, axis: int, value, node) -> Any:
        """Return an index; one that is known and negative counts from the end."""
        value = self.number(value, INT, node)
        if isinstance(value, Constant) and value.value < 0:
            return Operation(INT, "+", [Extent(INT, view, axis), value])
        return value

    def bound(self, view, axis: int, value, node) -> Any:
        """Return where a slice begins or ends; a known negative one counts from the end, as far as it goes."""
        bound = self.index(view, axis, value, node)
        is_negative = isinstance(bound, Operation) and isinstance(value, Constant)
        return Operation(INT, "max", [bound, Constant(INT, 0)]) if is_negative else bound

    def value_Subscript(self, node) -> Any:
        """An element, a row, a stretch, an item."""
        nodes = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        if any(isinstance(one, ast.Slice) for one in nodes):
            return self.cut(node, nodes)
        value, indices = self.indexed(node)
        kind = value.type
        if isinstance(kind, View):
            if len(indices) > kind.dims:
                raise self.error(node, f"a view of {kind.dims} dimensions")
            if len(indices) == kind.dims:
                return Load(kind.element, value, indices)
            return Cut(View(kind.dims - len(indices), kind.element), value, indices, None)
        index = indices[0]
        items = getattr(kind, "items", None)
        if items is not None or (isinstance(value, Constant) and isinstance(index, Constant) and len(indices) == 1):
            if not isinstance(index, Constant):
                raise self.error(node, "an item of a tuple is chosen by a number that is known")
            count = len(items) if items is not None else len(value.value)
            return self.part(value, index.value % count if -count <= index.value < count else index.value)
        if isinstance(value, Constant):
            return self.looked_up(value.value, indices, node)
        raise self.error(node, "this has no elements")

    def looked_up(self, table, indices, node) -> Any:
        """Return an entry of a table of constants."""
        table = np.asarray(table)
        if table.dtype.kind not in "fib" or table.ndim not in (len(indices), len(indices) + 1):
            raise self.error(node, "a table of constants holds numbers, and is indexed to the last")
        at: Any = self.number(indices[0], INT, node)
        for axis in range(1, len(indices)):
            at = self.operate("Mult", at, Constant(Known(table.shape[axis]), table.shape[axis]), node)
            at = self.operate("Add", at, self.number(indices[axis], INT, node), node)
        kind = {"f": FLOAT, "i": INT, "b": BOOL}[table.dtype.kind]
        if table.ndim == len(indices):
            return Look(kind, tuple(table.ravel().tolist()), at)
        at = self.keep(at)
        columns = table.reshape(-1, table.shape[-1]).T.tolist()
        return Make(Several((kind,) * len(columns)), [Look(kind, tuple(column), at) for column in columns])

    def cut(self, node, nodes) -> Any:
        """Part of a view: ``a[i:j]``, ``a[i, j:k]``, ``a[:, j]``."""
        where = nodes[-1] if isinstance(nodes[-1], ast.Slice) else nodes[0]
        bounds = [b for b in (where.lower, where.upper) if b is not None] if isinstance(where, ast.Slice) else []
        if where.step is not None:
            raise self.error(node, "a slice has no step here")
        others = [one for one in nodes if one is not where]
        view, *found = self.ordered([node.value, *others, *bounds])
        if not isinstance(view.type, View):
            if isinstance(view, Constant) and all(isinstance(f, Constant) for f in found) and not others:
                low = found.pop(0).value if where.lower is not None else None
                known = view.value[low : found[0].value if found else None]
                return Constant(Known(known), known)
            raise self.error(node, "a slice is cut from a view")
        if not isinstance(view, Name) and not _is_path(view):
            view = self.keep(view)
        kind = view.type
        if len(nodes) == 2 and where is nodes[0]:
            column = found[0]
            if kind.dims != 2 or bounds:
                raise self.error(node, "a column is cut whole, from a table")
            return Column(View(1, kind.element, True), view, self.index(view, 1, column, node))
        if len(others) + 1 > kind.dims:
            raise self.error(node, f"a view of {kind.dims} dimensions")
        indices = [self.index(view, axis, f, node) for axis, f in enumerate(found[: len(others)])]
        axis, found = len(others), found[len(others) :]
        low = self.bound(view, axis, found.pop(0), node) if where.lower is not None else Constant(INT, 0)
        high = self.bound(view, axis, found.pop(0), node) if where.upper is not None else None
        clips = not self.is_own  # what driftwise cuts is within bounds: the checked build proves it, of every loop
        return Cut(View(kind.dims - len(others), kind.element, kind.is_strided), view, indices, (low, high), clips)


def _is_path(value) -> bool:
    """Say whether it is a variable, or a field of one."""
    while isinstance(value, Part):
        value = value.value
    return isinstance(value, Name)
