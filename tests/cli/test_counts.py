"""Of so many samples no more are missing."""

import re

import numpy as np
import pytest
from draws import slow

import driftwise as dw


@pytest.mark.parametrize("gap", [69, slow(469), 3000])
def test_no_count_is_of_fewer(tmp_path, call, gap):
    y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    y[::9] = np.nan
    t = np.arange(400) + gap * (np.arange(400) > 200)
    path, page = tmp_path / "table.csv", tmp_path / "page.html"
    np.savetxt(path, np.column_stack([t, y, u, t % 2]), "%.5g", ",", header="t,y,u,k", comments="")
    for words in (
        ["run", path, "--report", page],
        ["run", path, "-o", "y", "-i", "u", "-t", "t"],
        ["fleet", "run", path, "--by", "k", "-o", "y", "-i", "u", "-t", "t", "--dt", "2", "--out", tmp_path / "out"],
    ):
        code, out, complaint = call(*words)
        assert code == 0, complaint
        for some, total in re.findall(r"(\d+) +of (\d+)\b", out):
            assert int(some) <= int(total), out
        for share in re.findall(r"([\d.]+) %", out):
            assert float(share) <= 100
