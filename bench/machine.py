"""On what was measured."""

from __future__ import annotations

import os
import platform
import subprocess
from pathlib import Path

from .compiler import compiler

CACHES = Path("/sys/devices/system/cpu/cpu0/cache")


def machine() -> dict[str, str]:
    """Return processor, caches, versions and load, in words."""
    import numba
    import numpy

    return {
        "processor": f"{_processor()}, {os.cpu_count()} cores",
        "caches": _caches(),
        "Python": platform.python_version(),
        "numba": numba.__version__,
        "NumPy": numpy.__version__,
        "compiler": _compiler(),
        "load average": f"{os.getloadavg()[0]:.1f} before the run" if hasattr(os, "getloadavg") else "unknown",
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def _caches() -> str:
    """Return name and size of each cache of the first core."""
    found = []
    for folder in sorted(CACHES.glob("index*")):
        level, kind, size = ((folder / name).read_text().strip() for name in ("level", "type", "size"))
        if kind != "Instruction":
            found.append(f"L{level} {size}")
    return " ".join(found) or "unknown"


def _compiler() -> str:
    try:
        told = subprocess.run([compiler(), "--version"], check=True, stdout=subprocess.PIPE, text=True).stdout
        return told.splitlines()[0]
    except (OSError, subprocess.CalledProcessError, IndexError):
        return "none"
