"""The loop of a fleet on a GPU: the same Python step, one thread for each series.

Import it late: it loads numba. ``NUMBA_ENABLE_CUDASIM=1`` runs the loop uncompiled, one Python thread a series, where
there is no GPU. On a GPU it takes NVIDIA's numba-cuda: in numba's own CUDA target ``max`` no longer compiles (0.68).
"""

from __future__ import annotations

import functools
import hashlib
import pickle
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numba.cuda
from numba import float64

from . import atomic, dispatch, folders, jit
from .compile import crew_key
from .dispatch import advance, open_row, open_scratch, read_all
from .recovery import is_sound, settle
from .views import matrix

cuda: Any = numba.cuda  # the simulator puts its own in this place
THREADS = 64  # of a block: a step takes all 255 registers that a thread can have
_bound: set[Any] = set()


def _make_grid(kinds, sizes, shapes):
    """Return what one thread does. It works on a copy of the row, so that neighbours read neighbouring memory."""
    width, outputs, room = shapes[0], shapes[1], shapes[-1]

    def advance_member(rows, members, starts, order, ys, us, outs, specs, group):
        i = cuda.grid(1)
        if i < members.size:
            row, buffer = cuda.local.array(width, float64), cuda.local.array(room, float64)
            r = members[i]
            for j in range(width):
                row[j] = rows[j, r]
            spec = specs[group[r]]
            form, noise, memory, gate, scale, detector = read_all(kinds, sizes, spec)
            scratch = open_scratch(form, buffer)
            state = open_row(form, row)
            t, count, clock = starts[i], -1.0, 0.0
            while t < starts[i + 1]:
                k = order[t] if order.size else t
                advance(form, noise, memory, gate, scale, detector, state, scratch, ys, us, outs, k)
                t += 1
                if not is_sound(outs[k], outputs) or count >= 0.0:
                    count, clock = settle(row, spec, outs[k], outputs, count, clock)
                    t -= 1 if count >= 0.0 else 0
            for j in range(width):
                rows[j, r] = row[j]

    return advance_member


def signature():
    """Return the types of the loop's arrays."""
    table, index = float64[:, ::1], numba.int64[::1]
    return table, index, index, index, table, table, table, table, index


@functools.cache
def grid(kinds: tuple[type, ...], sizes: tuple[float, ...], shapes: tuple[int, ...]) -> Any:
    """Return the loop ``go[blocks, THREADS](rows, members, starts, order, ys, us, outs, specs, group)``.

    As `compile.crew`, except that the rows stand upright, (W, S), all arrays are on the device, and the samples of the
    i-th member are those that ``order[starts[i] : starts[i + 1]]`` names; an empty order is 0, 1, .. n - 1.
    """
    with jit._lock:
        function = _make_grid(kinds, sizes, shapes)
        if is_simulated():
            return cuda.jit(function)
        loop = cuda.jit(function, lto=False)  # as jit(lto=False)(function) it is forgotten, and products are fused
        _compile(loop, crew_key(kinds, sizes, shapes))
        return loop


def _compile(loop, key: str) -> None:
    """Compile a loop for the GPU that is there, or take what a former process compiled: it takes up to minutes."""
    import numba_cuda

    major, minor = cuda.get_current_device().compute_capability
    path = folders.folder() / f"{key}-{major}{minor}-{numba_cuda.__version__}.cuda"
    kernel = _kept(path)
    if kernel is not None:
        loop.add_overload(kernel, signature())
        return
    bind()
    with unfused():
        loop.compile(signature())
    code = pickle.dumps(*loop.overloads.values())
    with suppress(OSError), atomic.replaced(path) as beside:  # a disk that is full
        Path(beside).write_bytes(hashlib.sha256(code).digest() + code)


def _kept(path: Path) -> Any:
    """Return the kernel in a file, None where there is none or it is damaged."""
    with suppress(OSError):
        data = path.read_bytes()
        if hashlib.sha256(data[32:]).digest() == data[:32]:
            folders.touch(path)
            return pickle.loads(data[32:])
    return None


def assembly(kinds, sizes, shapes, capability=(9, 0)) -> str:
    """Return the loop as PTX, the assembly language of NVIDIA's GPUs: for looking at, no GPU is needed."""
    from types import SimpleNamespace

    from numba.cuda import dispatcher

    before = dispatcher.get_current_device
    with jit._lock, unfused():
        bind()
        dispatcher.get_current_device = lambda: SimpleNamespace(compute_capability=capability)
        try:
            return cuda.compile_ptx(_make_grid(kinds, sizes, shapes), signature(), cc=capability)[0]
        finally:
            dispatcher.get_current_device = before


def is_simulated() -> bool:
    """Say whether numba was started with NUMBA_ENABLE_CUDASIM=1."""
    from numba import config

    return bool(getattr(config, "ENABLE_CUDASIM", False))


@contextmanager
def unfused():
    """Round every product before it is added to, as the CPU does; numba has no option for what NVVM calls ``fma``."""
    from numba.cuda.cudadrv import nvvm

    before = nvvm.compile_ir
    nvvm.compile_ir = functools.partial(before, fma=False)
    try:
        yield
    finally:
        nvvm.compile_ir = before


# --- teaching numba-cuda -----------------------------------------------------------------------------------


def bind() -> None:
    """Teach numba's CUDA target every marked function, as `compile` does for the CPU."""
    from numba.extending import overload

    for function, resolve in dispatch.resolvers():
        if function not in _bound:
            overload(function, target="cuda", strict=False)(resolve)
            _bound.add(function)
    if "views" not in _bound:
        _bind_views()
        _bound.add("views")


def _bind_views() -> None:
    """Let numbers in a row be seen as a table without a call, so that the compiler knows its sizes."""
    from numba import types
    from numba.cuda.core import imputils
    from numba.cuda.descriptor import cuda_target
    from numba.cuda.extending import type_callable  # type: ignore[attr-defined]  # numba-cuda has it
    from numba.cuda.np import arrayobj

    type_callable(matrix)(lambda context: lambda flat, rows, columns: types.Array(flat.dtype, 2, "C"))
    registry = imputils.Registry("driftwise")

    def fold(context, builder, signature, values):
        kinds, kind = signature.args, signature.return_type
        old, new = context.make_array(kinds[0])(context, builder, values[0]), context.make_array(kind)(context, builder)
        shape = [context.cast(builder, v, k, types.intp) for v, k in zip(values[1:], kinds[1:])]
        known = functools.reduce(builder.mul, shape)  # negative where one size is -1: whatever is left
        left = builder.sdiv(old.nitems, builder.neg(known))
        shape = [builder.select(builder.icmp_signed("<", size, size.type(0)), left, size) for size in shape]
        step = old.itemsize
        strides: list[Any] = []
        for size in shape[::-1]:
            strides.insert(0, step)
            step = builder.mul(step, size)
        arrayobj.populate_array(new, old.data, shape, strides, old.itemsize, old.meminfo, old.parent)
        return imputils.impl_ret_borrowed(context, builder, kind, new._getvalue())

    registry.lower(matrix, types.Array, types.Integer, types.Integer)(fold)
    for dimensions in (2, 3):
        registry.lower("array.reshape", types.Array, *[types.Integer] * dimensions)(fold)
    cuda_target.target_context.refresh()  # what is its own first
    cuda_target.target_context.install_registry(registry)
