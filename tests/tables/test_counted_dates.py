"""Clocks that count: milliseconds since 1970, days of a spreadsheet, dates without marks. None of them is seconds."""

from datetime import datetime, timedelta

import numpy as np
import pyarrow as pa
import pytest

import driftwise as dw
from driftwise.tables.cells import instants, kind_of

MINUTE = [datetime(2024, 1, 1, 9) + timedelta(minutes=7 * k) for k in range(300)]
EXCEL = datetime(1899, 12, 30)
FORMS = {
    "milliseconds": lambda t: f"{int((t - datetime(1970, 1, 1)).total_seconds() * 1000)}",
    "microseconds": lambda t: f"{int((t - datetime(1970, 1, 1)).total_seconds() * 1000_000)}",
    "days": lambda t: f"{(t - EXCEL) / timedelta(days=1):.6f}",
    "digits": lambda t: t.strftime("%Y%m%d%H%M%S"),
}


@pytest.mark.parametrize("form", FORMS)
def test_the_step_of_such_a_clock_is_that_of_the_dates(tmp_path, call, form):
    y, u = dw.simulate([-0.8], [1.0], samples=300, noise_std=0.1, seed=1)
    path = tmp_path / "table.csv"
    rows = [f"{FORMS[form](t)},{a:.4f},{b:.4f}" for t, a, b in zip(MINUTE, y, u)]
    path.write_text("\n".join(["time,y,u", *rows]) + "\n")
    for more in ([], ["--chunk", "7"], ["--from", "2024-01-01T10:10", "--to", "2024-01-02T12:00"]):
        code, out, complaint = call("run", path, "-o", "y", "-i", "u", "-t", "time", "-n", "1", *more)
        assert code == 0, complaint
        assert "dt 420 s" in out and "gaps" not in out and "missing" not in out, out
        inside = [t for t in MINUTE if datetime(2024, 1, 1, 10, 10) <= t <= datetime(2024, 1, 2, 12)]
        assert f"{len(inside) if '--from' in more else 300} samples" in out


def test_seconds_since_1970_are_seconds_and_are_told_apart():
    y, u = dw.simulate([-0.8], [1.0], samples=300, noise_std=0.1, seed=1)
    table = dw.identify({"epoch": 1_144_110_000.0 + 60.0 * np.arange(300), "y": y, "u": u}).table
    assert table.timed and table.step == "every 60 s"
    assert table.at(1_144_110_060.0) == "at 1144110060 s"


def test_numbers_that_are_no_dates_stay_numbers():
    for values in (
        np.arange(300) * 0.5 + 45000.0,  # seconds
        np.arange(300.0) + 45000.0,
        1.5e12 + 0.5 * np.arange(300),
        np.random.default_rng(1).normal(45000, 3, 300),
        np.random.default_rng(1).integers(10**12, 4 * 10**12, 300),  # that fall, too
        np.arange(300) * 60 + 1.7e9,  # seconds since 1970 are seconds
    ):
        assert kind_of(pa.array(values)) == "number", values[:3]
    found, bad, is_stamp = instants(pa.array([45000.25, None, 45001.0]), are_stamps=True)  # other rows were dates
    assert is_stamp and not bad.any() and np.isnan(found[1]) and found[2] - found[0] == 0.75 * 86400
