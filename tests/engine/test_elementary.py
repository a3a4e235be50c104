"""The elementary functions against mpmath: how far off they are in units of the last place, and what limits give.

Arguments are drawn over all binades, and where a method changes or digits cancel. The bound asserted is the one that
the functions promise; the README beside them has the largest error of the long run.
"""

import ast
import ctypes
import inspect
import math
import random
import shutil
import subprocess

import mpmath as mp
import numpy as np
import pytest
from draws import draws, slow
from scipy import special

from driftwise.engine import elementary, jit
from driftwise.engine.elementary import cos, erfc, exp, expm1, hypot, lgamma, log, log1p, pairs, pow, sin, turns
from driftwise.engine.elementary.complementary import erfc_both
from driftwise.engine.translate.c99 import Printer
from driftwise.engine.translate.program import Program
from driftwise.engine.translate.types import FLOAT, View

PROMISED = dict.fromkeys(elementary.__all__, 1.0) | {"lgamma": 2.0}
PAIRS = "hypot", "pow"  # functions of two arguments
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
LARGEST = 1.7976931348623157e308


def binade(r, lowest, highest, signed=False):
    """Draw a number whose power of two is uniform; subnormal below -1022."""
    x = math.ldexp(r.uniform(1.0, 2.0), r.randint(lowest, highest))
    return -x if signed and r.random() < 0.5 else x


def about(r, centre, furthest):
    """Draw a number about another one, at a distance from an ulp to 2^furthest."""
    return centre + binade(r, -53, furthest, True)


def near_turn(r, digits):
    """Draw one of the doubles next to a multiple of pi/2."""
    with mp.workprec(1200):
        x = float(r.randint(1, 2 ** r.randint(1, digits)) * mp.pi / 2)
    return r.choice([x, -x, math.nextafter(x, math.inf), math.nextafter(x, 0.0)])


def legs(r):
    """Draw two numbers, neither of which is nothing beside the other."""
    k = r.randint(-1070, 1022)
    return binade(r, k, k, True), binade(r, k - min(30, k + 1073), k, True)


DRAWN = {
    "log": [lambda r: binade(r, -1073, 1023), lambda r: r.uniform(0.5, 2.0), lambda r: about(r, 1.0, -2)],
    "log1p": [
        lambda r: binade(r, -1073, 1023), lambda r: r.uniform(-1.0, 3.0), lambda r: binade(r, -60, -1, True),
        lambda r: -1.0 + binade(r, -53, -1), lambda r: about(r, math.sqrt(2.0) - 1.0, -3),
    ],
    "exp": [
        lambda r: r.uniform(-745.1, 709.78), lambda r: r.uniform(-2.0, 2.0), lambda r: binade(r, -60, 1, True),
        lambda r: r.uniform(-745.1, -700.0), lambda r: about(r, (r.randint(-1000, 1000) + 0.5) * math.log(2.0), -9),
    ],
    "expm1": [
        lambda r: r.uniform(-40.0, 709.78), lambda r: r.uniform(-2.0, 2.0), lambda r: binade(r, -1073, 1, True),
        lambda r: r.uniform(10.0, 45.0),
    ],
    "erfc": [
        lambda r: r.uniform(-6.0, 27.2), lambda r: r.uniform(-0.6, 0.6), lambda r: r.uniform(0.45, 3.2),
        lambda r: r.uniform(-3.0, -0.4), lambda r: r.uniform(26.0, 27.22), lambda r: binade(r, -60, 1, True),
    ],
    "lgamma": [
        lambda r: binade(r, -1073, -1), lambda r: r.uniform(0.0, 1.0), lambda r: r.uniform(1.0, 2.0),
        lambda r: r.uniform(2.0, 8.0), lambda r: r.uniform(8.0, 100.0), lambda r: binade(r, 3, 1013),
        lambda r: about(r, 1.0, -2), lambda r: about(r, 2.0, -2),
    ],
    "sin": [
        lambda r: binade(r, -1073, 40, True), lambda r: r.uniform(-10.0, 10.0), lambda r: r.uniform(-1e9, 1e9),
        lambda r: near_turn(r, 39), lambda r: binade(r, 40, 1023, True), lambda r: near_turn(r, 1000),
    ],
    "square": [lambda r: binade(r, -536, 511, True)],
    "hypot": [legs, lambda r: (r.uniform(-2.0, 2.0), r.uniform(-2.0, 2.0)), lambda r: (binade(r, -600, 600), 1.0)],
    "pow": [
        lambda r: (r.random(), r.random()), lambda r: (binade(r, -1073, 1023), r.uniform(-2.0, 2.0)),
        lambda r: (about(r, 1.0, -1), binade(r, 0, 45, True)), lambda r: (r.uniform(0.0, 9.0), float(r.randint(-9, 9))),
    ],
}  # fmt: skip
DRAWN["cos"] = DRAWN["sin"]
EXACT = {
    "lgamma": mp.loggamma,
    "square": lambda x: x * x,
    "pow": lambda x, y: mp.mpf(x) ** y,
}


def error(function, exact, *arguments):
    """Return how far off a function is, in units of the last place of the exact value."""
    with mp.workprec(1250 if exact in (mp.sin, mp.cos) and abs(arguments[0]) > 2**40 else 300):
        true = exact(*map(mp.mpf, arguments))
        rounded = float(true)
        found = function(*arguments)
        if not math.isfinite(rounded) or not math.isfinite(found):
            return 0.0 if found == rounded else math.inf
        return float(abs(found - true) / math.ulp(rounded))


def worst(name, count, seed):
    """Return the largest error among arguments drawn from all places in turn, and where it was."""
    r, function, exact = random.Random(seed), getattr(elementary, name), EXACT.get(name) or getattr(mp, name)
    found = 0.0, ()
    for i in range(count):
        drawn = DRAWN[name][i % len(DRAWN[name])](r)
        arguments = drawn if isinstance(drawn, tuple) else (drawn,)
        found = max(found, (error(function, exact, *arguments), arguments))
    return found


@draws("count", 2_000, 12_000)
@pytest.mark.parametrize("name", PROMISED)
def test_error_is_as_promised(name, count):
    found, where = worst(name, count, 1)
    assert found < PROMISED[name], where


@pytest.mark.slow
@pytest.mark.parametrize("name", PROMISED)
def test_error_is_as_promised_in_a_long_run(name):
    found, where = worst(name, 500_000, 2)
    print(f"{name}: {found:.3f} ulp at {where}")
    assert found < PROMISED[name], where


def test_hardest_angles():
    """Of all doubles these are the closest to a multiple of pi/2, and pi itself, many times (Kahan; Muller, 2006)."""
    for x in (6381956970095103.0 * 2.0**797, 5.3193726483265414e255, 1e22, 2.0**120 * math.pi, LARGEST, 355.0):
        assert error(sin, mp.sin, x) < 1.0 and error(cos, mp.cos, x) < 1.0
    assert sin(-1e22) == -sin(1e22) and cos(-1e22) == cos(1e22)


def test_zeros_of_lgamma():
    assert lgamma(1.0) == lgamma(2.0) == 0.0
    for x in (math.nextafter(1.0, 0.0), math.nextafter(1.0, 2.0), math.nextafter(2.0, 1.0), math.nextafter(2.0, 3.0)):
        assert error(lgamma, mp.loggamma, x) < 2.0


LIMITS = [0.0, 5e-324, 2.3e-308, 1e-17, 0.5, 1.0, 1.5, 2.0, 3.0, 28.0, 708.0, 709.8, 746.0, 1e16, 1e200, LARGEST]
LIMITS.append(math.inf)
LIMITS += [-x for x in LIMITS] + [math.nan]


@pytest.mark.parametrize(
    "function, known",
    [(log, np.log), (log1p, np.log1p), (exp, np.exp), (expm1, np.expm1), (erfc, special.erfc), (sin, np.sin),
     (cos, np.cos)],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_limits_are_those_of_c(function, known):
    for x in LIMITS:
        np.testing.assert_allclose(function(x), known(x), rtol=1e-15, err_msg=repr(x))
        if known(x) == 0.0:
            assert math.copysign(1.0, function(x)) == math.copysign(1.0, known(x)), x


def test_limits_of_lgamma():
    for x in LIMITS:
        known = math.nan if x != x or x < 0.0 else math.inf if x == 0.0 or x == math.inf else float(mp.loggamma(x))
        np.testing.assert_allclose(lgamma(x), known, rtol=1e-15, err_msg=repr(x))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_limits_of_two_arguments():
    for x in LIMITS:
        for y in LIMITS:
            np.testing.assert_allclose(hypot(x, y), np.hypot(x, y), rtol=1e-15, err_msg=repr((x, y)))
            if (x >= 0.0 and math.copysign(1.0, x) > 0) or x != x or y == 0.0:
                np.testing.assert_allclose(pow(x, y), np.power(x, y), rtol=1e-15, err_msg=repr((x, y)))
            elif x < 0.0:
                assert math.isnan(pow(x, y))


def test_both_tails_are_those_of_each_side():
    for x in [*LIMITS, *drawn_table("erfc", 3000)[:, 0].tolist()]:
        assert same_bits(np.array(erfc_both(x)), np.array([erfc(x), erfc(-x)])), x


def sources():
    """Return the modules of the elementary functions, as trees."""
    places = {inspect.getmodule(getattr(elementary, name)) for name in elementary.__all__}
    return [ast.parse(inspect.getsource(module)) for module in (*places, pairs, turns)]


def test_nothing_is_taken_from_a_library_that_is_not_exact():
    exact = {"frexp", "ldexp", "sqrt", "copysign", "inf", "nan"}
    for tree in sources():
        taken = [node for node in ast.walk(tree) if isinstance(node, ast.Attribute)]
        assert all(node.value.id == "math" and node.attr in exact for node in taken)


def drawn_table(name, count):
    """Return arguments (n, 2) drawn as above, and all limits; the second of them is 0 where a function has one."""
    r, places = random.Random(3), DRAWN[name]
    drawn = [places[i % len(places)](r) for i in range(count)]
    is_pair = isinstance(drawn[0], tuple)
    drawn += [(x, y) for x in LIMITS for y in LIMITS] if is_pair else LIMITS
    return np.array(drawn if is_pair else [(x, 0.0) for x in drawn])


def loop(name, module=elementary):
    """Return the kernel that fills ``out`` with a function of the rows of a table."""
    function = getattr(module, name)

    def of_one(table, out):
        for i in range(table.shape[0]):
            out[i] = function(table[i, 0])

    def of_two(table, out):
        for i in range(table.shape[0]):
            out[i] = function(table[i, 0], table[i, 1])

    return of_two if name in PAIRS else of_one


def plain(name, table):
    """Return a function of the rows of a table, by numbers of Python."""
    function = getattr(elementary, name)
    return [function(*row) if name in PAIRS else function(row[0]) for row in table.tolist()]


def in_c(name, folder, options=("-O2",)):
    """Return the same loop translated to C and compiled; no library is linked."""
    kernel = Program().function(loop(name), [View(2, FLOAT), View(1, FLOAT)])
    source, built = folder / f"{name}.c", folder / f"{name}{''.join(options)}.so"
    source.write_text(Printer().program(kernel, "go", (2, 1)))
    strict = ["-std=gnu99", "-ffp-contract=off", "-fno-math-errno", "-Wall", "-Werror", "-nostdlib", "-shared", "-fPIC"]
    subprocess.run([COMPILER, *options, *strict, "-o", built, source], check=True)
    go = ctypes.CDLL(str(built)).go

    def run(table, out):
        go((ctypes.c_void_p * 2)(table.ctypes.data, out.ctypes.data), (ctypes.c_longlong * 3)(*table.shape, len(out)))

    return run


def filled(run, table):
    """Return what a loop gives."""
    out = np.zeros(len(table))
    run(table, out)
    return out


def same_bits(a, b):
    """Say whether numbers are the same, signs of zero included; there is one nan."""
    a, b = (np.where(np.isnan(x), np.nan, x).view(np.int64) for x in (a, b))
    return np.array_equal(a, b)


@pytest.mark.skipif(COMPILER is None, reason="no compiler of C")
@pytest.mark.parametrize("name", elementary.__all__)
@pytest.mark.parametrize("options", [slow("-O2"), "-O3 -march=native"])
def test_c_has_the_same_bits(name, options, tmp_path):
    table = drawn_table(name, 3000)
    assert same_bits(filled(in_c(name, tmp_path, options.split()), table), plain(name, table))


@pytest.mark.slow
@pytest.mark.parametrize("name", elementary.__all__)
def test_compiled_has_the_same_bits(name):
    import numba

    jit._bind()
    table = drawn_table(name, 3000)
    assert same_bits(filled(numba.njit(loop(name), **jit.OPTIONS), table), plain(name, table))
