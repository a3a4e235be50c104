"""Plants in formulas: their slopes against differences of plain Python, their sentences where a line does not fit."""

import math

import numpy as np
import pytest

from driftwise.engine import compile
from driftwise.engine.errors import InputError
from driftwise.models.formula_kernels import evaluate, kernels_of
from driftwise.models.formulas import library, read

HARD = """\
name = "hard"
[states]
a = {std = 1}
b = {std = 1}
[inputs]
u = {}
[outputs]
y = {}
z = {}
[parameters]
p = {start = 2}
q = {start = 0.5}
known = {start = 3, fixed = true}
[tables]
curve = {x = [0, 1, 3], y = [1, 4, 5]}
[formulas]
s = "p * a + exp(-q * b) / (1 + u**2)"
da = "sin(s) - abs(a) * sqrt(b + 4) + known * (a if b > u else q)"
db = "-b / p + cos(a * q) * log(p) + max(a, b)**3 - tanh(s) - p**-2"
y = "curve(b) + s**1.5 - sign(a) * q"
z = "min(a * b, p) / q - pi * y + p**q"
"""


def plainly(x, u, theta):
    """Return da, db, y, z as one would write them by hand: nothing of the package."""
    (a, b), (u,), (p, q), known = x, u, theta, 3.0
    s = p * a + math.exp(-q * b) / (1 + u**2)
    da = math.sin(s) - abs(a) * math.sqrt(b + 4) + known * (a if b > u else q)
    db = -b / p + math.cos(a * q) * math.log(p) + max(a, b) ** 3 - math.tanh(s) - p**-2
    y = float(np.interp(b, [0, 1, 3], [1, 4, 5])) + s**1.5 - math.copysign(1, a) * q
    return np.array([da, db, y, min(a * b, p) / q - math.pi * y + p**q])


def test_values_and_slopes_are_those_of_the_formulas_by_hand():
    plant, rng = read(HARD), np.random.default_rng(1)
    for _ in range(50):
        row = rng.uniform(0.3, 2.5, 5)
        parts = row[:2], row[2:3], row[3:]
        dx, y, of_dx, of_y = evaluate(plant, *parts)
        assert np.allclose(np.append(dx, y), plainly(*parts), rtol=1e-13, atol=1e-13)
        for j in range(5):
            h = 1e-5 * np.eye(5)[j]
            ahead, back = ((r[:2], r[2:3], r[3:]) for r in (row + h, row - h))
            slope = (plainly(*ahead) - plainly(*back)) / 2e-5
            assert np.allclose(np.append(of_dx[:, j], of_y[:, j]), slope, rtol=1e-6, atol=1e-6)


def test_compiled_kernels_have_the_bits_of_plain_python():
    plant, task = read(HARD), kernels_of(read(HARD))
    rows = np.random.default_rng(2).uniform(0.3, 2.5, (40, 5))
    spec, nothing = compile.dispatch.flatten([task]), np.zeros((1, 0))
    outs = [np.zeros((40, 4 * 6)) for _ in range(2)]
    for run, out in zip((compile.passage(type(task)), compile.plain_passage(type(task))), outs):
        run(rows, nothing, nothing, out, np.zeros(0), spec)
    assert np.array_equal(*outs)
    assert plant.is_linear is False


def test_a_plant_that_is_linear_in_its_states_is_known_as_one():
    assert read("battery").is_linear
    assert not read(HARD.replace('"-b / p', '"-b * b / p')).is_linear
    friction = HARD.replace("abs(a) * sqrt(b + 4)", "sign(a)")
    assert not read(friction).is_linear


@pytest.mark.parametrize("name", library())
def test_plants_of_the_library_say_units_and_where_they_are_from(name):
    plant = read(name)
    assert plant.about and plant.source and all(plant.units.values())
    start = [s.start for s in plant.states], np.ones(plant.inputs), [p.start for p in plant.free]
    assert all(np.isfinite(part).all() for part in evaluate(plant, *start))


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("R0 * i + v1", "R9 * i + v1", "unknown name 'R9'"),
        ("R0 * i + v1", "sinh(R0) * i + v1", "unknown function 'sinh'"),
        ("R0 * i + v1", "R0 * i +", "v = rest + R0 * i +: this is no formula"),
        ("R0 * i + v1", "R0 + i + v1", "puts"),
        ("(i - v1 / R1) / C1", "(i - v1 / R1) * C1", "the formula comes to"),
        ("rest + R0 * i + v1", "R0 * i + v1", "rest reaches no output"),
        ("R0 * i", "R1 * i", "R0 is in no formula"),
        ("start = 2000", "start = 2000, low = 1, high = 10", "exclude its start 2000"),
        ("start = 2000", "start = -1", "is positive unless"),
        ("start = 2000", 'start = "big"', "start must be a number"),
        ("std = 0.01, ", "", "v1 needs std"),
        ('drest = "0"\n', "", "no line for the state rest"),
        ("R0 = {", "v1 = {", "'v1' is named twice"),
        ("(i - v1 / R1) / C1", "(i - v1 ^ R1) / C1", "write **"),
    ],
)
def test_a_line_that_does_not_fit_is_named(old, new, words):
    text = read("battery").text
    assert old in text
    with pytest.raises(InputError, match=words.replace("*", "\\*").replace("+", "\\+")):
        read(text.replace(old, new))
