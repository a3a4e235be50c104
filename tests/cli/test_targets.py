"""A place that cannot be written to is refused before the work, in a sentence."""

import os
from pathlib import Path

import pytest

from driftwise.cli.estimate import EstimateJob
from driftwise.cli.targets import refuse_file, refuse_folder
from driftwise.engine.errors import CommandError

COMMANDS = {
    "run": ("--save x.csv", "--report x.html", "--json x.json"),
    "track": ("--out t", "--report x.html", "--json x.json"),
    "compare": ("--report x.html", "--json x.json"),
}


@pytest.fixture
def closed(tmp_path, monkeypatch):
    """A folder that takes no files: one whose mode says so, or for the superuser one of the kernel's."""
    if os.name == "posix" and os.geteuid() == 0:
        if not Path("/proc/self").is_dir():
            pytest.skip("nothing is closed to the superuser here")
        return Path("/proc")
    folder = tmp_path / "closed"
    folder.mkdir(mode=0o500)
    return folder


@pytest.mark.parametrize(
    ("command", "option"), [(command, option) for command, options in COMMANDS.items() for option in options]
)
def test_a_closed_folder_is_refused_before_anything_is_read(call, closed, tmp_path, command, option):
    table = tmp_path / "table.csv"
    table.write_text("time,y\n0,1\n1,x\n")  # of no use to any of them: they do not get so far
    name, target = option.split()
    words = {"run": ["-o", "y"], "track": [], "compare": ["arx:1,1", "last", "-o", "y", "-i", "time"]}[command]
    code, out, complaint = call(command, table, *words, name, closed / target)
    assert (code, out) == (2, "")
    assert complaint.startswith(f"driftwise: {name}: nothing can be written into the folder {closed} (")
    assert complaint.count("\n") == 1


def test_what_can_be_written_is_left_as_it_was(tmp_path):
    file = tmp_path / "there.csv"
    file.write_text("kept")
    refuse_file("--save", str(file))
    refuse_file("--save", str(tmp_path / "new.csv"))
    refuse_folder("--out", str(tmp_path / "a" / "b"))
    assert os.listdir(tmp_path) == ["there.csv"] and file.read_text() == "kept"
    with pytest.raises(CommandError, match=r"there\.csv is a file, and a folder is wanted"):
        refuse_folder("--out", str(file / "below"))


def test_a_disk_that_fills_up_during_the_work_is_a_sentence(call, tmp_path, monkeypatch):
    def full(plan):
        raise OSError(28, "No space left on device", plan.save)

    monkeypatch.setattr(EstimateJob, "estimate", full)
    code, out, complaint = call("run", tmp_path / "table.csv", "-o", "y", "-n", "2", "--save", "x.csv")
    assert (code, out) == (1, "")
    assert complaint == "driftwise: stopped by the system: x.csv: No space left on device\n"


@pytest.mark.parametrize(
    "options", ["--report x --json x", "--save x.csv --json ./x.csv", "--report x.html --json link"]
)
def test_two_options_do_not_write_one_file(call, tmp_path, monkeypatch, options):
    monkeypatch.chdir(tmp_path)
    Path("table.csv").write_text("time,y\n0,1\n1,x\n")
    Path("link").symlink_to("x.html")
    code, out, complaint = call("run", "table.csv", "-o", "y", *options.split())
    (first, _, second, path) = options.split()
    assert (code, out) == (2, "")
    assert complaint.startswith(f"driftwise: {first} and {second} would both write {path}; give one of them another")


@pytest.mark.parametrize("option", ["--report", "--json"])
def test_tracks_do_not_overwrite_their_plots(call, tmp_path, option):
    table = tmp_path / "table.csv"
    table.write_text("time,y\n0,1\n1,x\n")
    code, out, complaint = call("track", table, option, table)
    assert (code, out) == (2, "") and f"{option} would overwrite what is being read" in complaint
    assert table.read_text().startswith("time,y")
