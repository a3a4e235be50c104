"""What Python says a kernel does, C does, bit for bit: order, views, numbers, loops."""
# ruff: noqa: B002, B007, B020, F841, RUF021, RUF059

import math
from typing import NamedTuple

import numpy as np
import pytest
from in_c import HERE, alike, loaded, translated

from driftwise.engine import dispatch, views
from driftwise.engine.dispatch import abreast

CASES = []
HELPERS = []
TABLE, ROWS, GRID = (0.5, -1.0, 3.0), ((1.0, 2.0), (-3.0, 4.0)), np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
SMALL, LARGE = 5e-324, 1.7e308


def case(function):
    """Add a kernel to those that are compared."""
    CASES.append(function)
    return function


def helper(function):
    """Add a kernel that others call."""
    HELPERS.append(function)
    return function


class Two(NamedTuple):
    """A pair of different kinds."""

    number: float
    count: int


class Nested(NamedTuple):
    """A view and a pair."""

    view: np.ndarray
    two: Two


@helper
def bump(v, i):
    v[i] += 1.0
    return v[i]


@helper
def is_bumped(v, i, x):
    v[i] += 1.0
    return x > 0.0


@helper
def sign(x):
    if x > 0:
        return 1
    if x < 0:
        return -1.0
    return 0


@helper
def search(v, x):
    i = 0
    while True:
        if i == v.size or v[i] > x:
            return i
        i += 1


@helper
def ends(v):
    return v[0], v[v.size - 1]


@helper
def clear(v):
    v[:] = 0.0


@helper
def grown(v, x, n):
    n += 1
    x = x * n
    return Two(x, n)


# --- the order in which things happen --------------------------------------------------------------------------


@case
def what_stands_left_is_read_first(v, w, k, x, out):
    out[0] = v[0] + bump(v, 0) * v[0] - bump(v, 0)
    out[1] = -v[1] + bump(v, 1) if v[1] < bump(v, 1) else v[1]


@case
def arguments_come_in_order(v, w, k, x, out):
    out[0] = max(bump(v, 0), v[0], bump(v, 0), v[0])
    two = Two(v[1], int(bump(v, 1)))
    out[1], out[2] = two.number, two.count


@case
def and_or_stop_early(v, w, k, x, out):
    if x > 0.0 and is_bumped(v, 0, x) or is_bumped(v, 1, x):
        out[0] = 1.0
    is_both = is_bumped(v, 2, x) and is_bumped(v, 3, -x) and v[3] > 0.0
    out[1] = 2.0 if not is_both else 3.0


@case
def a_chain_stops_early(v, w, k, x, out):
    if v[0] < x < bump(v, 0) < bump(v, 1):
        out[0] = 1.0
    out[1] = 1.0 if -1.0 <= bump(v, 2) <= 1.0 else 0.0


@case
def one_way_alone_is_taken(v, w, k, x, out):
    out[0] = v[0] + (bump(v, 0) if x > 0.0 else bump(v, 1)) + v[0]
    row = w[0] if is_bumped(v, 2, x) else w[1]
    out[1] = row[0]


@case
def values_before_targets(v, w, k, x, out):
    i = 0
    i, v[i] = 1, 7.0
    v[int(bump(v, 2)) % 2] = v[2]
    v[0], v[1], v[2] = v[2], v[0], v[1]
    v[i % 2] += bump(v, i % 2)
    out[0] = i


@case
def an_index_is_read_once(v, w, k, x, out):
    v[int(v[0]) % 3] += bump(v, 0)
    v[int(v[0]) % 3] *= bump(v, 0)


@case
def several_targets(v, w, k, x, out):
    first = second = bump(v, 0)
    third = out[2] = fourth = x * 3.0
    (fifth, sixth), seventh = (first, second), third
    out[0], out[1], out[3], out[4] = first, second, fourth, fifth + sixth + seventh


@case
def names_change_places(v, w, k, x, out):
    a, b, c = x, x + 1.0, x + 2.0
    a, b, c = c, a, b
    a, b = b - a, a
    out[0], out[1], out[2] = a, b, c


@case
def loops_whose_test_is_a_call(v, w, k, x, out):
    n = 0
    while bump(v, 0) < 9.0 and bump(v, 1) < 4.0:
        n += 1
        if n == 2:
            continue
        if n > 4:
            break
        out[0] += 1.0
    out[1] = n


# --- views ------------------------------------------------------------------------------------------------------


@case
def two_names_of_one_row(v, w, k, x, out):
    row, same = w[1], w[1, 1:]
    row[1] = x
    out[0] = same[0]
    same[1] = bump(row, 1)
    out[1] = row[2] + w[1, -2]


@case
def columns(v, w, k, x, out):
    last, first = w[:, -1], w[:, k % 4]
    last[0] = x
    out[0], out[1] = first[-1], w[0][3]
    either = w[:, 1] if x > 0 else v
    out[2], out[3] = either[1], either.size
    part = last[1:]
    part[-1] = 3.5
    out[4] = w[2, 3] + part.size


@case
def slices_clip(v, w, k, x, out):
    long, none, tail, short = v[1:99], v[4:2], v[-9:2], v[:-9]
    out[0], out[1], out[2], out[3] = long.size, none.size, tail.size, short.size
    v[3:99] = x
    v[-2:-1] = 8.0
    out[4] = w[0, k % 4 :].size


@case
def folded(v, w, k, x, out):
    table = w.reshape(4, 3)
    table[3, 0] = x
    square = views.matrix(v[1:], 2, 2)
    square[1][0] = 9.0
    flat = w[1:].reshape(8)
    out[0], out[1], out[2] = flat[-1], square[-1, -1], table.shape[1] + len(table)


@case
def rows_to_names(v, w, k, x, out):
    a, b, c = w
    b[0] = a[1] + c[2]
    p, q = ends(a)
    out[0], out[1] = p, q


@case
def views_in_tuples(v, w, k, x, out):
    thing = Nested(w[2], Two(x, k))
    thing.view[0] = thing.two.number
    for row in (v, w[0], thing.view):
        row[1] += 1.0
        out[0] += row.size
    clear(thing.view[2:])


# --- numbers ----------------------------------------------------------------------------------------------------


@case
def a_variable_grows(v, w, k, x, out):
    n = 0
    for i in range(3):
        n = n + (1 if i < 1 else 0.5)
    flag = x > 1.0
    flag = flag or x < -1.0
    count = int(flag)
    count += 2
    out[0], out[1], out[2] = n, count / 2, grown(v, 2, 3).number


@case
def whole_division(v, w, k, x, out):
    out[0], out[1], out[2], out[3] = k // 3, k % 3, k // -3, k % -3
    out[4], out[5] = (k * 2 + 1) // 4, -k // 2


@case
def rounding(v, w, k, x, out):
    out[0], out[1] = int(v[0] * 3.0), int(-v[0] * 3.0)
    out[2], out[3] = math.floor(v[0] * 3.0), math.floor(-v[0] * 3.0)
    out[4] = math.floor(2.0) + math.floor(-2.0)


@case
def powers(v, w, k, x, out):
    n = k % 5 - 2
    out[0], out[1], out[2] = n**2, n**3, 2**n if n > 0 else 1
    out[3], out[4] = (n + 1) ** 6, 3**4


@case
def largest_and_smallest(v, w, k, x, out):
    nan, zero = x - x, 0.0
    out[0], out[1] = max(zero, -zero), max(-zero, zero)
    out[2], out[3] = min(zero, -zero), min(-zero, zero)
    out[4], out[5] = max(nan, 1.0), max(1.0, nan)
    out[6], out[7] = min(v[0], k, 2), max(ends(v))


@case
def signs_of_zero(v, w, k, x, out):
    zero = 0.0 * v[0]
    out[0], out[1], out[2] = -zero, 0.0 - zero, zero - 0.0
    out[3], out[4] = math.copysign(2.0, -zero), abs(-zero)
    out[5] = -1.0 * zero + 0.0


@case
def words_of_floats(v, w, k, x, out):
    m, e = math.frexp(SMALL * 3.0 if x > 0.0 else v[0] * 1e300)
    out[0], out[1] = m, e
    out[2], out[3], out[4] = math.ldexp(m, e), math.ldexp(v[0], -1074), math.ldexp(v[0], -1030)
    out[5], out[6] = math.ldexp(v[0], 1020), math.sqrt(abs(v[1]))
    out[7] = 1.0 if math.isnan(x) or not math.isfinite(v[0] * LARGE * 10.0) else 0.0


@case
def truth_of_numbers(v, w, k, x, out):
    out[0] = 1.0 if k else 2.0
    out[1] = 1.0 if not x else 2.0
    if k and v[0] or x:
        out[2] = 1.0
    out[3] = bool(k) + (x > 0.0) * 2 if k > 0 else 3


@case
def constant_tables(v, w, k, x, out):
    out[0], out[1], out[2] = TABLE[k % 3], TABLE[-1], ROWS[k % 2][1]
    out[3], out[4] = GRID[k % 2, 2], GRID[1, 0]
    a, b = ROWS[k % 2]
    out[5], out[6] = a, b
    for one in TABLE:
        out[7] += one * x


@case
def precedence(v, w, k, x, out):
    a, b, c = v[0], v[1], v[2]
    out[0], out[1], out[2] = a - (b - c), a - (b + c), a / (b / c)
    out[3], out[4] = -(a - b) * -c, -(-a)
    out[5] = (a if b > c else c) + (b if not (a > b or b > c and c > a) else -1.0)
    out[6] = ((a < b) == (b < c)) * 1.0
    out[7] = a * (b * c) + (a + b) * c - 2.0 * -3.0


# --- loops and ways through -------------------------------------------------------------------------------------


@case
def a_counter_lives_on(v, w, k, x, out):
    i = 9
    for i in range(k % 3):
        out[0] += 1.0
    out[1] = i
    for j in range(4, -1, -2):
        if j < 3:
            break
    out[2] = j
    for i in range(4):
        unused = v[i]
    out[4] = i
    for m in range(3):
        m = m * 2
        out[3] += m


@case
def an_end_that_changes(v, w, k, x, out):
    n = 3
    for i in range(n):
        n += i
        for i in range(i, n % 5):
            out[0] += i
    size = v[1:]
    for i in range(size.size):
        size = v[3:]
        out[1] += 1.0
    for i in range(int(max(v[0], 2.0))):
        v[0] = 5.0
        out[2] += 1.0
    out[3] = n


@case
def left_in_the_middle(v, w, k, x, out):
    for i in range(3):
        for j in range(3):
            if j > i:
                break
            if (i + j) % 2:
                continue
            out[0] += v[i] * j
        if out[0] > 2.0:
            return
    out[1] = 1.0


@case
def given_in_one_way_alone(v, w, k, x, out):
    if x > 0.0:
        y, n = x, 1
    if x > 0.0:
        out[0] = y + n
    for i in range(3):
        if i == 0:
            z = v[0]
        out[1] += z
        z = v[i] if True else 0.0


@case
def turns_that_have_nothing_to_do_with_one_another(v, w, k, x, out):
    for i in abreast(v.size):
        t = abs(v[i]) * x
        out[i] = max(t / 3.0, v[i]) if t > 1.0 else t * v[i] + 1.0
        v[i] += t
    for i in abreast(2):
        out[5 + i] = out[i] - w[1, i]


@case
def results_nobody_wants(v, w, k, x, out):
    bump(v, 0)
    unused = bump(v, 1)
    also, more = ends(v)
    x = sign(x)
    out[0] = x
    if x > 0.0:
        never = v[2]
    if not is_bumped(v, 3, x):
        pass


@case
def several_kinds_of_result(v, w, k, x, out):
    out[0], out[1], out[2] = sign(x), sign(-x), sign(0)
    out[3], out[4] = search(v, x), search(w[1], 0.0)


@case
def python_names_that_c_knows(v, w, k, x, out):
    int_, double, long, default, signed, n, p, a, I = x, 1.0, 2.0, 3.0, 4.0, 5, 6.0, 7.0, 8.0
    struct, t1_, main, log, union, NULL, errno = double, long, default, signed, n, p, I
    out[0] = int_ + struct + t1_ + main + log + union + NULL + errno + a


# --- comparing --------------------------------------------------------------------------------------------------

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
