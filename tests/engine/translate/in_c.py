"""Kernels in C, for tests: translated, compiled by whatever compiler is here, called through ctypes."""

from __future__ import annotations

import ctypes
import itertools
import shutil
import subprocess
from pathlib import Path

import numpy as np

from driftwise.engine.translate.c99 import Printer
from driftwise.engine.translate.program import Program
from driftwise.engine.translate.types import FLOAT, INT, View

STRICT = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function"]
PLAIN = ["-ffp-contract=off", "-fno-math-errno"]
COMPILERS = {"gcc": [*STRICT, "-O1", *PLAIN], "clang": [*STRICT, "-O1", *PLAIN], "tcc": []}
HERE = [name for name in COMPILERS if shutil.which(name)]
_count = itertools.count()


def types(dimensions):
    """Return the types of arguments as `compile` names them: int, float, "index", or how many axes an array has."""
    known = {int: INT, float: FLOAT, "index": View(1, INT)}
    return [known.get(one) or View(one) for one in dimensions]


def translated(function, dimensions, kernels=(), checked=False) -> str:
    """Return a function in C; ``kernels`` are those that it may call, besides driftwise's own."""
    program = Program()
    program.resolvers.update({known: lambda *_, known=known: known for known in kernels})
    entry = program.function(function, types(dimensions))
    return Printer(checked=checked).program(entry, "go", dimensions)


def loaded(text: str, folder: Path, compiler: str, dimensions, flags=()):
    """Return a C file as a function of arrays and numbers."""
    source = folder / f"kernels_{next(_count)}.c"
    source.write_text(text)
    built = source.with_suffix(".so")
    command = [compiler, *COMPILERS[compiler], *flags, "-shared", "-fPIC", str(source), "-o", str(built)]
    done = subprocess.run([*command, "-lm"], capture_output=True, text=True)
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stderr[:3000]}"
    entry = ctypes.CDLL(str(built)).go
    entry.restype = ctypes.c_longlong

    def call(*args):
        places, numbers, kept = (ctypes.c_void_p * max(len(args), 1))(), [], []
        for i, (one, kind) in enumerate(zip(args, dimensions)):
            if kind is int:
                numbers.append(int(one))
                continue
            array = np.array([one], float) if kind is float else one
            assert array.flags.c_contiguous and (kind is float or array.ndim == (1 if kind == "index" else kind))
            assert array.dtype == (np.int64 if kind == "index" else np.float64)
            kept.append(array)
            places[i] = array.ctypes.data
            numbers += [] if kind is float else array.shape
        return entry(places, (ctypes.c_longlong * max(len(numbers), 1))(*numbers))

    return call


def alike(a, b) -> bool:
    """Say whether two arrays have the same bits; a NaN is a NaN."""
    a, b = (np.where(np.isnan(one), np.nan, one) for one in (np.asarray(a, float), np.asarray(b, float)))
    return a.tobytes() == b.tobytes()
