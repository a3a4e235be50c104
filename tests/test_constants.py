"""Every number that was chosen stands in one file, whose history is that of the choices."""

import ast
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[1] / "scripts" / "constants.py"


def test_the_file_has_the_numbers_of_the_code():
    assert subprocess.run([sys.executable, SCRIPT, "--check"]).returncode == 0, f"run {SCRIPT.name}"


def test_choices_are_listed_and_names_of_places_are_not(monkeypatch):
    monkeypatch.syspath_prepend(str(SCRIPT.parent))
    from constants import chosen

    code = 'RATE = 1e-3\nA, B = 0.5, log(2.0)\nFIRST, SECOND = 0, 1\nX, Y = range(2)\nUNITS = {"km": 1e3}\nhere = 3.0\n'
    assert chosen(ast.parse(code)) == ["RATE = 0.001", "A, B = (0.5, log(2.0))"]
