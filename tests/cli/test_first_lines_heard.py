"""`driftwise track --listen` loses nothing that it read: by Ctrl-C in the first lines, by a line without an end."""

import json
import os
import signal
import subprocess
import sys

import pytest
from draws import slow

LINES = [json.dumps({"time": 1.7e9 + 4 * k, "lat": 46 + 0.005 * k, "lon": 15.0, "id": "K"}) for k in range(8)]
COMMAND = [sys.executable, "-m", "driftwise.cli.main", "track", "--listen", "-", "--json"]


def plots_of(path):
    return [track["plots"] for track in json.loads(path.read_text())["tracks"]]


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C of a terminal is a signal to a group of processes")
def test_what_was_read_before_an_early_interrupt_is_told(tmp_path):
    found = tmp_path / "found.json"
    with subprocess.Popen(
        [*COMMAND, str(found)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True, bufsize=0
    ) as process:
        process.stdin.write("".join(f"{line}\n" for line in LINES).encode())
        assert process.stdout.readline()
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: compilers that are at work hear it, too
        process.stdout.read()
    assert process.returncode == 0 and plots_of(found) == [8]


@pytest.mark.parametrize("cut", [slow(0), 1])
def test_a_last_line_without_an_end_counts_once_the_pipe_has_ended(tmp_path, cut):
    text = "\n".join(LINES).encode()
    told = subprocess.run([*COMMAND, str(tmp_path / "found.json")], input=text[: len(text) - cut], capture_output=True)
    assert told.returncode == 0 and plots_of(tmp_path / "found.json") == [8 - cut]
