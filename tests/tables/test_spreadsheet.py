"""Text that came with the data is text in a spreadsheet too."""

import csv

import numpy as np
import pytest

from driftwise.tables.spreadsheet import harmless
from driftwise.tracking import track
from driftwise.tracking.plots import plots
from driftwise.tracking.write import write_csv

FORMULA = '=HYPERLINK("http://example.org";"look")'


@pytest.mark.parametrize("cell", [FORMULA, "+1+cmd|' /C calc'!A0", "@SUM(A1)", "-1-1", "\t=1+1"])
def test_what_would_be_worked_out_gets_an_apostrophe(cell):
    assert harmless(cell) == "'" + cell


@pytest.mark.parametrize("cell", ["pump 1", "-5", "+4.5e3", "", 7, -1.5, None, "a=b"])
def test_numbers_and_plain_text_stay(cell):
    assert harmless(cell) == cell


def test_the_name_of_a_target_is_no_formula(tmp_path):
    time = np.arange(20.0)
    found = track(plots(time, np.stack([3 * time, 4 * time], axis=1), key=[FORMULA] * 20), "boat", single=True)
    with open(write_csv(found, tmp_path / "tracks.csv"), newline="") as file:
        cells = [cell for row in csv.reader(file) for cell in row]
    assert "'" + FORMULA in cells and FORMULA not in cells
