"""What a build compiles ahead: all of the front door, in an environment that holds numpy and scipy alone."""

import os
import subprocess
import sys

import pytest

from driftwise.engine.compilers import compilers


@pytest.mark.slow
@pytest.mark.skipif(all(c.is_quick for c in compilers()), reason="no gcc or clang here")
def test_a_build_without_the_library_for_terminals_compiles_ahead(tmp_path):
    """It was imported to say what had been compiled, so that the build ended with the first loop."""
    (tmp_path / "rich.py").write_text("raise ImportError('not in this environment')")
    paths = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", "driftwise.cli.stock", str(tmp_path / "objects")]
    done = subprocess.run(command, env=os.environ | {"PYTHONPATH": paths}, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "compiled ModelAverage" in done.stdout and len(list((tmp_path / "objects").glob("*.so"))) >= 8
