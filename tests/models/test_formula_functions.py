"""A plant as a Python function is the same plant as its lines in TOML."""

# ruff: noqa: B007, F821, F841 (formulas: what they name is said beside them)
import pytest

import driftwise as dw
from driftwise.models.formula_functions import from_function
from driftwise.models.formulas import read

SECTIONS = dict(
    states={"h": {"unit": "m", "start": 1.0, "std": 0.1}},
    inputs={"q": {}},
    outputs={"level": {"noise": 0.01}},
    parameters={"A": {"start": 1.0}, "k": {"start": 0.02}, "g": {"start": 9.81, "fixed": True}},
)


def tank(x, u, p):
    """A tank with an outflow."""
    out = p.k * math.sqrt(max(x["h"], 1e-9))
    dh = (u.q - out) / p["A"]
    level = x.h
    return dh, level


def by_names(h, q, A, k):
    out = k * sqrt(max(h, 1e-9))
    dh = (q - out) / A
    level = h


def test_a_function_is_the_plant_of_its_lines():
    one, two = from_function(tank, **SECTIONS), from_function(by_names, **SECTIONS)
    assert one.lines == two.lines == (("out", "k * sqrt(max(h, 1e-09))"), ("dh", "(q - out) / A"), ("level", "h"))
    assert one.about == "A tank with an outflow." and one.name == "tank" and not one.is_linear
    assert read(one.text) == one
    assert dw.GreyBox(one).names == ["A", "k"]


def branches(x, u, p):
    if u.q > 0:
        dh = u.q / p.A
    level = x.h


def loops(x, u, p):
    dh = u.q
    for i in range(3):
        dh = dh - p.k
    level = x.h


def unknown(x, u, p):
    dh = (u.q - p.leak) / p.A + p.k
    level = x.h


@pytest.mark.parametrize(
    "function, said",
    [
        (branches, r"branches, line 2: if u.q > 0:: a plant has lines .*a choice is a if condition else b"),
        (loops, r"loops, line 3: .*loops are written out"),
        (unknown, r"unknown: dh = .*unknown name 'leak'"),
        (len, r"len: its source is not to be had"),
    ],
)
def test_what_no_formula_can_be_is_named_with_its_line(function, said):
    with pytest.raises(dw.InputError, match=said):
        from_function(function, **SECTIONS)
