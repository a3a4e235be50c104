"""Time in tables: stamps or numbers, repeated, missing, decreasing, out of range."""

import numpy as np
import pytest
from small_tables import parquet, put, read

from driftwise.tables import csvfile
from driftwise.tables.cells import NAT, seconds

# --- time --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "stamps",
    [
        ["2024-03-01T12:00:00", "2024-03-01T12:00:00.5", "2024-03-01T12:00:01"],
        ["2024-03-01 12:00:00", "2024-03-01 12:00:00.5", "2024-03-01 12:00:01"],
        ["2024-03-01T12:00:00Z", "2024-03-01T12:00:00.5Z", "2024-03-01T12:00:01Z"],
        ["2024-03-01T12:00:00+02:00", "2024-03-01T12:00:00.5+02:00", "2024-03-01T11:00:01+01:00"],
        ["10", "10.5", "11"],
    ],
)
def test_time_as_stamps_or_numbers(tmp_path, stamps):
    record, columns, _ = read(
        put(tmp_path, "t,y\n" + "".join(f"{s},{k}\n" for k, s in enumerate(stamps))), "y", (), "t"
    )
    first = 10 if stamps[0] == "10" else 0
    np.testing.assert_allclose(columns["t"], [first, first + 0.5, first + 1], atol=1e-9)
    assert record.clock.dt == 0.5
    assert record.clock.notes() == []


def test_parquet_time_stamps(tmp_path):
    stamps = np.datetime64("2024-01-01T00:00:00", "us") + np.arange(5) * np.timedelta64(250, "ms")
    record, columns, _ = read(parquet(tmp_path, {"t": stamps, "y": np.arange(5.0)}), "y", (), "t", chunk_rows=2)
    np.testing.assert_allclose(columns["t"], np.arange(5) * 0.25, atol=1e-12)
    assert record.clock.origin == "2024-01-01T00:00:00"


def test_duplicate_and_decreasing_stamps_are_counted_across_chunks(tmp_path):
    times = [0, 1, 2, 2, 3, 4, 3, 4, 5, 9, 10]
    path = put(tmp_path, "t,y\n" + "".join(f"{t},{k}\n" for k, t in enumerate(times)))
    for chunk_rows in (2, 3, 100):
        record, columns, _ = read(path, "y", (), "t", chunk_rows=chunk_rows)
        clock = record.clock
        assert (clock.duplicates, clock.first_duplicate) == (1, 3)
        assert (clock.decreases, clock.first_decrease) == (1, 6)
        assert clock.gaps == 1
        assert columns["t"].tolist() == times
        assert "first at row 7" in clock.notes()[0]
        assert "first at row 4" in clock.notes()[1]


@pytest.mark.parametrize("chunk", [50, 1000])
def test_codes_for_a_missing_value_are_missing_unless_asked_for(tmp_path, chunk):
    y = 20 + np.round(np.random.default_rng(0).standard_normal(200), 3)
    y[[7, 120]] = -9999
    path = put(tmp_path, "y\n" + "\n".join(map(str, y)) + "\n")
    record, columns, _ = read(path, chunk_rows=chunk)
    assert np.flatnonzero(np.isnan(columns["y"])).tolist() == [7, 120]
    assert "2 values of 'y' are -9999" in record.code_notes()[0]
    record, columns, _ = read(path, raw=True)
    assert columns["y"].tolist() == y.tolist() and not record.code_notes()


def test_missing_stamps_are_filled(tmp_path):
    text = "t,y\n,0\n1,1\n2,2\n,3\n,4\n5,5\nrubbish,6\n"
    for chunk_rows in (100, 3):
        record, columns, _ = read(put(tmp_path, text), "y", (), "t", chunk_rows=chunk_rows)
        assert columns["t"].tolist() == [0, 1, 2, 3, 4, 5, 6]
        assert record.clock.missing == 4


def test_a_batch_of_empty_stamps_is_missing(tmp_path, monkeypatch):
    monkeypatch.setattr(csvfile, "BLOCK", 40)
    monkeypatch.setattr(csvfile, "HEAD", 60)
    rows = [f"2024-01-01T00:00:{k:02d},{k}" if not 20 <= k < 40 else f",{k}" for k in range(60)]
    record, columns, _ = read(put(tmp_path, "t,y\n" + "\n".join(rows)), "y", (), "t")
    assert columns["t"].tolist() == list(range(60))
    assert record.clock.missing == 20


# --- refusals ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("year", ["9999-12-31", "0001-01-01", "1677-01-01", "2262-12-31"])
def test_a_date_beyond_what_nanoseconds_count_is_no_time_stamp(tmp_path, year):
    """Many a data base writes 9999-12-31 for no date."""
    import pyarrow as pa

    days = ["2024-01-01", "2024-01-02", year, "2024-01-04"]
    for unit in ("s", "ms", "us"):
        told = pa.array(np.array(days, f"datetime64[{unit}]"), pa.timestamp(unit))
        values, bad, is_stamp = seconds(told)
        assert is_stamp and bad.tolist() == [False, False, True, False] and values[2] == NAT
        assert np.diff(values[[0, 1, 3]]).tolist() == [86_400 * 10**9, 2 * 86_400 * 10**9]
    whole = seconds(pa.array(np.array(days, "datetime64[D]"), pa.date32()))
    assert whole[1].tolist() == [False, False, True, False]
    text = "time,u,y\n" + "".join(f"{day} 00:00:00,{(-1) ** k},{k}\n" for k, day in enumerate(days))
    record, columns, _ = read(put(tmp_path, text), "y", ["u"], "time")
    assert columns["time"].tolist() == [k * 86_400.0 for k in range(4)]  # filled in, as any that is missing
    assert record.bad == 1
