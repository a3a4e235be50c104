"""Every script of examples/gallery runs in seconds, and its answers are within two bars of the truth."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from driftwise.cli.main import app

GALLERY = Path(__file__).parents[1] / "examples" / "gallery"
SCRIPTS = sorted(path.name for path in GALLERY.glob("*.py"))


@pytest.mark.parametrize("script", SCRIPTS)
def test_the_answers_are_within_two_bars_of_the_truth(script):
    run = subprocess.run(
        [sys.executable, script], cwd=GALLERY, capture_output=True, text=True, timeout=240, env=dict(os.environ)
    )
    assert run.returncode == 0, run.stdout[-3000:] + run.stderr[-3000:]


@pytest.mark.slow
@pytest.mark.parametrize("script", sorted(GALLERY.parent.rglob("plot_*.py")), ids=lambda path: path.stem)
def test_an_example_of_the_site_runs(script, tmp_path):
    """As somebody runs it who took it from the site: alone, with warnings for errors."""
    env = {**os.environ, "MPLBACKEND": "Agg"}
    line = [sys.executable, "-W", "error::RuntimeWarning", str(script)]
    run = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, timeout=240, env=env)
    assert run.returncode == 0, run.stdout[-3000:] + run.stderr[-3000:]


def test_a_pump_is_told_by_the_command_of_its_story(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(GALLERY))
    from pumps import pump

    flow, speed, at, _, _ = pump(1)
    lines = ["minute,flow,speed", *(f"{t},{y},{u}" for t, (y, u) in enumerate(zip(flow, speed)))]
    (tmp_path / "pump.csv").write_text("\n".join(lines))
    order = ["-o", "flow", "-i", "speed", "--model", "armax:1,1,1", "--jumps", "parameters:10000"]
    run = CliRunner().invoke(app, ["run", str(tmp_path / "pump.csv"), *order, "--json", str(tmp_path / "found.json")])
    assert run.exit_code == 0, run.output
    jumps = json.loads((tmp_path / "found.json").read_text())["jumps"]
    assert any(at <= jump["sample"] <= at + 60 for jump in jumps), jumps
