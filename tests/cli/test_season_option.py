"""`driftwise run --season`."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import driftwise as dw
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


@pytest.fixture
def hours(tmp_path):
    y = np.resize(np.random.default_rng(2).standard_normal(24), 240) + 0.1 * np.random.default_rng(3).standard_normal(
        240
    )
    stamps = np.datetime64("2024-01-01") + np.arange(240) * np.timedelta64(1, "h")
    path = tmp_path / "hours.csv"
    path.write_text("time,load\n" + "\n".join(f"{t},{v:.4f}" for t, v in zip(stamps, y)))
    return path


def test_validate_says_that_it_looks_for_no_season(hours, file, tmp_path):
    out = tmp_path / "out.json"
    for path, seasons in ((hours, 1), (file, 0)):
        result = CliRunner().invoke(app, ["validate", str(path), "--json", str(out)])
        assert result.exit_code == 0, result.output
        said = [note for note in json.loads(out.read_text())["notes"] if "`driftwise run`" in note]
        assert len(said) == seasons and all(note.startswith("A season of 24 samples (a day)") for note in said)


def test_a_model_with_a_season_is_not_validated_but_says_what_to_do(hours):
    found = dw.identify(str(hours))
    assert found.chosen.name.startswith("SeasonalARX")
    with pytest.raises(dw.InputError, match="without one"):
        found.validate()
    assert dw.identify(str(hours), season=()).validate().fresh
