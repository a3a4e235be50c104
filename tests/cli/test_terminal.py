"""What is printed: nothing of the data steers a terminal, and lines are as long as it is wide."""

import ast
import re
import subprocess
import sys
import unicodedata
from pathlib import Path

import numpy as np
import pytest

import driftwise as dw
from driftwise.report.printed import as_json, visible

PACKAGE = Path(dw.__file__).parent
EVIL = "\x1b[31m\x9b2J\x07\u202e\x7f[/red]\udc80"  # colours, clears the screen, rings, turns, is no text at all
NAME = EVIL.replace("\udc80", "")  # what a table can hold


def obeyed(text):
    """Return the characters that a terminal does not show."""
    return {c for c in text if unicodedata.category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp") and c != "\n"}


@pytest.fixture
def hostile(tmp_path):
    """A table whose name, columns and keys are an attacker's."""
    y, u = dw.simulate([-0.8], [1.0], samples=300, noise_std=0.1, seed=1)
    lines = [f"t,y{NAME},u{NAME},k{NAME},w{NAME}"]
    cells = [f"{t},{y[t]:.6f},{u[t]:.6f},{'ab'[t % 2]}{NAME},{NAME if t == 9 else t * t % 17}" for t in range(300)]
    path = tmp_path / f"table{NAME.replace('/', '')}.csv"
    path.write_text("\n".join([*lines, *cells]) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "options",
    [
        [],
        ["-o", f"y{NAME}", "-i", f"u{NAME}"],
        ["-o", f"y{NAME}", "-i", f"w{NAME}", "-n", "1", "--json", "-"],
        ["-o", f"z{NAME}"],
        ["-o", f"y{NAME}", "-t", f"k{NAME}"],
        ["-o", f"y{NAME}", "--model", f"arx{NAME}"],
        [f"--{NAME}"],
        [NAME],
        ["-o", f"y{NAME}", "--report", f"nowhere{NAME}/r.html"],
    ],
)
def test_nothing_of_a_table_steers_the_terminal(hostile, call, options):
    code, out, complaint = call("run", hostile, *options)
    assert code in (0, 1, 2) and out + complaint
    assert not obeyed(out) and not obeyed(complaint)
    assert any(form in out + complaint for form in ("\u241b[31m", "\\u001b[31m", "\\x1b[31m"))


def test_nothing_of_other_commands_either(hostile, call, tmp_path):
    columns = ["-o", f"y{NAME}", "-i", f"u{NAME}"]
    for words in (
        ["compare", hostile, *columns, "arx:1,1", "last"],
        ["validate", hostile, *columns, "--model", "arx:1,1"],
        ["fleet", "run", hostile, "--by", f"k{NAME}", *columns, "--out", tmp_path / f"out{NAME.replace('/', '')}"],
        ["fleet", "show", tmp_path / f"out{NAME.replace('/', '')}"],
        ["track", hostile],
    ):
        _, out, complaint = call(*words)
        assert out + complaint, words
        assert not obeyed(out) and not obeyed(complaint), words


def test_a_name_that_is_no_text_is_refused_in_a_sentence(call, tmp_path):
    path = tmp_path / f"table{EVIL.replace('/', '')}.csv"
    path.write_text("y\n1\n2\n")
    code, out, complaint = call("run", path)
    assert code in (1, 2) and "is not text" in complaint and not obeyed(out + complaint)


def test_json_says_the_same():
    import json

    text = as_json({EVIL: [EVIL, 1.0]}, 2)
    assert json.loads(text) == {EVIL: [EVIL, 1.0]} and not obeyed(text)
    assert visible("tab\tline\nµ − 気温 🙂") == "tab\tline\nµ − 気温 🙂"


def test_there_is_one_way_to_the_terminal():
    """Nothing in the package prints but by `report.printed`; a build's log and a board's see no data."""
    found = []
    for path in PACKAGE.rglob("*.py"):
        if path.relative_to(PACKAGE).as_posix() in ("report/printed.py", "export/board.py", "cli/stock.py"):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name | ast.Attribute):
                continue
            name = ast.unparse(node.func)
            if name in ("print", "typer.echo", "typer.secho", "Console", "sys.stderr.write"):
                found.append(f"{path}:{node.lineno}")
            if (
                name == "sys.stdout.write"
                and ast.unparse(node.args[0]) not in ("text", "line(told)")
                and not (ast.unparse(node.args[0]).startswith("line("))
            ):
                found.append(f"{path}:{node.lineno}")
    assert not found


# --- width -----------------------------------------------------------------------------------------------------


@pytest.fixture
def narrow(monkeypatch, call):
    """Call a command on a terminal of 40 columns; return what was printed, no line of it longer."""
    for name, value in dict(COLUMNS="40", FORCE_COLOR="1", NO_COLOR="1", TERM="xterm").items():
        monkeypatch.setenv(name, value)

    def run(*words, code=0):
        done, out, complaint = call(*words)
        assert done == code, complaint
        out, complaint = (re.sub(r"\x1b\[[\d;]*m", "", text) for text in (out, complaint))
        for line in (out + complaint).splitlines():
            assert len(line) <= 40 or max(map(len, line.split())) > 40, line  # a path stays whole
        return out + complaint

    return run


@pytest.fixture
def plant(tmp_path):
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=400, noise_std=0.1, seed=1)
    path = tmp_path / "a_plant_with_a_rather_long_name.csv"
    rows = np.column_stack([np.arange(400), y, u, np.arange(400) % 2])
    np.savetxt(path, rows, delimiter=",", header="t,flow_of_the_pump,speed_of_the_pump,k", comments="")
    return path


COLUMNS = ("-o", "flow_of_the_pump", "-i", "speed_of_the_pump")


def test_lines_are_as_long_as_the_terminal_is_wide(narrow, plant, tmp_path):
    report = tmp_path / "report.html"
    said = narrow("run", plant, *COLUMNS, "--orders", "1-3", "--report", report)
    assert str(report) in said.split()
    narrow("run", plant)
    narrow("fleet", "run", plant, "--by", "k", *COLUMNS, "--out", tmp_path / "out")
    narrow("run", plant, "-o", "no such column", code=1)
    narrow("run", plant, "--model", "nonsense", *COLUMNS, code=2)
    narrow("simulate", tmp_path / "sim.csv", "--samples", 100)
    narrow("fleet", "simulate", tmp_path / "pumps", "--series", 60, "--samples", 60)


def test_a_table_that_is_too_wide_is_a_list_in_which_no_number_is_cut(narrow, plant, call, monkeypatch):
    said = narrow("run", plant, *COLUMNS, "--orders", "1-3")
    assert "\u2026" not in said.replace("0.8\u2026", "").partition("NIS")[0]
    for order in "123":
        assert f"order {order}\n" in said
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.delenv("FORCE_COLOR")
    _, wide, _ = call("run", plant, *COLUMNS, "--orders", "1-3")
    row = next(line for line in wide.splitlines() if line.strip().startswith("2 "))
    assert all(cell in said for cell in row.split())


def test_a_table_of_tracks_and_of_estimators_likewise(narrow, plant, tmp_path):
    said = narrow("compare", plant, *COLUMNS, "arx:1,1", "arx:2,2", "last")
    assert "estimator arx:2,2\n" in said and "fit %" in said
    rng = np.random.default_rng(1)
    lines = ["time,name,east,north"]
    for t in range(60):
        lines += [f"{4 * t},{n},{100 * t + 9 * rng.standard_normal()},{k * 5000 + 9 * rng.standard_normal()}"
                  for k, n in enumerate(("A long name", "B"))]  # fmt: skip
    path = tmp_path / "plots.csv"
    path.write_text("\n".join(lines) + "\n")
    said = narrow("track", path)
    assert "track A long name" in said and "\u2026" not in said


def test_a_program_that_reads_along_is_no_terminal():
    """`main` within a process whose standard output is a text in memory."""
    code = """
import contextlib, io, sys
from driftwise.cli.entry import main
sys.argv = ["driftwise", "--version"]
with contextlib.redirect_stdout(io.StringIO()) as text, contextlib.suppress(SystemExit):
    main()
assert text.getvalue().startswith("driftwise "), text.getvalue()
"""
    subprocess.run([sys.executable, "-c", code], check=True)
