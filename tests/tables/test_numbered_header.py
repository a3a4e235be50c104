"""A header of numbers, as a data frame without names is written, is no sample."""

import numpy as np

from driftwise.tables.record import open_record


def written(path, header, rows):
    path.write_text("\n".join([header, *rows]) + "\n")
    record = open_record(str(path), "column3" if header == "7.5,2,3" else header.split(",")[2], (), None, 1000, False)
    return record, sum(chunk.rows for chunk in record)


def test_columns_that_are_counted_have_these_numbers_as_names(tmp_path):
    rng = np.random.default_rng(1)
    rows = [",".join(f"{v:.4f}" for v in rng.standard_normal(3)) for _ in range(50)]
    for header in ("0,1,2", "1,2,3"):
        record, count = written(tmp_path / "table.csv", header, rows)
        assert count == 50 and record.output == header.split(",")[2]


def test_a_first_row_of_other_numbers_is_a_sample(tmp_path):
    rng = np.random.default_rng(1)
    rows = [",".join(f"{v:.4f}" for v in rng.standard_normal(3)) for _ in range(50)]
    record, count = written(tmp_path / "table.csv", "7.5,2,3", rows)
    assert count == 51 and record.output == "column3"
    whole = [f"{k},{k + 1},{k * k + 2}" for k in range(1, 50)]  # whole numbers below: it may well be a sample
    (tmp_path / "table.csv").write_text("\n".join(["0,1,2", *whole]) + "\n")
    assert sum(chunk.rows for chunk in open_record(str(tmp_path / "table.csv"), "column3", (), None, 1000, False)) == 50
