"""The benchmarks' own arithmetic: numbers that count, and the page."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import driftwise as dw
from bench import against, page, verdicts
from bench.counting import Counted, counted, counting, work
from bench.groups import PARTS
from bench.lanes import operations

LATENCY = {"sum": 1.0, "product": 10.0, "division": 100.0}


def test_numbers_count_and_know_when_they_are_ready():
    with counting(LATENCY) as done:
        a, b = counted([2.0, 3.0])
        found = (a * b + 1.0) / (b - 0.5)
    assert done == {"product": 1, "sum": 2, "division": 1}
    assert found.value == 7.0 / 2.5
    assert found.ready == 10.0 + 1.0 + 100.0, "the difference is ready long before"


def test_free_operands_are_not_counted():
    with counting(free={"product": (1.0,)}) as done:
        Counted(1.0) * Counted(5.0) * 2.0
    assert done["product"] == 1


@pytest.mark.parametrize("est", [dw.AR(1), dw.ARX(2, 2), dw.Joint(1)], ids=repr)
def test_the_counted_step_is_the_step(est, monkeypatch):
    """The plain step on counting numbers gives the bits of the compiled one, and works as hard at every sample."""
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=24, noise_std=0.1, seed=1)
    us = u.reshape(-1, 1) if est.model.inputs else np.empty((24, 0))
    before = est.scan(y[:16], us[:16] if est.model.inputs else None)
    seen = []
    loops = work.__globals__["compile"]
    plain = loops.plain_driver

    def listen(*kinds):
        drive = plain(*kinds)

        def take(rows, ys, us, outs, *rest):
            drive(rows, ys, us, outs, *rest)
            seen.append([float(x) for x in outs[0, 0]])

        return take

    monkeypatch.setattr(loops, "plain_driver", listen)
    asked = work(est, y[16:, None], us[16:], before.state, LATENCY)
    trace = est.scan(y[16:], us[16:] if est.model.inputs else None, state=before.state)
    assert np.array_equal([row[0] for row in seen], trace.prediction)
    assert np.array_equal([row[1] for row in seen], trace.innovation)
    assert asked.operations > 5 * est.model.N
    assert 0 < asked.chain < asked.done["division"] * 100 + asked.done["sum"] + asked.done["product"] * 10


def test_a_dense_filter_works_harder():
    n = 3
    assert operations(n) < 4 * (2 * n) ** 3 + 7 * (2 * n) ** 2


def findings():
    kept = verdicts.at_most("time", 1.0, 2.0, "us", "a.py").beside("slow one", 0.5, "never shown")
    missed = verdicts.at_least("rate", 0.4, 1.0, "million/s", "b.py", "busy").beside("C", 3.25, "nothing checked")
    plain = verdicts.for_information("size", 12345.0, "bytes", "c.py").beside("fast one", 7.0, "one thin call")
    table = verdicts.Table("Growth", ("n", "ns"), [(1, 2.5), (2, None)], "Text.")
    return [(PARTS[0], kept), (PARTS[1], missed), (PARTS[1], table), (PARTS[1], plain)]


def test_page_tells_what_was_missed_and_who_is_faster():
    text = page.page(findings(), {"processor": "one"})
    assert "1 budgets met, 1 missed; 1 numbers" in text
    missed = text.split("## What was missed")[1].split("##")[0]
    assert "| rate | 0.4 | >= 1 million/s | **missed** | busy |" in missed
    assert "time" not in missed
    faster = text.split("## Where others are still faster")[1].split("##")[0]
    assert faster.index("fast one") < faster.index("| C |"), "the farthest ahead first"
    assert "| C | rate | 3.25 x | nothing checked |" in faster
    assert "never shown" not in text
    assert "| size | 12345 bytes |" in text
    assert "### Growth" in text
    assert "| n | ns |\n| ---: | ---: |\n| 1 | 2.5 |\n| 2 | - |" in text


def test_page_without_losses_says_so():
    text = page.page(findings()[:1], {})
    assert "Nowhere in this run." in text
    assert "What was missed" not in text


def test_json_has_machine_verdicts_and_tables(tmp_path):
    path = tmp_path / "bench.json"
    verdicts.write(path, {"processor": "one"}, {"ways": 1.5}, [one for _, one in findings()])
    told = json.loads(path.read_text())
    assert told["machine"] == {"processor": "one"}
    assert [row["pass"] for row in told["verdicts"]] == [True, False, True]
    assert told["verdicts"][1]["rival"] == "C" and told["verdicts"][1]["ahead"] == 3.25
    assert told["tables"][0]["rows"] == [[1, 2.5], [2, None]]


def test_a_budget_not_measured_is_missed():
    assert not verdicts.not_measured("speed", "<= 1 us", "a.py", "no compiler").kept
    assert verdicts.not_measured("speed", "no budget (x)", "a.py", "no compiler").kept


@pytest.mark.parametrize("word", ["--help", "--folder"])
def test_no_option_is_taken_for_a_folder(word, tmp_path):
    """`python -m bench.first` installs 600 MB into a folder that it is given, not into one called --help."""
    root = Path(__file__).parents[1]
    line = [sys.executable, "-m", "bench.first", word]
    done = subprocess.run(line, cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(root)}, capture_output=True)
    assert done.returncode == (0 if word == "--help" else 2)
    assert not list(tmp_path.iterdir())


def test_a_call_is_timed_with_the_package_of_a_folder(tmp_path):
    timed = against.Package(against.HERE / "src", tmp_path)
    seconds, wrong = timed("raw ARX(2,2)"), timed("no such call")
    timed.close()
    assert 1e-5 < seconds < 10, seconds
    assert wrong.startswith("KeyError")
