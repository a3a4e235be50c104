"""The page for those who come from another library: each of its examples runs, and says the same numbers."""

import re
from pathlib import Path

import numpy as np
import pytest

PAGE = (Path(__file__).parents[3] / "docs" / "coming-from.md").read_text()
BLOCKS = dict(
    zip(["driftwise", *re.findall(r"\n## (.*)\n\n```python", PAGE)], re.findall(r"```python\n(.*?)```", PAGE, re.S))
)


def record():
    rng = np.random.default_rng(1)
    y = np.cumsum(1 + 0.2 * rng.standard_normal(60)) + 2 * rng.standard_normal(60)
    y[[7, 30, 31]] = np.nan
    return y


@pytest.fixture(scope="module")
def ours():
    found = {"np": np, "y": record()}
    exec(compile(BLOCKS["driftwise"], "coming-from.md", "exec"), found)
    return found


def test_the_example_is_short_and_goes_on(ours):
    assert sum(bool(line.strip()) for line in BLOCKS["driftwise"].splitlines()) <= 15
    assert np.isfinite(ours["speed"]).all() and ours["state"]["samples"] == 61 and np.isfinite(ours["step"].variance)


@pytest.mark.parametrize("library", ["filterpy", "pykalman", "simdkalman", "statsmodels"])
def test_the_others_say_the_same(library, ours):
    pytest.importorskip(library)
    theirs = {"np": np, "y": record(), **{name: ours[name] for name in ("F", "H", "Q", "R", "x0", "P0")}}
    exec(compile(BLOCKS[library], f"{library} in coming-from.md", "exec"), theirs)
    for name in ("filtered", "smoothed", "loglik"):
        found = np.squeeze(theirs[name])
        np.testing.assert_allclose(found, np.squeeze(ours[name]), rtol=1e-9, atol=1e-9, err_msg=name)
