"""Random kernels give the same bits in C as in Python, whatever compiler takes them."""

import numpy as np
import pytest
from draws import draws
from in_c import HERE, alike, loaded, translated
from random_kernels import NAMES, SCOPE, kernels

from driftwise.engine import dispatch

DIMENSIONS = (int, 1, 2, int, float, 1, 1)
INPUTS = [(0, 0.0), (1, -1.5), (3, np.nan), (-2, 1e3)]


def given():
    """Return fresh arguments."""
    rng = np.random.default_rng(3)
    return np.round(rng.normal(size=5), 2), np.round(rng.normal(size=(3, 4)), 2), np.zeros(8), np.zeros(1)


def differences(seeds, folder, compiler, flags=()) -> tuple[list[str], int]:
    """Return the kernels whose numbers differ, with their texts, and how many runs were compared."""
    text, names = kernels(seeds)
    scope = dict(SCOPE)
    choose = dispatch.written(text, "choose", scope)
    printed = translated(choose, DIMENSIONS, [scope[name] for name in (*NAMES, *names)])
    go = loaded(printed, folder, compiler, DIMENSIONS, ["-w", "-Wno-error", *flags])
    wrong, compared = [], 0
    for i, name in enumerate(names):
        for k, x in INPUTS:
            plain, ours = given(), given()
            try:
                with np.errstate(all="ignore"):
                    choose(i, plain[0], plain[1], k, x, *plain[2:])
            except (ArithmeticError, ValueError, IndexError, UnboundLocalError):
                continue  # Python stops there, C does not
            go(i, ours[0], ours[1], k, x, *ours[2:])
            compared += 1
            if not all(map(alike, plain, ours)):
                body = text[text.index(f"def {name}(") :].split("\ndef ")[0]
                wrong.append(f"{name}{k, x}\n{body}\n{plain}\n{ours}")
                break
    return wrong, compared


@pytest.mark.parametrize("compiler", HERE[:1])
@draws("seeds", range(30), range(100))
def test_a_few_random_kernels(compiler, seeds, tmp_path):
    wrong, compared = differences(seeds, tmp_path, compiler, ["-O0"])
    assert not wrong, f"{len(wrong)}: {min(wrong, key=len)}"
    assert compared > 2 * len(seeds)


@pytest.mark.slow
@pytest.mark.parametrize("compiler", HERE)
@pytest.mark.parametrize("part", range(5))
def test_many_random_kernels(part, compiler, tmp_path):
    wrong, compared = differences(range(1000 + 400 * part, 1400 + 400 * part), tmp_path, compiler)
    assert not wrong, f"{len(wrong)}: {min(wrong, key=len)}"
    assert compared > 800
