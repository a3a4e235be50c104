"""What Python advises in its words, the command line advises in options; and neither what is in use already."""

from pathlib import Path

import numpy as np
import pytest

import driftwise as dw
from driftwise.analysis.remedies import for_bars, memories
from driftwise.cli import specs
from driftwise.report.advice_translation import PHRASES, WORDS, spoken


class Run:
    def __init__(self, est):
        self.estimator = est


def test_every_phrase_is_one_that_the_library_says():
    folder = Path(dw.__file__).parent
    files = (f for f in folder.rglob("*.py") if f.name != "spoken.py" and "reproduce" not in f.parts)
    text = " ".join(file.read_text().replace("{{", "{").replace("}}", "}") for file in files)
    text = " ".join(text.replace('"\n', "\n").split())  # sentences over two lines
    text = text.replace(' f"', " ").replace(' "', " ")
    missing = [said for said in PHRASES if " ".join(said.split()) not in text]
    assert not missing


def test_words_are_those_that_the_options_take():
    for said, word in WORDS.items():
        if not said.startswith(("Unknown", "Output", "Equation")):
            assert type(specs.memory(word.replace(":Q", ":1e-6"))).__name__ == said.split("(")[0]


@pytest.mark.parametrize(
    "said, instead",
    [
        ("try memory=AutoMemory()", "try --memory auto"),
        ("to drift (memory=RandomWalk(q) or RestartOnChange())", "to drift (--memory random-walk:Q or restart)"),
        ("try noise=UnknownPolynomial(), or a higher order", "try --noise unknown, or a higher order"),
        ("try AR(3, memory=AutoMemory())", "try --model ar:3 --memory auto"),
        ("both can be the time; say which: columns={'time': 'a b'}",
         "both can be the time; call one of them time in the header, and leave the other out"),
        ("a dict() and memory=Mine() stay", "a dict() and memory=Mine() stay"),
    ],
)  # fmt: skip
def test_python_words_become_options(said, instead):
    assert spoken(said) == instead


def test_neither_the_memory_in_use_nor_one_it_cannot_have_is_advised():
    for value in (0.5, 2.0):
        assert "AutoMemory" in for_bars(value, Run(dw.ARX(2, 2, memory=dw.Constant())))
        assert "AutoMemory" not in for_bars(value, Run(dw.ARX(2, 2, memory=dw.AutoMemory())))
    assert memories(dw.Joint(3, 1), "memory=RestartOnChange()") == "memory=RestartOnChange() or AutoMemory()"
    assert memories(dw.Joint(3)) == "memory=AutoMemory()"


@pytest.fixture
def bent(tmp_path):
    """A table whose plant changes half-way, so that a run has something to advise."""
    rng = np.random.default_rng(3)
    y, u = np.zeros(400), rng.standard_normal(400)
    for t in range(1, 400):
        y[t] = (0.3 if t < 200 else 0.9) * y[t - 1] + u[t - 1] + 0.1 * rng.standard_normal()
    file = tmp_path / "bent.csv"
    file.write_text("u,y\n" + "".join(f"{a},{b}\n" for a, b in zip(u, y)))
    return file


def test_a_run_says_options_on_the_terminal_on_the_page_and_as_json(call, bent, tmp_path):
    page, results = tmp_path / "page.html", tmp_path / "results.json"
    code, out, err = call("run", bent, "-o", "y", "-i", "u", "-n", 1, "--report", page, "--json", results)
    out = " ".join(out.split())
    assert code == 0, err
    assert "try --memory restart or auto" in out
    for text in (out, page.read_text(), results.read_text()):
        assert "AutoMemory()" not in text and "RestartOnChange()" not in text


@pytest.mark.parametrize(
    "memory, words",
    [
        ("exponential:0", "--model arx:1,1 --memory exponential:0: lam must be a positive finite number, got 0.0"),
        ("matching:foo", "--model arx:1,1 --memory matching:foo: rule must be one of"),
        ("window:2", "a window of 2 samples cannot learn 3 parameters and the variance of the noise: it needs"),
    ],
)
def test_a_wrong_number_names_its_option(call, bent, memory, words):
    code, out, err = call("run", bent, "-o", "y", "-i", "u", "--model", "arx:1,1", "--memory", memory)
    assert (code, out) == (2, "") and words in err and "variance=" not in err


def test_a_table_without_positions_is_told_what_the_header_must_say(call, bent):
    code, _, err = call("track", bent)
    assert code == 1 and "columns={" not in err and "Call them so in the header of the table" in err


def test_flags_take_no_value_in_the_help(call):
    for command in (["run"], ["track"], ["fleet", "run"]):
        lines = [line for line in call(*command, "--help")[1].splitlines() if "<bool>" in line]
        assert all("--help" in line for line in lines)
