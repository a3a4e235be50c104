"""Memory of this process, in bytes."""

from __future__ import annotations

import resource
from pathlib import Path


def resident() -> float:
    """Return what is resident now where the system tells, else at its peak."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return float(pages * resource.getpagesize())
    except OSError:
        return peak()


def peak() -> float:
    """Return the peak since `forget_peak`, or since the start where the system cannot forget."""
    try:
        status = Path("/proc/self/status").read_text()
        return 1024.0 * int(status.split("VmHWM:")[1].split()[0])
    except OSError:
        return 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def forget_peak() -> float:
    """Return the resident memory, from which `peak` counts on."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        pass
    return peak()
