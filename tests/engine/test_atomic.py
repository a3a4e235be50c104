"""What is written replaces what was there at once, or leaves it: on a full disk, through a link, into a pipe."""

import os
import subprocess
import sys
import threading

import pytest

from driftwise.engine.atomic import replaced, write_text

FULL = """
import resource, signal, sys
from driftwise.engine.atomic import write_text
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))  # to the system, a disk that is full after a page
try:
    write_text(sys.argv[1], "new" * 10_000)
except OSError as error:
    print(error.filename)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="limits of a process are POSIX")
def test_a_full_disk_leaves_the_old_file_and_is_told_by_its_name(tmp_path):
    path = tmp_path / "report.html"
    path.write_text("old")
    done = subprocess.run([sys.executable, "-c", FULL, str(path)], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == str(path) and path.read_text() == "old" and os.listdir(tmp_path) == ["report.html"]


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to("real")
    write_text(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "real").read_text() == "new"


@pytest.mark.skipif(sys.platform == "win32", reason="named pipes are POSIX")
def test_a_pipe_is_written_to(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    heard = []
    reader = threading.Thread(target=lambda: heard.append((tmp_path / "pipe").read_text()))
    reader.start()
    write_text(tmp_path / "pipe", "new")
    reader.join()
    assert heard == ["new"] and not (tmp_path / "pipe").is_file()


def test_an_error_in_between_leaves_the_old_file(tmp_path):
    (tmp_path / "file").write_text("old")
    with pytest.raises(ZeroDivisionError), replaced(tmp_path / "file") as beside:
        open(beside, "w").write(str(1 / 0))
    assert (tmp_path / "file").read_text() == "old" and os.listdir(tmp_path) == ["file"]
