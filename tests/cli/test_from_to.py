"""--from and --to take numbers and dates, as the table writes them."""

import json

import numpy as np
import pytest

ROWS = 2000  # a row a minute from noon of 30 March 2024: until 21:19 of the next day
START = np.datetime64("2024-03-30T12:00", "m")


@pytest.fixture
def tables(tmp_path):
    """The same record with ISO stamps, German dates, seconds, and without a time."""
    rng = np.random.default_rng(4)
    u = rng.standard_normal(ROWS)
    y = np.convolve(u, [0.0, 1.0, 0.5])[:ROWS] + 0.1 * rng.standard_normal(ROWS)
    stamps = (START + np.arange(ROWS)).astype(object)
    kinds = {
        "iso": [f"{t:%Y-%m-%dT%H:%M}" for t in stamps],
        "german": [f"{t:%d.%m.%Y %H:%M}" for t in stamps],
        "seconds": [str(60 * k) for k in range(ROWS)],
    }
    for name, times in kinds.items():
        lines = (f"{t};{a:.4f};{b:.4f}\n" for t, a, b in zip(times, u, y))
        (tmp_path / f"{name}.csv").write_text("time;u;y\n" + "".join(lines))
    return tmp_path


@pytest.fixture
def rows(call, tables):
    """Run a table between two times; return how many samples were taken."""

    def run(name, *options):
        out = tables / "out.json"
        words = ["-o", "y", "-i", "u", "-t", "time", "--json", out, *options]
        code, _, err = call("run", tables / f"{name}.csv", "-n", "1", *words)
        assert code == 0, err
        return json.loads(out.read_text())["summary"]["samples"]

    return run


@pytest.mark.parametrize(
    "name, options, samples",
    [
        ("iso", ["--from", "2024-03-31"], ROWS - 720),
        ("iso", ["--to", "2024-03-30"], 720),  # the whole day
        ("iso", ["--from", "2024-03-30T13:00", "--to", "2024-03-30 13:59"], 60),
        ("iso", ["--from", "3600", "--to", "7140"], 60),  # numbers: seconds since the first stamp
        ("german", ["--from", "30.03.2024 13:00", "--to", "30.03.2024 13:59"], 60),
        ("german", ["--to", "2024-03-30T12:59"], 60),
        ("seconds", ["--from", "3600", "--to", "7140"], 60),
    ],
)
def test_dates_and_numbers(rows, name, options, samples):
    assert rows(name, *options) == samples


@pytest.mark.parametrize(
    "name, options, samples",
    [
        ("iso", ["--from", "2024-03-31"], ROWS - 720),
        ("iso", ["--to", "2024-03-30"], 720),
        ("seconds", ["--from", "3600", "--to", "42000"], 641),
    ],
)
def test_what_is_identified_is_between_them_too(call, tables, name, options, samples):
    out = tables / "out.json"
    code, _, err = call("run", tables / f"{name}.csv", "--json", out, *options)
    assert code == 0, err
    found = json.loads(out.read_text())
    assert found["summary"]["samples"] == samples and found["columns"]["time"] == "time"
    code, _, err = call("run", tables / f"{name}.csv", "--from", "9999999")
    assert code == 1 and "no row lies between --from and --to" in err


def test_compare_takes_dates_too(call, tables):
    out = tables / "out.json"
    code, _, err = call("compare", tables / "iso.csv", "last", "mean", "-o", "y", "-i", "u", "-t", "time", "--to",
                        "2024-03-30", "--json", out)  # fmt: skip
    assert code == 0, err
    assert json.loads(out.read_text())["samples"] == 720


@pytest.mark.parametrize(
    "name, options, code, words",
    [
        ("iso", ["-t", "time", "--from", "yesterday"], 2, "--from takes a number, or a date such as 2024-03-30"),
        ("iso", ["--to", "2024-03-30"], 2, "--to 2024-03-30 is a date; which column holds the time stamps (--time)?"),
        ("seconds", ["-t", "time", "--from", "2024-03-30"], 2, "column 'time' holds numbers: give a number in"),
        ("iso", ["-t", "time", "--from", "2025-01-01"], 1,
         "no row lies between --from and --to; its stamps run from 2024-03-30T12:00:00 to 2024-03-31T21:19:00."),
    ],
)  # fmt: skip
def test_what_is_no_time_of_the_table_is_told(call, tables, name, options, code, words):
    found = call("run", tables / f"{name}.csv", "-o", "y", "-i", "u", "-n", 1, *options)
    assert found[:2] == (code, "") and words in found[2]
