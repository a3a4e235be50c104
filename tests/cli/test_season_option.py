"""`driftwise run --season`."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from driftwise.cli.main import app


@pytest.fixture
def file(tmp_path):
    rng = np.random.default_rng(1)
    y = np.resize(rng.standard_normal(9), 200) + 0.2 * rng.standard_normal(200)
    path = tmp_path / "y.csv"
    path.write_text("level\n" + "\n".join(f"{v:.4f}" for v in y))
    return path


def test_a_season_that_is_said_is_looked_for(file, tmp_path):
    out = tmp_path / "out.json"
    result = CliRunner().invoke(app, ["run", str(file), "--season", "9", "--json", str(out)])
    assert result.exit_code == 0, result.output
    assert json.loads(out.read_text())["model"].startswith("SeasonalARX")


@pytest.mark.parametrize("said", [["--season", "x"], ["--season", "1"], ["--season", "9", "--model", "ar:2"]])
def test_what_is_no_season_is_refused_in_a_sentence(file, said):
    result = CliRunner().invoke(app, ["run", str(file), "-o", "level", *said])
    assert result.exit_code and "--season" in str(result.exception)
