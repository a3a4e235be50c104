"""What a hostile day tries: a little of it at every change, more in the slow part; see README.md."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from draws import slow

from hostile.trial import ENTRIES, WORDS, Outcome, faults

REPOSITORY = Path(__file__).parents[2]
PART = ["--files", "2", "--troubles", "2", "--disks", "1", "--caches", "0", "--requests", "40", "--tracks", "10"]
MORE = [
    "--files",
    "150",
    "--troubles",
    "60",
    "--disks",
    "12",
    "--caches",
    "5",
    "--requests",
    "2000",
    "--tracks",
    "2000",
]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="a command is tried in a forked process")
@pytest.mark.parametrize("part", [PART, slow(MORE)], ids=["part", "more"])
def test_nothing_breaks_a_promise(part):
    command = [sys.executable, "-m", "tests.hostile", "--seed", "d81f7", *part]  # nothing has begun threads there
    done = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "\n0 of " in done.stdout


@pytest.mark.parametrize(
    "out, wrong",
    [
        ("x" * WORDS, ""),
        ("x" * (WORDS + 1), f"{WORDS + 1} characters were printed"),
        (json.dumps({"rmse": [0.1234567890123456] * ENTRIES, "words": "x" * (WORDS - 9)}, indent=2), ""),
        (json.dumps({"rmse": [0.1] * (ENTRIES + 1)}), f"a list of {ENTRIES + 1} entries was printed"),
        (json.dumps({"a": {"words": "x" * WORDS}}), f"{WORDS + 6} characters were printed"),
        (json.dumps([["x"] * ENTRIES] * ENTRIES), ""),
    ],
    ids=["text", "long text", "json", "a list of samples", "long words in json", "lists of lists"],
)
def test_what_may_be_said(out, wrong):
    outcome = Outcome(["run"], 0, out, "", cpu=0.1, compiled=0.0, peak=0)
    assert faults(outcome, {}) == [wrong] * bool(wrong)
