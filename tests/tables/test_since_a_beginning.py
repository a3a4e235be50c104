"""Clocks that count from a beginning, as data frames hold and write them; marks of who cleaned a table."""

import numpy as np
import pytest

import driftwise as dw

pd = pytest.importorskip("pandas")
T = 240


@pytest.fixture
def plant():
    rng = np.random.default_rng(5)
    u = np.repeat(rng.standard_normal(T // 10), 10)
    y = np.convolve(u, 0.6 ** np.arange(1, 20))[:T] + 0.1 * rng.standard_normal(T)
    return pd.DataFrame({"heater": u, "temperature": y})


def recognised(data):
    table = dw.identify(data).table
    return table.time, table.step


def test_spans_of_time_are_a_clock_in_a_column_and_in_a_file(plant, tmp_path):
    plant.insert(0, "since", pd.to_timedelta(86_390 + 0.5 * np.arange(T), unit="s"))  # past a day
    path = tmp_path / "spans.csv"
    plant.to_csv(path, index=False)
    assert path.read_text().splitlines()[-1].startswith("1 days 00:01:49.5")
    assert recognised(plant) == recognised(str(path)) == ("since", "every 0.5 s")


def test_the_index_of_a_data_frame_is_a_clock_where_it_holds_spans_or_periods(plant):
    plant.index = pd.to_timedelta(0.5 * np.arange(T), unit="s")
    assert recognised(plant) == ("time", "every 0.5 s")
    plant.index = pd.period_range("2001-01-01", periods=T, freq="D")
    assert recognised(plant) == ("time", "every 1 d")


def test_marks_of_what_was_cleaned_drive_nothing(plant):
    mask = np.abs(plant["temperature"]) > 1
    found = dw.identify({**plant, "stale_data_mask": mask, "outlier": mask, "lat": plant["heater"] + 50})
    assert found.table.inputs == ("heater",)
    assert {found.table[name].role for name in ("stale_data_mask", "outlier")} == {"label"}
    assert found.table["lat"].role == "logger"
