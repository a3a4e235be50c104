"""`driftwise live` as a process of its own, for the tests that kill it, ask it to end, or ask it to read again."""

from __future__ import annotations

import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path


def started(config: Path, **more) -> subprocess.Popen:
    """Return the service, started with a configuration."""
    return subprocess.Popen([sys.executable, "-m", "driftwise", "live", str(config)], text=True, **more)


def listening(process: subprocess.Popen) -> None:
    """Wait until it is our program that hears signals, and no longer Python's start."""
    heard = 1 << (signal.SIGTERM - 1)
    while not int(Path(f"/proc/{process.pid}/status").read_text().partition("SigCgt:")[2].split()[0], 16) & heard:
        time.sleep(0.01)


def ended(process: subprocess.Popen) -> int:
    """Ask a service to end; return its exit code."""
    listening(process)
    process.send_signal(signal.SIGTERM)
    return process.wait(60)


def asked(folder: Path, question: str) -> list:
    """Return the rows that answer a question to the store; none while it is being made."""
    path = folder / "store" / "live.sqlite"
    if not path.exists():
        return []
    with sqlite3.connect(path) as base:
        try:
            return base.execute(question).fetchall()
        except sqlite3.OperationalError:
            return []


def samples(folder: Path) -> int:
    """Return how many samples are in the store."""
    return sum(row[0] or 0 for row in asked(folder, "SELECT SUM(LENGTH(numbers)) FROM recent")) // 48
