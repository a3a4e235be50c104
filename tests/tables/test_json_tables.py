"""Tables written as JSON: by lines, as lists of objects or of lists, as columns; the same oven in each."""

import gzip
import json

import numpy as np
import pytest

from driftwise.engine.errors import InputError
from driftwise.tables.autoread import read
from driftwise.tables.jsonfile import MOST_JSON
from driftwise.tables.table import open_table

SAMPLES = 240
RNG = np.random.default_rng(41)
U = np.repeat(RNG.integers(0, 5, SAMPLES // 20), 20) * 10.0
Y = 21 + np.convolve(U, 0.05 * 0.92 ** np.arange(90))[:SAMPLES] + 0.1 * RNG.normal(size=SAMPLES)
STAMPS = [f"2024-05-04T10:{k // 60:02d}:{k % 60:02d}Z" for k in range(SAMPLES)]
RECORDS = [
    {"ts": s, "heater_pct": u, "temp_C": round(y, 3), "ok": True} for s, u, y in zip(STAMPS, U.tolist(), Y.tolist())
]
NAMES = ("ts", "heater_pct", "temp_C")
LINES = "\n".join(map(json.dumps, RECORDS)) + "\n"
WRITTEN = {
    "an object a line": LINES,
    "a list of objects": json.dumps(RECORDS, indent=1),
    "a list within": json.dumps({"status": "ok", "results": RECORDS}),
    "columns": json.dumps({name: [row[name] for row in RECORDS] for name in NAMES}),
    "pandas, by column": json.dumps({name: {str(k): row[name] for k, row in enumerate(RECORDS)} for name in NAMES}),
    "pandas, split": json.dumps({"columns": NAMES, "data": [[row[name] for name in NAMES] for row in RECORDS]}),
    "lists under names": json.dumps([NAMES, *([row[name] for name in NAMES] for row in RECORDS)]),
}


@pytest.mark.parametrize("how", WRITTEN)
def test_records_are_read_as_a_table(tmp_path, how):
    path = tmp_path / "oven.json"
    path.write_text(WRITTEN[how])
    table, segments = read(path)
    assert (table.output, table.inputs, table.time, table.dt) == ("temp_C", ("heater_pct",), "ts", 1.0)
    parts = list(segments)
    assert np.allclose(np.concatenate([y for _, y, _ in parts]), Y, atol=1e-3)
    assert np.concatenate([u for _, _, u in parts])[:, 0].tolist() == U.tolist()


def test_objects_within_are_named_by_both(tmp_path):
    path = tmp_path / "nested.jsonl"
    path.write_text("\n".join(json.dumps({"ts": row["ts"], "oven": {"temp": row["temp_C"]}}) for row in RECORDS))
    assert open_table(path).names == ("ts", "oven.temp")


def test_what_is_missing_in_a_record_is_a_missing_sample(tmp_path):
    path = tmp_path / "gaps.jsonl"
    rows = [dict(row) for row in RECORDS]
    del rows[7]["temp_C"]
    rows[9]["temp_C"], rows[11]["temp_C"] = None, "n/a"
    path.write_text("\n".join(map(json.dumps, rows)))
    temp = open_table(path).head["temp_C"]
    assert np.flatnonzero(np.isnan(temp)).tolist() == [7, 9, 11]


def test_a_line_that_was_cut_is_left_out_and_said(tmp_path):
    path = tmp_path / "cut.jsonl"
    path.write_text(LINES + '{"ts": "2024-05-04T10:0')
    table = open_table(path)
    assert len(table.head["temp_C"]) == SAMPLES and table.otherwise == ["1 line is no JSON: left out."]


def test_packed_lines_are_read(tmp_path):
    path = tmp_path / "oven.jsonl.gz"
    path.write_bytes(gzip.compress(LINES.encode()))
    assert len(open_table(path).head["temp_C"]) == SAMPLES


@pytest.mark.parametrize(
    "text, said",
    [
        ('{"ts": 1, "y": 2\n{"ts": \n{"t', "damaged"),
        ("{}", "without records"),
        ("[" * 9000 + "{", "without end|damaged"),
        ('{"a": ' * 9000, "without end|damaged"),
        (" " * 10 + "{" + " " * MOST_JSON, "more than 64 MB"),
    ],
    ids=["damaged", "empty", "lists", "objects", "large"],
)
def test_json_that_is_no_table_is_refused(tmp_path, text, said):
    path = tmp_path / "odd.json"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        open_table(path)
