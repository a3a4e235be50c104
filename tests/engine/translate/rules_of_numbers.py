"""Kernels that do what Python says of numbers and loops, to be compared."""
# ruff: noqa: B002, B007, B020, F841, RUF021, RUF059

import math

from rules_of_order import (
    GRID,
    LARGE,
    ROWS,
    SMALL,
    TABLE,
    bump,
    case,
    ends,
    grown,
    is_bumped,
    search,
    sign,
)

from driftwise.engine.dispatch import abreast

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
def powers_of_two(v, w, k, x, out):
    out[0], out[1], out[2] = -k // 4, -k % 4, (1 - 2 * k) % 8
    out[3], out[4], out[5] = (1 - 2 * k) // 2 + 1, -(k // 8), k * k % 2 * 3


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
