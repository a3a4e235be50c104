"""What several test files use."""

import gc
import os
import signal
import sys
from pathlib import Path

# Workers fill the cores: more threads inside a small matrix product only wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Hundreds of processes that are started here, and the next run, read what the first compiled.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

import pytest

from driftwise.cli import main as cli

sys.dont_write_bytecode = False
gc.disable()  # nothing of a test file is garbage: a third of what collecting them takes

RECORDINGS = Path(__file__).parents[2] / "shared" / "data"  # beside the project, where nobody says another place
if RECORDINGS.is_dir():
    os.environ.setdefault("DRIFTWISE_DATA", str(RECORDINGS))

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # begun in the background: no program tried here would hear it
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_runtest_setup(item):
    """Print as to no terminal: the workers of a parallel run say that they are one of 80 columns."""
    for name in ("COLUMNS", "LINES"):
        os.environ.pop(name, None)


def pytest_collection_modifyitems(items):
    """Run the examples of the documentation late: what they compile, other tests have compiled by then."""
    items.sort(key=lambda item: "test_q" if item.path.name == "test_docs.py" else item.path.name)


@pytest.hookimpl(trylast=True)
def pytest_collection_finish():
    """Look for garbage from here on, and not among what was collected."""
    gc.freeze()
    gc.set_threshold(10_000)
    gc.enable()


@pytest.fixture
def call(monkeypatch, capsys):
    """Run the command line in this process and return (exit code, standard output, standard error)."""

    def run(*args):
        monkeypatch.setattr(sys, "argv", ["driftwise", *map(str, args)])
        try:
            cli.main()
            code = 0
        except SystemExit as done:
            code = done.code or 0
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run


@pytest.fixture(scope="module")
def spark():
    """One Spark on this machine, two workers."""
    from spark_tables import JAVA, local_session

    pyspark = pytest.importorskip("pyspark", reason='pip install "driftwise[spark]": SPARK WAS NOT TESTED')
    if JAVA is None:
        pytest.skip("no Java on the PATH: SPARK WAS NOT TESTED")
    session = local_session(pyspark)
    yield session
    session.stop()
