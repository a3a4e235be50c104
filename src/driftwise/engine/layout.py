"""Rows declared once: from one list of named fields come the dtype, the views that kernels work on, and the tables.

    JOINT = Layout(
        *numbers("head", samples="samples taken", observed="of them, with an output"),
        *joined("s", Field("x", ("n",)), Field("theta", ("N - n",))),
        Field("U", ("N * (N - 1) // 2",), "factor of the covariance"),
        policy("detector_state", of="detector"),
        N="n * (inputs + 2)",
    )
    JOINT.on(Form)

A size is Python: a name is what the layout defines, else a number of the form, ``n`` being ``int(form.n)``; ``form``
is the form itself (``len(form.H)``). A size of 0 or 1 is a condition. Neighbours that are joined are one view. What is
written, `Layout.source`, a debugger can step through, and it compiles.
"""

from __future__ import annotations

import ast
import builtins
import linecache
import sys
from collections import namedtuple
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from .dispatch import open_row
from .views import matrix

REST = "..."  # the size of a last field that takes whatever is left of a row


class Field(NamedTuple):
    """Neighbouring numbers of a row that have one name."""

    name: str
    shape: tuple[str, ...] = ()  # one size, two or three of a table; none: a single number
    about: str = ""
    trace: str = ""  # the columns of a trace that show it
    view: str = ""  # what it is seen in together with its neighbours; "": it is a view by itself
    table: tuple[str, ...] = ()  # the shape of that view, where it is a table


def numbers(view: str, **about: str) -> list[Field]:
    """Return fields of one number each, with what they mean; kernels see them as one array of this name."""
    return joined(view, *(Field(name, (), text) for name, text in about.items()))


def joined(view: str, *fields: Field, table: tuple[str, ...] = ()) -> list[Field]:
    """Return neighbours that kernels see as one array of this name, or as one table of this shape."""
    return [field._replace(view=view, table=table) for field in fields]


def each(*shape: str, **about: str) -> list[Field]:
    """Return fields of the same shape, with what they mean."""
    return [Field(name, shape, text) for name, text in about.items()]


def policy(name: str, of: str) -> Field:
    """Return the numbers that a policy keeps; the form says how many, in ``memory_size`` for ``of="memory"``."""
    return Field(name, (f"{of}_size",), f"what the {of} keeps")


class Layout:
    """The fields of a row, and what is written from them.

    Parameters
    ----------
    *fields : in the order of the row
    given : names of sizes that the functions below take one by one, in place of a form
    **sizes : names for sizes, each in terms of those before it, for constants, and for functions that sizes call

    Attributes
    ----------
    open : ``open(form, row)``, or ``open(row, *given)``: the named views of a row, compiled or not
    size : ``size(form)``, or ``size(*given)``: how many numbers a row has, compiled or not
    places : ``places(form)``, or ``places(*given)``: where each view begins, compiled or not
    Row : the type of the views
    source : the text of these functions
    """

    def __init__(self, *fields: Field, given: tuple[str, ...] = (), **sizes: str | int | Callable):
        self.fields, self.given = fields, given
        self.sizes = {name: str(size) for name, size in sizes.items() if not callable(size)}
        self.functions = {name: size for name, size in sizes.items() if callable(size)}
        self.views: dict[str, list[Field]] = {}
        for field in fields:
            self.views.setdefault(field.view or field.name, []).append(field)
        frame = sys._getframe(1)
        while frame.f_globals["__name__"] == __name__ and frame.f_back is not None:
            frame = frame.f_back
        module, line = frame.f_globals["__name__"], frame.f_lineno
        self.Row: Any = namedtuple("Row", list(self.views), module=module)  # type: ignore[misc]  # names of run time
        Places = namedtuple("Places", list(self.views), module=module)  # type: ignore[misc]  # the same
        self.source = "\n".join(self._write())
        filename = f"<layout of {module}, line {line}>"
        linecache.cache[filename] = len(self.source), None, self.source.splitlines(keepends=True), filename
        scope: dict[str, Any] = {"__name__": module, "Row": self.Row, "Places": Places, "matrix": matrix}
        written: dict[str, Any] = {}
        exec(compile(self.source, filename, "exec"), scope | self.functions, written)
        for function in written.values():
            function.__qualname__ += f"_{line}"  # another layout's have names of their own
        self.open: Callable = written["open_row"]
        self.places: Callable[..., Any] = written["places"]
        self.size: Callable[..., int] = written["row_size"]
        self._shapes: Callable[..., list[tuple[int, ...]]] = written["shapes"]

    def on(self, *forms: type) -> None:
        """Let the rows of these forms be laid out like this."""
        open_row.on(*forms)(self.open)
        _layouts.update(dict.fromkeys(forms, self))

    def replace(self, *more: Field, given: tuple[str, ...] = (), **sizes: str | int) -> Layout:
        """Return the same layout with more fields behind, and other sizes."""
        known: dict[str, Any] = {**self.functions, **self.sizes, **sizes}
        return Layout(*self.fields, *more, given=given or self.given, **known)

    def dtype(self, *form, more=()) -> np.dtype:
        """Return the type of a row, by its fields; ``more`` are fields, as NumPy wants them, behind its own."""
        names = [field.name for field in self.fields]
        return np.dtype([(name, float, shape) for name, shape in zip(names, self._shapes(*form))] + list(more))

    def slices(self, *form) -> dict[str, slice]:
        """Return where in a row each field lies."""
        fields: Any = self.dtype(*form).fields
        return {name: slice(at // 8, at // 8 + kind.itemsize // 8) for name, (kind, at) in fields.items()}

    # --- writing ---------------------------------------------------------------------------------------------

    def _write(self) -> Iterator[str]:
        """Yield the lines of the four functions."""
        form, at, begins, shown = ", ".join(self.given) or "form", "0", [], []
        is_open = self.fields[-1].shape == (REST,)
        ends = []
        for name, fields in self.views.items():
            shape = fields[0].table or fields[0].shape
            end = "" if is_open and fields[-1] is self.fields[-1] else f"end_of_{name}"
            if end:
                ends.append(f"    {end} = {_sum(fields, at)}")
            part = f"row[{at}:{end}]"
            shown.append(f"        {_shaped(part, shape)},")
            begins.append(f"        {at},")
            at = end
        yield from (f"def open_row({f'row, {form}' if self.given else 'form, row'}):", *self._names(), *ends)
        yield from ("    return Row(", *shown, "    )", "")
        yield from (f"def places({form}):", *self._names(), *ends, "    return Places(", *begins, "    )", "")
        known = self.fields[:-1] if is_open else self.fields
        yield from (f"def row_size({form}):", *self._names(), f"    return {_sum(known)}", "")
        yield from (f"def shapes({form}):", *self._names())
        yield f"    return [{', '.join(_tuple(field.shape) for field in known)}]"

    def _names(self) -> Iterator[str]:
        """Yield the lines that name the sizes."""
        known = {"form", *dir(builtins), *self.functions, *self.given}
        texts = [*self.sizes.items(), *(("", size) for field in self.fields for size in field.shape if size != REST)]
        for name, text in texts:
            for node in ast.walk(ast.parse(text, mode="eval")):
                if isinstance(node, ast.Name) and node.id not in known:
                    known.add(node.id)
                    yield f"    {node.id} = int(form.{node.id})"
            if name:
                known.add(name)
                yield f"    {name} = {text}"


_layouts: dict[type, Layout] = {}


def layout_of(form) -> Layout:
    """Return how the rows of a form are laid out."""
    return _layouts[type(form)]


def _sum(fields: Sequence[Field], begin: str = "0") -> str:
    """Return where these fields end, as text."""
    single = sum(not field.shape for field in fields)
    counts = [" * ".join(map(_factor, field.shape)) for field in fields if field.shape]
    counts = [begin] * (begin != "0") + counts + [str(single)] * (single > 0)
    return " + ".join(counts) or "0"


def _factor(size: str) -> str:
    """Return a size as it stands in a product."""
    return size if size.isidentifier() or size.isdigit() else f"({size})"


def _shaped(part: str, shape: tuple[str, ...]) -> str:
    """Return numbers of a row as a table, as text."""
    if len(shape) < 2:
        return part
    sizes = ", ".join(shape)
    return f"matrix({part}, {sizes})" if len(shape) == 2 else f"{part}.reshape({sizes})"


def _tuple(shape: tuple[str, ...]) -> str:
    """Return a shape, as text."""
    return f"({', '.join(shape)}{',' * (len(shape) == 1)})"
