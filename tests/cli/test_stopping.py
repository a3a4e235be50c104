"""Asked to stop, a command ends in one line, with the exit code of the signal, and leaves files whole or none."""

import json
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from draws import slow

import driftwise as dw
from driftwise.cli import saving

COMMAND = [sys.executable, "-c", "from driftwise.cli import entry; print('.', flush=True); entry.main()"]
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143}
ROWS = 120_000


def stop(number, after, *words):
    """Start a command, ask it to stop so many seconds later; return (exit code, its complaint)."""
    pipe = subprocess.PIPE
    process = subprocess.Popen([*COMMAND, *map(str, words)], stdout=pipe, stderr=pipe, text=True)
    assert process.stdout.readline() == ".\n"
    time.sleep(after)
    process.send_signal(number)
    _, complaint = process.communicate(timeout=60)
    return process.returncode, complaint


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """A table that takes seconds."""
    y, u = dw.simulate([-0.8], [1.0], samples=ROWS, noise_std=0.1, seed=1)
    path = tmp_path_factory.mktemp("long") / "table.csv"
    np.savetxt(path, np.column_stack([y, u, np.arange(len(y)) % 9]), "%.5f", ",", header="y,u,k", comments="")
    return path


@pytest.mark.parametrize("number", CODES)
@pytest.mark.parametrize("after", [0.02, 0.07, 0.2, 0.45, 1.0, *map(slow, (0.04, 0.12, 0.3, 0.6, 1.6))])
def test_a_run_ends_in_one_line(table, tmp_path, number, after):
    code, complaint = stop(number, after, "run", table, "-o", "y", "-i", "u", "--chunk", 2000,
                           "--json", tmp_path / "r.json", "--save", tmp_path / "t.csv")  # fmt: skip
    left = sorted(path.name for path in tmp_path.iterdir())
    rows, is_stopped = ROWS, False
    if "r.json" in left:  # done before, or Ctrl-C while samples came: what was read is told
        told = json.loads((tmp_path / "r.json").read_text())
        rows, is_stopped = told["summary"]["samples"], "stopped early" in " ".join(told["notes"])
    if "t.csv" in left:
        with open(tmp_path / "t.csv") as file:
            assert sum(1 for line in file) == rows + 1
    if code == 0:
        assert complaint == "" and left == ["r.json", "t.csv"] and rows == ROWS and not is_stopped
    else:
        assert (code, complaint) == (CODES[number], "driftwise: stopped\n")
        assert left in ([], ["t.csv"], ["r.json", "t.csv"])


@pytest.mark.parametrize("number", [signal.SIGTERM, slow(signal.SIGINT)])
def test_a_fleet_says_how_to_go_on(table, tmp_path, number):
    words = "fleet", "run", table, "--by", "k", "-o", "y", "-i", "u", "--out", tmp_path / "out", "--batch", 2000
    for after in (1.2, 1.8, 2.5, 3.5, 5.0):
        code, complaint = stop(number, after, *words, "--checkpoint", "1b", *["--resume"] * (after > 1.2))
        if code == 0:
            break
        assert code == CODES[number] and complaint.count("\n") == 1 and "Traceback" not in complaint
        if (tmp_path / "out" / "fleet.parquet").exists():
            assert "go on with it (--resume)" in complaint or complaint == "driftwise: stopped\n"
    done = subprocess.run([*COMMAND, *map(str, words), "--resume"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert not list(tmp_path.rglob(".*.writing"))


def test_a_signal_that_nobody_is_to_hear_is_not_heard(table, tmp_path):
    """As `nohup`, or a shell that puts a command into the background, asks for."""
    short = tmp_path / "short.csv"
    with open(table) as long:
        short.write_text("".join(next(long) for _ in range(5000)))
    shell = f"trap '' INT; exec {sys.executable} -m driftwise run {short} -o y -i u --json {tmp_path / 'r.json'}"
    process = subprocess.Popen(["sh", "-c", shell], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=120)
    assert process.returncode == 0 and (tmp_path / "r.json").exists()


@pytest.mark.parametrize("words", [["run", "-o", "y", "-i", "u"], ["run"]])
def test_stopped_before_a_row_was_saved_it_leaves_nothing(tmp_path, call, monkeypatch, words):
    def interrupted(path):
        raise KeyboardInterrupt

    y, u = dw.simulate([-0.8], [1.0], samples=500, noise_std=0.1, seed=1)
    np.savetxt(tmp_path / "table.csv", np.column_stack([y, u]), "%.5f", ",", header="y,u", comments="")
    monkeypatch.setattr(saving, "_kind", interrupted)
    results = ["--json", tmp_path / "r.json", "--save", tmp_path / "t.csv"]
    code, _, complaint = call(words[0], tmp_path / "table.csv", *words[1:], *results)
    assert (code, complaint) == (130, "driftwise: stopped\n")
    assert [path.name for path in tmp_path.iterdir()] == ["table.csv"]


def test_a_command_that_is_done_is_not_ended_by_a_late_signal():
    """While the interpreter is torn down, which takes milliseconds."""
    code = """
import os, sys
from driftwise.cli import entry

class Late:
    def __del__(self, say=os.write, kill=os.kill, me=os.getpid()):
        say(1, b"late\\n")
        kill(me, 2)
        kill(me, 15)

entry.late = Late()
sys.argv = ["driftwise", "--version"]
entry.main()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "") and done.stdout.endswith("late\n")


@pytest.mark.parametrize("number", CODES)
def test_stopped_where_a_library_loses_it(number):
    """As C extensions do whose functions cannot fail: what was asked for holds, whatever they went on with."""
    code = f"""
import os, sys
from driftwise.cli import entry, main

def run():
    try:
        os.kill(os.getpid(), {int(number)})
    except BaseException:
        pass
    sys.exit(0)

main.main = run
entry.main()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (CODES[number], "driftwise: stopped\n")


@pytest.mark.parametrize("words", [["-o", "y", "-i", "u"], ["--model", "auto", "-o", "y", "-i", "u"]])
def test_stopped_while_samples_come_it_tells_what_it_has_read(tmp_path, call, monkeypatch, words):
    from driftwise.cli.downsample import TraceDownsampler

    def interrupted(self, *more, taken=TraceDownsampler.keep):
        taken(self, *more)
        if self.samples >= 400:
            raise KeyboardInterrupt

    y, u = dw.simulate([-0.8], [1.0], samples=900, noise_std=0.1, seed=1)
    np.savetxt(tmp_path / "table.csv", np.column_stack([y, u]), "%.5f", ",", header="y,u", comments="")
    monkeypatch.setattr(TraceDownsampler, "keep", interrupted)
    code, said, complaint = call("run", tmp_path / "table.csv", *words, "--chunk", 200, "--json", tmp_path / "r.json")
    assert (code, complaint) == (130, "driftwise: stopped\n")
    assert "stopped early" in said and "stopped early" in json.loads((tmp_path / "r.json").read_text())["notes"][0]


def test_stopped_while_a_module_is_imported_that_makes_another_error_of_it():
    """As C extensions do that ask for one another's functions."""
    code = """
import os
from driftwise.cli import entry, main

def run():
    try:
        os.kill(os.getpid(), 15)
    except BaseException:
        raise AttributeError("partially initialized module") from None

main.main = run
entry.main()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (143, "driftwise: stopped\n")
