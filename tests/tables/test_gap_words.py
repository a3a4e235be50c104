"""A column most of whose cells are one word, and the others numbers of a quantity, is a sensor that is seldom read."""

import numpy as np
import pyarrow as pa
import pytest
from scipy.signal import lfilter

from driftwise.tables.autoread import read
from driftwise.tables.cells import kind_of


def seldom(word: str, every: int = 5, rows: int = 400) -> list[str]:
    """Return cells of a quantity that is read at some rows, and a word at the others."""
    values = np.random.default_rng(4).normal(20.0, 3.0, rows)
    return [f"{value:.3f}" if not k % every else word for k, value in enumerate(values.tolist())]


@pytest.mark.parametrize("word", ["Bad", "no reading", "ausgefallen"])
def test_one_word_stands_for_what_was_not_read(word):
    assert kind_of(pa.array(seldom(word))) == "number"


def test_two_words_or_a_few_numbers_are_no_quantity():
    cells = seldom("Bad")
    assert kind_of(pa.array(["Stopped", *cells])) == "text"
    assert kind_of(pa.array(["run"] * 300 + ["1", "2", "3"] * 9)) == "text"  # steps of a programme


def test_the_output_is_the_column_that_is_seldom_read(tmp_path):
    rng, rows = np.random.default_rng(2), 800
    u = rng.choice([1.0, 2.0, 3.0], rows // 20).repeat(20)
    y = lfilter([0.0, 0.1], [1.0, -0.9], u) + 0.01 * rng.standard_normal(rows)
    cells = [f"{k * 10};{y[k]:.4f};{u[k]:g}" if not k % 4 else f"{k * 10};Bad;{u[k]:g}" for k in range(rows)]
    path = tmp_path / "seldom.csv"
    path.write_text("time [s];temp [degC];heater [%]\n" + "\n".join(cells) + "\n", encoding="utf-8")
    table = read(path)[0]
    assert (table.output, table.inputs) == ("temp [degC]", ("heater [%]",))
