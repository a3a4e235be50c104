"""Compiled loops as functions of Python: a little C (`caller.c`), compiled like any loop, knows what an array is."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any

import numpy as np

SOURCE = Path(__file__).with_name("caller.c")
MOST, WIDEST, ROOM = 16, 16, 1024  # arguments of a loop; numbers that a step shows, and its scratch
INDEX, INTEGER, FLOAT = -1, -2, -3

_API = (
    "PyObject_GetBuffer PyBuffer_Release PyCapsule_GetPointer PyCapsule_New PyCFunction_NewEx PyEval_SaveThread "
    "PyEval_RestoreThread PyLong_AsLongLong PyFloat_AsDouble PyLong_FromLongLong PyFloat_FromDouble PyTuple_New "
    "PyTuple_SetItem PyErr_Occurred PyErr_Clear PyErr_SetString"
).split()
_kept: list[Any] = []  # what compiled code points to lives as long as the process


class Loop(ctypes.Structure):
    """Where a loop begins, and what it takes; who changes ``entry`` changes what every caller runs."""

    _fields_ = (
        ("entry", ctypes.c_void_p),
        ("count", ctypes.c_int),
        ("kinds", ctypes.c_int * MOST),
        ("reads", ctypes.c_int * MOST),
    )


class Stream(ctypes.Structure):
    """What one sample of a loop takes; ``loop`` is filled in."""

    _fields_ = (
        ("loop", ctypes.c_void_p),
        ("inputs", ctypes.c_int),
        ("columns", ctypes.c_int),
        ("room", ctypes.c_int),
    )


class Caller:
    """Makes functions of loops; ``library`` is the compiled `caller.c`."""

    def __init__(self, library: Path):
        self.library = ctypes.PyDLL(str(library))
        for make in (self.library.make, self.library.make_step):
            make.restype = ctypes.py_object
        known: list[Any] = [ctypes.cast(getattr(ctypes.pythonapi, name), ctypes.c_void_p).value for name in _API]
        numbers = [np.dtype(np.float64), np.dtype(np.int64)]
        known += [
            id(TypeError),
            id(np.ndarray) if _is_laid_out() else None,
            *map(id, (*numbers, float, int, np.float64, None)),
        ]
        table = (ctypes.c_void_p * len(known))(*known)
        _kept.append(numbers)
        self.library.introduce(table)

    def function(self, entry: int, dimensions, reads=()) -> tuple[Any, Loop]:
        """Return a function that runs the loop at address ``entry``, and its `Loop`; ``reads``: what it only reads."""
        kinds = [{int: INTEGER, float: FLOAT, "index": INDEX}.get(d, d) for d in dimensions]
        loop = Loop(entry, len(kinds), (ctypes.c_int * MOST)(*kinds), (ctypes.c_int * MOST)(*reads))
        _kept.append(loop)
        return self.library.make(ctypes.byref(loop)), loop

    def step(self, function, inputs: int, columns: int, room: int) -> Any:
        """Return ``step(rows, y, u, spec)`` of a driver that `function` made; None where it shows or takes too much."""
        if inputs > 1 or columns > WIDEST or room > ROOM:
            return None
        stream = Stream(None, inputs, columns, room)
        _kept.append(stream)
        return self.library.make_step(ctypes.byref(stream), ctypes.py_object(function.__self__))


def _is_laid_out() -> bool:
    """Say whether arrays lie in memory as NumPy's documentation says; else they are asked by the buffer protocol."""
    array = np.arange(6.0).reshape(2, 3)
    words = (ctypes.c_void_p * 7).from_address(id(array) + object.__basicsize__)
    dims = ctypes.c_int.from_address(id(array) + object.__basicsize__ + 8).value
    shape = (ctypes.c_ssize_t * 2).from_address(words[2] or ctypes.addressof(words))
    return (
        ctypes.sizeof(ctypes.c_void_p) == 8
        and object.__basicsize__ == 16
        and words[0] == array.ctypes.data
        and dims == 2
        and tuple(shape) == (2, 3)
        and words[5] == id(array.dtype)
    )
