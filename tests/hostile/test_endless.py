"""Files without end, where settings and plots are expected, are refused after a bounded read."""

import subprocess
import sys

import numpy as np
import pytest

from driftwise.analysis.residual_tests import prewhitened
from driftwise.engine.errors import CommandError, InputError
from driftwise.tables import plantfile
from driftwise.tracking.read import read_bytes
from driftwise.tracking.sites import read_sites


@pytest.fixture
def little_memory():
    """Take the memory of this process beyond 1 GB more than it has, so that a read without end fails at once."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_AS)
    with open("/proc/self/statm") as file:
        pages = int(file.read().split()[0])
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + (1 << 30), before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


@pytest.mark.skipif(sys.platform != "linux", reason="/dev/zero and /proc")
def test_what_never_ends_is_refused(little_memory):
    with pytest.raises(CommandError, match="--plant /dev/zero holds more than 64 MB"):
        plantfile.read("/dev/zero", ["y"], [])
    with pytest.raises(InputError, match="/dev/zero holds more than 64 MB"):
        read_bytes("/dev/zero")


def test_settings_larger_than_any_are_refused(tmp_path):
    for name in ("sites.toml", "sites.json"):
        (tmp_path / name).write_bytes(b" " * ((1 << 26) + 1))
        with pytest.raises(InputError, match="holds more than 64 MB"):
            read_sites(tmp_path / name)


@pytest.mark.filterwarnings("error")
def test_a_series_of_single_samples_is_not_whitened():
    x = np.full(400, np.nan)
    x[::5] = np.arange(80.0) % 7
    assert np.isnan(prewhitened(x)).all()


def test_a_stream_of_plots_that_never_ends_is_refused_before_memory_is_gone(tmp_path):
    with subprocess.Popen(["yes"], stdout=subprocess.PIPE) as endless:
        done = subprocess.run(
            ["prlimit", f"--as={2 << 30}", sys.executable, "-m", "driftwise", "track", "/dev/fd/0"],
            stdin=endless.stdout, capture_output=True, text=True, cwd=tmp_path, timeout=120,
        )  # fmt: skip
        endless.kill()
    assert done.returncode == 1 and "goes on after 256 MB" in done.stderr, done.stderr


@pytest.mark.parametrize("command", ["track - --follow", "track /dev/fd/0"])
def test_a_stream_that_never_ends_a_line_is_refused(tmp_path, command):
    tens = 1 << 20
    code = f"import os\nwhile True: os.write(1, b'1234567890' * {tens})"
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as endless:
        done = subprocess.run(
            ["prlimit", f"--as={4 << 30}", sys.executable, "-m", "driftwise", *command.split()],
            stdin=endless.stdout, capture_output=True, text=True, cwd=tmp_path, timeout=120,
        )  # fmt: skip
        endless.kill()
    assert done.returncode == 1 and "a line is longer than 64 MiB" in done.stderr, done.stderr
