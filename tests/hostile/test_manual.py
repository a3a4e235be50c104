"""Commands that docs/SECURITY.md and the pages of help allow, and that once broke a promise."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from driftwise.engine.errors import InputError
from driftwise.fleet.spark.masters import refuse
from driftwise.tracking.read import read_plots

TABLE = "t,u,y\n" + "".join(f"{t},{(t * 7) % 5 - 2},{0.5 * ((t * 7 - 7) % 5 - 2)}\n" for t in range(60))
PLOTS = "time,lat,lon,id\n" + "".join(f"{4 * i},{46 + 0.005 * i},{15 + 0.004 * i},A\n" for i in range(30))
FLEET = ["fleet", "run", "t.csv", "--by", "u", "-o", "y"]
RUN = ["run", "t.csv", "-o", "y", "-i", "u", "--model", "arx:1,1,1"]


@pytest.fixture
def driftwise(tmp_path):
    def call(*args, **environment):
        return subprocess.run(
            [sys.executable, "-m", "driftwise", *args], cwd=tmp_path, capture_output=True,
            env={**os.environ, **environment}, close_fds=True, timeout=100,
        )  # fmt: skip

    (tmp_path / "t.csv").write_text(TABLE)
    (tmp_path / "p.csv").write_text(PLOTS)
    return call


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8"])
def test_a_terminal_that_lacks_letters_gets_them_spelled(driftwise, encoding):
    done = driftwise(*RUN, PYTHONIOENCODING=encoding)
    assert done.returncode == 0 and b"Traceback" not in done.stderr and done.stdout.decode(encoding)
    done = driftwise(*RUN, "--json", "-", PYTHONIOENCODING=encoding)
    assert done.returncode == 0 and json.loads(done.stdout.decode(encoding))["columns"]["output"] == "y"


@pytest.mark.parametrize(
    "args, said",
    [
        ([*RUN, "--report", ""], "--report wants the name of a file"),
        ([*RUN, "--report", "-"], "--report wants the name of a file"),
        ([*RUN, "--report", "link"], "--report: there is no folder"),
        (["track", "p.csv", "--sites", "t.csv", "--json", "t.csv"], "--json would overwrite what is being read"),
        (["fleet", "run", "t.csv", "--by", "t", "-o", "y", "--out", "o", "--json", "t.csv"], "--json would overwrite"),
        (["track", "tracks.csv", "--out", "."], "--out would overwrite what is being read, ./tracks.csv"),
        (["track", "tr*.csv", "--out", "."], "--out would overwrite what is being read, ./tracks.csv"),
        (
            ["track", "p.csv", "--out", ".", "--report", "tracks.csv"],
            "--report and --out would both write ./tracks.csv",
        ),
        ([*FLEET, "--out", "mine"], "mine/summary.html was not written by a run of a fleet"),
        ([*FLEET, "--out", "mine", "--replace"], "mine/summary.html was not written by a run of a fleet"),
        (["fleet", "run", ".", *FLEET[3:], "--out", "here/below"], "--out here/below lies in the folder of the data"),
        ([*FLEET, "--out", "o", "--spark", "nonsense"], "--spark: 'nonsense' is no master of Spark"),
        ([*RUN, "--save", "pipe.parquet"], "pipe.parquet is a pipe, and Parquet is written to and fro"),
        (
            [*RUN, "--smooth", "all", "--save", "pipe.csv"],
            "pipe.csv is a pipe, and what is smoothed is added to a file",
        ),
    ],
)
def test_what_would_be_lost_is_refused_before_the_work(call, tmp_path, monkeypatch, args, said):
    written = {"t.csv": TABLE, "p.csv": PLOTS, "tracks.csv": PLOTS, "mine/summary.html": "mine"}
    (tmp_path / "mine").mkdir()
    for name, text in written.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "link").symlink_to(tmp_path / "no" / "such")
    if "pipe" in said and not hasattr(os, "mkfifo"):
        pytest.skip("pipes with names")
    for name in ("pipe.csv", "pipe.parquet") if "pipe" in said else ():
        os.mkfifo(tmp_path / name)
    monkeypatch.chdir(tmp_path)
    code, out, complaint = call(*args)
    assert code == 2 and not out and said in complaint, complaint
    assert {name: (tmp_path / name).read_text() for name in written} == written


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="/dev/full")
def test_a_full_device_is_named(driftwise):
    done = driftwise(*RUN, "--report", "/dev/full")
    assert done.returncode == 1 and "/dev/full: No space left" in done.stderr.decode()


@pytest.mark.skipif(os.name != "posix", reason="a shell that closes streams")
def test_a_closed_standard_input_is_a_sentence(tmp_path):
    command = f"'{sys.executable}' -m driftwise run - <&-"
    done = subprocess.run(["sh", "-c", command], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1 and "standard input is closed" in done.stderr


def test_a_table_that_no_run_wrote_is_not_deleted(call, tmp_path, monkeypatch):
    (tmp_path / "t.csv").write_text(TABLE)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "final.parquet").write_text("mine")
    monkeypatch.chdir(tmp_path)
    code, _, complaint = call(*FLEET, "--out", "mine", "--replace")
    assert code == 1 and "but mine/final.parquet: whose is it?" in complaint
    assert (tmp_path / "mine" / "final.parquet").read_text() == "mine"


def test_a_terminal_of_no_width_or_of_any_is_written_to(driftwise):
    done = driftwise("run", "--help", COLUMNS="9" * 30, TERMINAL_WIDTH="wide")
    assert done.returncode == 0 and 2000 < len(done.stdout) < 200_000 and not done.stderr
    done = driftwise(*RUN, COLUMNS="0")
    assert done.returncode == 0 and len(done.stdout) > 1000


def test_an_engine_that_there_is_not_is_a_sentence(driftwise):
    done = driftwise(*RUN, DRIFTWISE_ENGINE="nonsense")
    assert done.returncode == 2 and b"DRIFTWISE_ENGINE is c, numba or python, got 'nonsense'" in done.stderr


@pytest.mark.parametrize(
    "master, said",
    [
        ("local[0]", "is no master of Spark"),
        ("spark://", "is no master of Spark"),
        ("spark://here:99999", "is no master of Spark"),
        ("spark://127.0.0.1:9,127.0.0.1:19", "no master of Spark answers"),
    ],
)
def test_a_cluster_that_there_is_not_is_a_sentence_without_java(master, said):
    with pytest.raises(InputError, match=said):
        refuse(master)


def test_plots_beyond_every_number_are_told(tmp_path):
    (tmp_path / "far.csv").write_text("time,east,north\n" + "".join(f"{i},1e120,1\n" for i in range(9)))
    with pytest.raises(InputError, match="'east' is no number below 1e100: '1e120'"):
        read_plots(tmp_path / "far.csv")


@pytest.mark.skipif(os.name != "posix", reason="pipes with names")
def test_a_pipe_that_nobody_reads_is_left_on_sigterm(tmp_path):
    (tmp_path / "t.csv").write_text(TABLE)
    os.mkfifo(tmp_path / "pipe.csv")
    words = [sys.executable, "-m", "driftwise", *RUN, "--save", "pipe.csv"]
    with subprocess.Popen(words, cwd=tmp_path, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as running:
        time.sleep(4.0)
        running.send_signal(signal.SIGTERM)
        try:
            _, complaint = running.communicate(timeout=20)
        finally:
            running.kill()
    assert (running.returncode, complaint) == (143, "driftwise: stopped\n")
