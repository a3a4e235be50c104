"""A chain of n equal lags c/(p + c): its exact response to held and to straight-line inputs, in closed form.

    w_1' = c (w_0 - w_1),  w_2' = c (w_1 - w_2), ..        w_0: what enters

Over a gap D, with x = c D, e_m = exp(-x) x^m / m! and P(j, x) the regularised incomplete gamma function,

    w_j(D) = sum_m e_m w_{j-m}(0)  +  w_0 P(j, x)                                     w_0 held
                                   +  (w_0(D) - w_0(0)) [P(j, x) - (j / x) P(j + 1, x)]     w_0 on a straight line

No matrix exponential, and no digits lost from x = 1e-12 to 1e3: below n + 1 the P come from a series of positive terms,
above from sums that stay near one.
"""

from ...engine.dispatch import kernel
from ...engine.elementary import exp


@kernel
def respond(x, e, held, line):
    """Fill the n weights e_m (m = 0..n-1), and the responses at j = 1..n to a held and to a rising unit input."""
    n = e.size
    if not 0.0 < x < 700.0:
        for j in range(n):
            e[j] = 0.0
            held[j] = 1.0 if x > 0.0 else 0.0
            line[j] = 1.0 - (j + 1) / x if x > 0.0 else 0.0
        e[0] = 0.0 if x > 0.0 else 1.0
        return
    e[0] = exp(-x)
    for m in range(1, n):
        e[m] = e[m - 1] * (x / m)
    last = e[n - 1] * (x / n)
    if x < n + 1:
        above = last * (x / (n + 1))  # P(n + 1, x) = sum of e_m, m > n
        term, m = above, n + 2
        while term > 1e-17 * above:
            term *= x / m
            above += term
            m += 1
        beyond = above
        for j in range(n, 0, -1):
            held[j - 1] = beyond + (e[j] if j < n else last)
            line[j - 1] = held[j - 1] - (j / x) * beyond
            beyond = held[j - 1]
    else:
        held[0] = 1.0 - e[0]
        for j in range(1, n + 1):
            beyond = held[j - 1] - (e[j] if j < n else last)
            line[j - 1] = held[j - 1] - (j / x) * beyond
            if j < n:
                held[j] = beyond


@kernel
def decay(e, w, out):
    """Fill out with sum_m e_m w_{j-m}, the free response; out may be w itself."""
    for j in range(e.size - 1, -1, -1):
        total = 0.0
        for m in range(j + 1):
            total += e[m] * w[j - m]
        out[j] = total if abs(total) > 1e-280 else 0.0  # denormal numbers are slow
