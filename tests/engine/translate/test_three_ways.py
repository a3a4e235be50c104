"""Plain Python, C and numba run one source: the same bits, for every combination of the laws."""

import warnings
from importlib.util import find_spec

import numpy as np
import pytest
from in_c import alike
from test_laws import ESTIMATORS, OBSERVERS

from driftwise.analysis.laws import example
from driftwise.engine import compile
from driftwise.engine.compilers import compilers

ALL = {**ESTIMATORS, **OBSERVERS}
FEW = ("default", "all together", "ARX, auto", "ARX, until the score jumps", "ARX, interacting", "ARX, run lengths",
       "Box-Jenkins", "unknown polynomial", "adaptive gain", "manoeuvre", "window")  # fmt: skip


def run(est, engine, monkeypatch, samples) -> tuple[np.ndarray, np.ndarray]:
    """Return states and table of a record with gaps and an outlier, by one engine."""
    monkeypatch.setenv("DRIFTWISE_ENGINE", engine)
    y, u = example(est, samples)
    y[samples // 2] = 40.0
    columns = est.scan(y[:1], None if u is None else u[:1]).table.shape[-1]
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # of a loop that is not compiled
        drive = est._started(compile.driver.__wrapped__(*map(type, est.policies)))
    ys, us = (np.array(z, float).reshape(1, samples, -1) for z in (y, np.zeros((samples, 0)) if u is None else u))
    rows, outs = est._rows(est.start()), np.zeros((1, samples, columns))
    with np.errstate(all="ignore"):
        drive(rows, ys, us, outs, est.spec, est.scratch())
    return rows, outs


def agree(name, other, monkeypatch, samples):
    """Say whether two engines agree in every bit of the states and of the table."""
    plain = run(ALL[name], "python", monkeypatch, samples)
    return all(map(alike, plain, run(ALL[name], other, monkeypatch, samples)))


needs_a_compiler = pytest.mark.skipif(not compilers(), reason="no compiler: C WAS NOT COMPARED")


@needs_a_compiler
@pytest.mark.parametrize("name", FEW)
def test_c_is_plain_python(name, monkeypatch):
    assert agree(name, "c", monkeypatch, 60)


@pytest.mark.slow
@needs_a_compiler
@pytest.mark.parametrize("name", ALL)
def test_c_is_plain_python_in_every_combination(name, monkeypatch):
    assert agree(name, "c", monkeypatch, 200)


@pytest.mark.slow
@pytest.mark.skipif(find_spec("numba") is None, reason='pip install "driftwise[dev]": NUMBA WAS NOT COMPARED')
@pytest.mark.parametrize("name", ALL)
def test_numba_is_plain_python_in_every_combination(name, monkeypatch):
    assert agree(name, "numba", monkeypatch, 200)
