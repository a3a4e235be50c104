"""Which of the last rows agree? Least trimmed squares: the parameters that leave the smaller half the least squares.

Nothing contradicts a wrong number among the first samples, and in an `ARX` it stays among the regressors; a fit to all
rows follows it. A fit to a few rows in a row does not, where none is among them: of the fits to each few, each drawn
to the half of all rows that it explains best, the one is right that explains its half best, as long as most rows are
right. Rows far from it are left out. Bad at: a parameter that jumps among these rows, whose smaller part it leaves
out; that is why what follows has to predict better before it counts. Source: Rousseeuw (1984), "Least median of
squares regression", J. American Statistical Association 79, 871-880; its steps: Rousseeuw and Van Driessen (2006),
"Computing LTS regression for large data sets", Data Mining and Knowledge Discovery 12, 29-45.
"""

import math

from ..engine.dense import at, solve
from ..engine.dispatch import kernel, rare
from ..engine.layout import Field, Layout, each
from .auto_constants import AGREE, APART, BEYOND, ENOUGH, FEW, LEAST_KNOWN, WITHIN

ROWS = Layout(
    Field("taken", ("1",), "rows so far"),
    *each("N", fit="parameters of the best fit", x="scratch"),
    *each("rows", y="what each row says", square="its squared residual"),
    Field("psi", ("rows", "N"), "the last regressors; the next takes the place of the oldest"),
    given=("N",),
    rows="3 * N + 10",
)
open_rows, rows_size = kernel(ROWS.open), kernel(ROWS.size)


@kernel
def remember(rows, psi, y):
    """Keep a row, in place of the oldest."""
    k = int(rows.taken[0]) % rows.y.size
    rows.y[k] = y
    for i in range(psi.size):
        rows.psi[k, i] = psi[i]
    rows.taken[0] += 1.0


@kernel
def fit_within(rows, limit, unit, A):
    """Fit x to the rows whose squared residual is at most ``limit``; then the residuals are those of x."""
    x, psi, N = rows.x, rows.psi, unit.size
    for j in range(N):
        x[j] = 0.0
        for i in range(j + 1):
            A[at(i, j)] = LEAST_KNOWN / unit[j] if i == j else 0.0
    for k in range(rows.y.size):
        if rows.square[k] <= limit:
            for j in range(N):
                x[j] += psi[k, j] * rows.y[k]
                for i in range(j + 1):
                    A[at(i, j)] += psi[k, i] * psi[k, j]
    solve(A, x)
    square_residuals(rows, x)


@kernel
def square_residuals(rows, x):
    """Let the squared residuals be those of the parameters x."""
    for k in range(rows.y.size):
        e = rows.y[k]
        for i in range(x.size):
            e -= rows.psi[k, i] * x[i]
        rows.square[k] = e * e


@kernel
def smallest(rows, many):
    """Return the largest of the ``many`` smallest squared residuals; only what may still be it is counted."""
    smaller, found = -1.0, math.inf
    for k in range(rows.y.size):
        if smaller < rows.square[k] < found:
            no_larger = 0
            for i in range(rows.y.size):
                no_larger += 1 if rows.square[i] <= rows.square[k] else 0
            if no_larger >= many:
                found = rows.square[k]
            else:
                smaller = rows.square[k]
    return found


@kernel
def sum_within(rows, limit):
    """Return the sum of the squared residuals up to ``limit``, and how many there are."""
    total, many = 0.0, 0
    for k in range(rows.y.size):
        if rows.square[k] <= limit:
            total += rows.square[k]
            many += 1
    return total, many


@rare
def fit_trimmed(rows, unit, A):
    """Fit the rows that agree; return the squared residual beyond which one does not, and how many do.

    ``A`` is scratch, packed.
    """
    count, N = rows.y.size, unit.size
    half, width, first, best = int(AGREE * count), N + FEW, 0, math.inf
    while first + width <= count:
        for k in range(count):
            rows.square[k] = 0.0 if first <= k < first + width else 2.0
        fit_within(rows, 1.0, unit, A)
        for _ in range(2):
            fit_within(rows, smallest(rows, half), unit, A)
        total, many = sum_within(rows, smallest(rows, half))
        if total < best:
            best = total
            for i in range(N):
                rows.fit[i] = rows.x[i]
        first += APART
    square_residuals(rows, rows.fit)
    limit, many = BEYOND * best / many * (count / (count - N)) / WITHIN, 0
    for _ in range(2):
        fit_within(rows, limit, unit, A)
        total, many = sum_within(rows, limit)
        limit = BEYOND * total / max(many - N, 1)
    total, many = sum_within(rows, limit)
    return limit, many


@kernel
def says_enough(rows, limit):
    """Say whether rows that agree move every parameter: where few rows do, those are no wrong ones."""
    for i in range(rows.fit.size):
        kept = total = 0.0
        for k in range(rows.y.size):
            total += rows.psi[k, i] * rows.psi[k, i]
            if rows.square[k] <= limit:
                kept += rows.psi[k, i] * rows.psi[k, i]
        if kept < ENOUGH * total:
            return False
    return True
