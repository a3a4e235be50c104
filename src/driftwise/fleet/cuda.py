"""Samples of many series on a GPU: the rows stay there until they are asked for."""

from __future__ import annotations

import os
import warnings
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np

from ..engine.errors import InputError
from .crew import Crew
from .grouping import group_samples, place

SIMULATOR = "To try it without one, slowly, start Python with NUMBA_ENABLE_CUDASIM=1"


class CudaCrew(Crew):
    """The loop of one form of estimator on a GPU, and the rows that are there.

    Rows are here or there, never in both places: `advance` takes them there, `fetch` brings them back.
    """

    def __init__(self, estimator):
        super().__init__(estimator)
        if estimator.is_observer:
            raise InputError(f"a fleet of {type(estimator).__name__} is the processor's: leave device='cuda' out")
        require_device()
        self._there: Any = None  # rows upright (W, S), so that series stand side by side; their settings; their groups

    def loop(self, columns: int) -> Any:
        """Return the compiled grid that writes so many columns."""
        from ..engine import device

        return device.grid(self.kinds, self.sizes, self.shapes(columns))

    def fetch(self, rows) -> None:
        """Bring the rows back, if they are there: from now on they are here."""
        if self._there is not None:
            rows[:] = self._there[0].copy_to_host().T
            self._there = None

    def advance(self, rows, at, ys, us, specs, group, columns: int) -> np.ndarray:
        """Advance the rows there, sample i belonging to row ``at[i]``; return what each showed, (n, columns)."""
        from numba import cuda

        from ..engine.device import THREADS

        if not len(at):
            return np.empty((0, columns))
        if self._there is None:
            self._there = tuple(map(cuda.to_device, (np.ascontiguousarray(rows.T), specs, group)))
        upright, settings, groups = self._there
        at = np.ascontiguousarray(at, np.int64)
        members, starts, order, is_open = group_samples(at, len(rows))
        if is_open:
            place(at, members, starts, order)
        numbers = map(np.ascontiguousarray, (members, starts, order, ys, us))
        members, *samples = map(cuda.to_device, numbers)
        outs = cuda.device_array((len(at), columns))
        with warnings.catch_warnings():  # few series fill no GPU: it is said in the documentation, once
            warnings.filterwarnings("ignore", "Grid size")
            go = self.loop(columns)[-(-members.size // THREADS), THREADS]
        go(upright, members, *samples, outs, settings, groups)
        return outs.copy_to_host()


def require_device() -> None:
    """Raise InputError with the remedy where no GPU can be used."""
    if os.environ.get("NUMBA_ENABLE_CUDASIM", "0") not in ("", "0"):
        return
    if find_spec("numba_cuda") is None:
        raise InputError(
            f"device='cuda' needs NVIDIA's numba-cuda: pip install driftwise[cuda], where there is a GPU. {SIMULATOR}"
        )
    from numba import cuda

    try:
        import_module("numba.cuda.np.arrayobj")
    except AttributeError as error:
        raise InputError(
            f"numba-cuda does not work with numpy {np.__version__} ({error}): pip install 'numpy<2.5'"
        ) from None
    if not cuda.is_available():
        raise InputError(
            f"device='cuda' finds no GPU that it can use: does nvidia-smi list one? Else leave device out. {SIMULATOR}"
        )
