"""Kernels that do what Python says of order and views, to be compared; and what they call."""
# ruff: noqa: RUF021

from typing import NamedTuple

import numpy as np

from driftwise.engine import views

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
