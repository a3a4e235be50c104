"""Plants in formulas that nobody should write: arithmetic is compiled of them, or a sentence says why not."""

import sys

import numpy as np
import pytest

from driftwise.engine import compile
from driftwise.engine.errors import InputError
from driftwise.models.formula_kernels import kernels_of
from driftwise.models.formulas import read
from hostile.formulas import EXECUTING, HONEST, _escaped, _strange, take, written


def tried(text):
    """Return a plant whose kernels were run on ordinary and on odd numbers, in plain Python; or why it is refused."""
    try:
        plant = take(text)
    except InputError as error:
        return str(error)
    task, width = kernels_of(plant), plant.N + plant.inputs
    rows = np.array([[value] * width for value in (0.5, 0.0, -1e99, 1e99, np.inf, np.nan)])
    out = np.zeros((len(rows), (plant.n + plant.p) * (1 + width)))
    spec, nothing = compile.dispatch.flatten([task]), np.zeros((1, 0))
    with np.errstate(all="ignore"):
        compile.plain_passage(type(task))(rows, nothing, nothing, out, np.zeros(0), spec)
    return plant


def test_odd_plants_are_arithmetic_or_refused_in_a_sentence():
    found = {told: tried(text) for told, text in written().items()}
    assert sum(not isinstance(plant, str) for plant in found.values()) > 15
    assert all(len(words) < 3000 for words in found.values() if isinstance(words, str))


@pytest.mark.parametrize("text", EXECUTING[:40])
def test_words_that_execute_elsewhere_are_no_formula(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=r"da = |no TOML"):
        take(HONEST.replace("-p * a + u", _escaped(text)))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("source", ["__import__('os')", "x.y", "f'{x}'", "exec(x)", "[i for i in x]", "plant.n", "'a'"])
def test_what_is_looked_for_in_kernels_is_found(source):
    assert _strange(f"def move(plant, x):\n    t1 = {source}")


def test_a_plant_without_end_is_refused(tmp_path):
    (tmp_path / "large.toml").write_text("#" * (1 << 21))
    for place in (tmp_path / "large.toml", "/dev/zero" if sys.platform == "linux" else "\n" * (1 << 21)):
        with pytest.raises(InputError, match="at most 1 MB of text"):
            read(place)
