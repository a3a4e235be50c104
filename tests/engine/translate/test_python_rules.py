"""What Python says a kernel does, C does, bit for bit: order, views, numbers, loops."""

import math

import numpy as np
import pytest
import rules_of_numbers  # noqa: F401  its kernels are among the cases
from in_c import HERE, alike, loaded, translated
from rules_of_order import CASES, HELPERS

from driftwise.engine import dispatch

DIMENSIONS = (int, 1, 2, int, float, 1)
INPUTS = [(0, 0.5), (1, -1.5), (-7, 3.25), (8, 0.0), (3, math.nan)]


@pytest.fixture(scope="module", params=HERE)
def compiled(request, tmp_path_factory):
    lines = ["def choose(which, v, w, k, x, out):"]
    for i, one in enumerate(CASES):
        lines += [f"    if which == {i}:", f"        {one.__name__}(v, w, k, x, out)"]
    choose = dispatch.written("\n".join(lines), "choose", {one.__name__: one for one in CASES})
    text = translated(choose, DIMENSIONS, [*CASES, *HELPERS])
    return loaded(text, tmp_path_factory.mktemp("c"), request.param, DIMENSIONS)


@pytest.mark.parametrize("one", CASES, ids=lambda one: one.__name__)
def test_c_does_what_python_does(one, compiled):
    compared = 0
    for k, x in INPUTS:
        plain, ours = ([np.array([1.5, -2.25, 0.75, 2.0, -0.5]), np.linspace(-2, 3, 12).reshape(3, 4), np.zeros(8)]
                       for _ in range(2))  # fmt: skip
        try:
            with np.errstate(all="ignore"):
                one(plain[0], plain[1], k, x, plain[2])
        except UnboundLocalError:
            continue
        compiled(CASES.index(one), ours[0], ours[1], k, x, ours[2])
        compared += 1
        for a, b in zip(plain, ours):
            assert alike(a, b), (k, x, a, b)
    assert compared > 2


@pytest.mark.parametrize("compiler", HERE)
def test_an_entry_may_name_its_arguments_as_it_likes(compiler, tmp_path):
    """Its own arguments and a host's do not meet; those it does not look at are no warning."""
    for a, n in ("an", "na", "pq"):
        loop = dispatch.written(f"def f({a}, {n}):\n    {a}[0] = {n}\n    return 3\n", "f", {})
        given = np.zeros(2)
        assert loaded(translated(loop, (1, float)), tmp_path, compiler, (1, float))(given, 2.5) == 3
        assert given[0] == 2.5
    loop = dispatch.written("def f(a, x):\n    return int(x)\n", "f", {})
    assert loaded(translated(loop, (1, float)), tmp_path, compiler, (1, float))(np.zeros(2), 2.5) == 2
    loop = dispatch.written("def f(a, n):\n    a[0] = 1.0\n", "f", {})
    assert loaded(translated(loop, (1, int)), tmp_path, compiler, (1, int))(np.zeros(2), 2) == 0
