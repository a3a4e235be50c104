"""What a hostile day tries: a little of it at every change, more in the slow part; see README.md."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]
PART = ["--files", "5", "--troubles", "3", "--disks", "1", "--caches", "0"]
MORE = ["--files", "150", "--troubles", "60", "--disks", "12", "--caches", "5"]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="a command is tried in a forked process")
@pytest.mark.parametrize("part", [PART, pytest.param(MORE, marks=pytest.mark.slow)], ids=["part", "more"])
def test_nothing_breaks_a_promise(part):
    command = [sys.executable, "-m", "tests.hostile", "--seed", "d81f7", *part]  # nothing has begun threads there
    done = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "\n0 of " in done.stdout
