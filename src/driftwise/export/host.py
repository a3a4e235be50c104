"""The exported C on this machine: compiled, and called sample by sample."""

from __future__ import annotations

import ctypes
import itertools
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from ..engine.compilers import Compiler, compilers
from ..engine.errors import InputError

_count = itertools.count()
FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-ffp-contract=off")


def compiler() -> Compiler | None:
    """Return a C compiler of this machine that has headers, if there is one."""
    return next((one for one in compilers() if not one.is_quick), None)


class Library:
    """An exported estimator on this machine.

    Parameters
    ----------
    source : Source
    folder : where NAME.c and NAME.h are; the compiled file is put beside them
    """

    def __init__(self, source: Any, folder):
        cc = compiler()
        if cc is None:
            raise InputError("there is no C compiler here (gcc or clang): install one")
        name, place = source.name, Path(folder)
        self.path = made = place / f"{name}_{next(_count)}.so"  # a name that was loaded before is not loaded again
        command = [*cc.command, *FLAGS, str(place / f"{name}.c"), "-o", str(made), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            raise InputError(f"{' '.join(command)} failed: {done.stderr.strip().splitlines()[0]}")
        library = ctypes.CDLL(str(made))
        self.source, self.type = source, ctypes.c_float if source.is_single else ctypes.c_double
        self.init, self.update = library[f"{name}_init"], library[f"{name}_update"]
        self.update.restype = ctypes.c_uint32
        sizes = source.start.size, source.columns, source.scratch
        self.state = np.zeros(sum(sizes), np.dtype(self.type))
        self.row, self.out = self.state[: sizes[0]], self.state[sizes[0] : sum(sizes[:2])]
        self.place = ctypes.c_void_p(self.state.ctypes.data)

    def run(self, samples) -> np.ndarray:
        """Begin anew and take all samples; return what each leaves to be asked."""
        source, number, found = self.source, self.type, []
        p, k, many = source.outputs, source.inputs, np.asarray(samples, np.dtype(self.type))
        self.init(self.place)
        for sample in many:
            y, u = sample[:p].copy(), sample[p : p + k].copy()
            given = [ctypes.c_void_p(y.ctypes.data) if source.est.outputs else number(y[0])]
            given += [ctypes.c_void_p(u.ctypes.data)] if k > 1 else [number(v) for v in u]
            given += [number(v) for v in sample[p + k :]]
            self.update(self.place, *given)
            found.append(self.out.copy())
        return np.array(found)
