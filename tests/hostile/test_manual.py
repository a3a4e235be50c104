"""Commands that docs/SECURITY.md and the pages of help allow, and that once broke a promise."""

import json
import os
import subprocess
import sys

import pytest

TABLE = "t,u,y\n" + "".join(f"{t},{(t * 7) % 5 - 2},{0.5 * ((t * 7 - 7) % 5 - 2)}\n" for t in range(60))
PLOTS = "time,lat,lon,id\n" + "".join(f"{4 * i},{46 + 0.005 * i},{15 + 0.004 * i},A\n" for i in range(30))
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
    ],
)
def test_what_would_be_lost_is_refused_before_the_work(driftwise, tmp_path, args, said):
    (tmp_path / "link").symlink_to(tmp_path / "no" / "such")
    done = driftwise(*args)
    assert done.returncode == 2 and said in done.stderr.decode(), done.stderr
    assert (tmp_path / "t.csv").read_text() == TABLE


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="/dev/full")
def test_a_full_device_is_named(driftwise):
    done = driftwise(*RUN, "--report", "/dev/full")
    assert done.returncode == 1 and "/dev/full: No space left" in done.stderr.decode()


@pytest.mark.skipif(os.name != "posix", reason="a shell that closes streams")
def test_a_closed_standard_input_is_a_sentence(tmp_path):
    command = f"'{sys.executable}' -m driftwise run - <&-"
    done = subprocess.run(["sh", "-c", command], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1 and "standard input is closed" in done.stderr
