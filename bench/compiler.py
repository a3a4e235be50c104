"""Opponents written in C, compiled here."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

FLAGS = ("-O3", "-shared", "-fPIC")
NATIVE = "-march=native"


def compiler() -> str:
    """Return the C compiler's name, or raise FileNotFoundError."""
    name = os.environ.get("CC", "gcc")
    if not shutil.which(name):
        raise FileNotFoundError(f"no C compiler called {name}; set CC")
    return name


def library(source: str, *flags: str) -> ctypes.CDLL:
    """Return a C file of this folder as a loaded library; raise OSError where it cannot be had."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "library.so"
        path = Path(__file__).with_name(source)
        try:
            subprocess.run([compiler(), *FLAGS, *flags, "-o", str(target), str(path), "-lm"], check=True)
        except subprocess.CalledProcessError as error:
            raise OSError(f"{compiler()} does not compile {source} on this machine") from error
        return ctypes.CDLL(str(target))  # stays loaded when the file has gone


def pointer(array: np.ndarray) -> ctypes.c_void_p:
    """Return where an array lies."""
    return array.ctypes.data_as(ctypes.c_void_p)
