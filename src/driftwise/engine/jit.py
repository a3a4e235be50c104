"""The same loops compiled by numba: the reference of the tests, and what runs on a GPU."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from . import dispatch, views
from .short_loops import short_loops

_bound: set[Callable] = set()
_lock = threading.RLock()

# Nothing is allocated, so nothing needs to be counted: without `_nrt=False` reference counts take most of the time.
OPTIONS: Any = {"error_model": "numpy", "_nrt": False}
# A call hands over each field of each array in registers and on the stack: more than a hundred for a state and its
# scratch. Inlined, a sample takes two thirds of the time. (numba hands the flag down to callees, hence both values.)
INLINE: Any = {**OPTIONS, "forceinline": True}
APART: Any = {**OPTIONS, "forceinline": False}


def _bind() -> None:
    """Teach numba every marked function; implementations are looked up when a driver is compiled."""
    from numba.extending import overload

    for function, resolve in dispatch.resolvers():
        if function not in _bound:
            options = APART if function in dispatch.apart else INLINE
            overload(function, jit_options=options, strict=False)(resolve)
            _bound.add(function)
    views.bind()


def compiled(loop: Callable, dimensions) -> Callable:
    """Return a loop compiled for C-contiguous float64 arrays of these dimensions, and numbers."""
    with _lock:
        import numba
        import numba.types

        _bind()
        function = numba.njit(nogil=True, **OPTIONS)(loop)
        numbers = {int: numba.int64, float: numba.float64, "index": numba.types.Array(numba.int64, 1, "C")}
        types = tuple(numbers.get(d) or numba.types.Array(numba.float64, d, "C") for d in dimensions)
        with short_loops():
            function.compile(types)
        return function
