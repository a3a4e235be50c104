"""Time update of the joint filter: s(t | t) to s(t+1 | t), whatever is missing and however the noise is coloured.

With w = kappa w_n + G xi the measured y tells about w: s+ = (F - kappa H) s + kappa y + G xi. Only the x rows of U
change; they shift, and the state block is re-triangularised where its noise needs it.
"""

from ...engine.dispatch import choice, kernel, rare
from ...engine.ud import orthogonalise, predicted_variance, variance, widen
from ...models.noise import Coloured, Sensor, Unknown, White, correlate, held_back
from .noise_columns import add_columns, add_difference_spread, add_spread, add_square, covariance_with_output
from .row import HAS_KAPPA, OBSERVED, USED_Y, predict_output, project

SETTLED = 1e-6  # variance of a below which a product with a is as good as linear


@kernel
def shift_mean(s, n, inputs, y, u):
    """x+ = shift_up(x) - y a + sum_l u_l b_l."""
    for i in range(n):
        x = -y * s[n + i]
        if i + 1 < n:
            x += s[i + 1]
        for l in range(inputs):
            x += u[l] * s[n * (l + 2) + i]
        s[i] = x


@kernel
def shift_factor(U, N, n, inputs, y, u):
    """The same for the parameter columns of U: U[x, theta] becomes (F U)[x, theta]."""
    at = n * (n - 1) // 2
    for c in range(n, N):
        column = U[at : at + c]
        for i in range(n - 1):
            column[i] = column[i + 1]
        column[n - 1] = 0.0
        for g in range(inputs + 1):
            weight = -y if g == 0 else u[g - 1]
            lo = n * (g + 1)
            above = c - lo  # rows of this block above the diagonal
            if above < n:
                if above >= 0:
                    for i in range(above):
                        column[i] += weight * column[lo + i]
                    column[above] += weight
                break
            for i in range(n):
                column[i] += weight * column[lo + i]
        at += c


@kernel
def drop_measured(U, D, n):
    """With no state noise the measured state leaves and a known zero enters: U[x, x] moves up, D = 0 enters."""
    for j in range(n - 1):
        at, after = j * (j - 1) // 2, (j + 1) * j // 2
        for i in range(j):
            U[at + i] = U[after + i + 1]
        D[j] = D[j + 1]
    at = (n - 1) * (n - 2) // 2
    for i in range(n - 1):
        U[at + i] = 0.0
    D[n - 1] = 0.0


@kernel
def lay_out(U, D, f, kappa, n, rows, Y, d):
    """Write (F - kappa H) U into Y and U: Y takes the columns to re-triangularise, U keeps the others.

    The parameter columns of U have been shifted already.
    """
    N = D.size
    for j in range(n):
        at, d[j] = j * (j - 1) // 2, D[j]
        for i in range(n - 1):
            below = U[at + i + 1] if i + 1 < j else (1.0 if i + 1 == j else 0.0)
            Y[i, j] = below - kappa[i] * f[j]
        Y[n - 1, j] = -kappa[n - 1] * f[j]
        for i in range(n, rows):
            Y[i, j] = -kappa[i] * f[j]
    for c in range(n, N):
        at = c * (c - 1) // 2
        if rows == n:
            for i in range(n):
                U[at + i] -= kappa[i] * f[c]
        else:
            d[c] = D[c]
            for i in range(rows):
                Uic = U[at + i] if i < c else (1.0 if i == c else 0.0)
                Y[i, c] = Uic - kappa[i] * f[c]


@choice
def propagate(noise, state, scratch, z, yhat, R, T, s2, is_measured, is_held, direct, doubt):
    """Time update of mean and factors; z is the measured y, unused where there is none, ``doubt`` its variance.

    ``direct`` is the variance that held inputs add to y through their direct terms.
    """


@propagate.on(White)
def propagate_white(noise, state, scratch, z, yhat, R, T, s2, is_measured, is_held, direct, doubt):
    if is_held or not is_measured or doubt > 0.0:
        propagate_gap(noise, state, scratch, z, yhat, R, T, s2, is_measured, doubt)
        return
    n = scratch.n
    scratch.memo[USED_Y], scratch.memo[HAS_KAPPA] = z, 0.0
    shift_mean(state.s, n, scratch.inputs, z, state.held)
    shift_factor(state.U, state.D.size, n, scratch.inputs, z, state.held)
    drop_measured(state.U, state.D, n)


@propagate.on(Sensor)
def propagate_sensor(noise, state, scratch, z, yhat, R, T, s2, is_measured, is_held, direct, doubt):
    # The noise is on y alone, so the state follows x_n, not y: x+ = shift_up(x) - a (H s) + b u, bilinear. That is the
    # step of a missing y with the filtered H s in place of y and no noise; its moments are exact.
    yhat = predict_output(state.s, state.held, scratch.direct, scratch.offset)
    project(state.U, state.D.size, state.held, scratch.direct, scratch.offset, scratch.f)
    T = predicted_variance(scratch.f, state.D, direct)
    widest = 0.0
    for i in range(scratch.n):
        widest = max(widest, variance(state.U, state.D, scratch.n + i))
    if s2 * widest < SETTLED:
        T = 0.0  # a is known so well that the product's own spread is no part of the answer
    propagate_dense(noise, state, scratch, z, yhat, 0.0, T, s2, False, 0.0)


@propagate.on(Unknown)
def propagate_unknown(noise, state, scratch, z, yhat, R, T, s2, is_measured, is_held, direct, doubt):
    propagate_dense(noise, state, scratch, z, yhat, R, T, s2, is_measured, doubt)


@propagate.on(Coloured)
def propagate_coloured(noise, state, scratch, z, yhat, R, T, s2, is_measured, is_held, direct, doubt):
    propagate_dense(noise, state, scratch, z, yhat, R, T, s2, is_measured, doubt)


@choice
def release(noise, state, scratch, s2):
    """Let the noise polynomial be unknown from the sample on that has shown the size of sigma^2."""


@release.on(White, Sensor, Coloured)
def release_white(noise, state, scratch, s2):
    pass


@release.on(Unknown)
def release_unknown(noise, state, scratch, s2):
    if state.head[OBSERVED] == noise.settle:  # sigma^2 has been learnt: d may be, relative to it
        first, free = scratch.n * (scratch.inputs + 2), held_back(noise, state.head[OBSERVED] - 1.0, s2)
        for i in range(first, first + scratch.n):
            widen(state.U, state.D, i, min(free, noise.most), scratch.c)


@choice
def add_missing_product(noise, state, scratch, R, T, s2, at):
    """Append the spread of the product a y, y missing with variance T; return the next column."""


@add_missing_product.on(White, Sensor, Coloured)
def add_missing_product_white(noise, state, scratch, R, T, s2, at):
    if T <= 0.0:
        return at
    return add_spread(
        state.U, state.D, scratch.n, -1, s2 * T, scratch.n, scratch.rows, scratch.Y, scratch.d, scratch.g, at
    )


@add_missing_product.on(Unknown)
def add_missing_product_unknown(noise, state, scratch, R, T, s2, at):
    n, c = scratch.n, scratch.n * (scratch.inputs + 2)
    if noise.spread == 0.0:
        return add_spread(state.U, state.D, n, -1, s2 * T, n, scratch.rows, scratch.Y, scratch.d, scratch.g, at)
    at = add_spread(state.U, state.D, n, -1, s2 * (T - R), n, scratch.rows, scratch.Y, scratch.d, scratch.g, at)
    return add_difference_spread(state.U, state.D, c, n, s2 * R, n, scratch.rows, scratch.Y, scratch.d, at)


@choice
def add_noise_product(noise, state, scratch, s2, at):
    """Append the spread of the product d v, v = y - H s; return the next column."""


@add_noise_product.on(White, Sensor, Coloured)
def add_noise_product_white(noise, state, scratch, s2, at):
    return at


@add_noise_product.on(Unknown)
def add_noise_product_unknown(noise, state, scratch, s2, at):
    U, D, n, first = state.U, state.D, scratch.n, scratch.n * (scratch.inputs + 2)
    covariance_with_output(U, D, scratch.f, first, n, scratch.c)
    if noise.spread == 0.0:
        return at
    Tx = predicted_variance(scratch.f, D, 0.0)
    at = add_spread(U, D, first, -1, s2 * Tx, n, scratch.rows, scratch.Y, scratch.d, scratch.g, at)
    return add_square(scratch.c, s2, n, scratch.rows, scratch.Y, scratch.d, at)


@choice
def multiply_noise(noise, state, scratch, v, s2):
    """Let the innovation v pass through the unknown noise polynomial, where kappa has not done so."""


@multiply_noise.on(White, Sensor, Coloured)
def multiply_noise_white(noise, state, scratch, v, s2):
    pass


@multiply_noise.on(Unknown)
def multiply_noise_unknown(noise, state, scratch, v, s2):
    k, first = scratch.inputs, scratch.n * (scratch.inputs + 2)
    state.held[k] = v
    for i in range(scratch.n):
        state.s[i] += (1.0 - noise.gradient) * v * state.s[first + i] - noise.spread * s2 * scratch.c[i]


@rare
def add_doubt(state, scratch, doubt, s2, at):
    """Append what an error of this variance in the measured y does to x: it is multiplied by kappa - a."""
    n, rows, Y, d = scratch.n, scratch.rows, scratch.Y, scratch.d
    d[at] = doubt / s2
    for i in range(rows):
        Y[i, at] = scratch.kappa[i] - (state.s[n + i] if i < n else 0.0)
    return add_spread(state.U, state.D, n, -1, doubt, n, rows, Y, d, scratch.g, at + 1)


@rare
def propagate_gap(noise, state, scratch, z, yhat, R, T, s2, is_measured, doubt):
    """The same where a sample is missing or in doubt, and would not have been needed otherwise."""
    propagate_dense(noise, state, scratch, z, yhat, R, T, s2, is_measured, doubt)


@kernel
def propagate_dense(noise, state, scratch, z, yhat, R, T, s2, is_measured, doubt):
    """The time update that re-triangularises: correlated noise, and every kind of missing sample."""
    s, U, D, n, rows, kappa, Y, d = (
        state.s,
        state.U,
        state.D,
        scratch.n,
        scratch.rows,
        scratch.kappa,
        scratch.Y,
        scratch.d,
    )
    N, k, held = D.size, scratch.inputs, state.held
    correlate(noise, s[n * (k + 2) : n * (k + 3)], kappa)
    at, share = add_noise(noise, state, scratch, R, s2, is_measured)
    if is_measured:
        y = z
        rest = z - predict_output(s, held, scratch.direct, scratch.offset)
        project(U, N, held, scratch.direct, scratch.offset, scratch.f)
        at = add_noise_product(noise, state, scratch, s2, at)
        if doubt > 0.0:
            at = add_doubt(state, scratch, doubt, s2, at)
        shift_mean(s, n, k, z, held)
        for i in range(rows):
            s[i] += kappa[i] * rest
        multiply_noise(noise, state, scratch, share * rest, s2)
    else:
        # F(yhat, u) - [a; 0] H, and the Isserlis terms T P_aa + c c' of the product a y
        # (all relative to sigma^2, which a product of two covariances carries twice)
        y = yhat
        covariance_with_output(U, D, scratch.f, n, n, scratch.c)
        at = add_missing_product(noise, state, scratch, R, T, s2, at)
        at = add_square(scratch.c, s2, n, rows, Y, d, at)
        shift_mean(s, n, k, yhat, held)
        for i in range(n):
            s[i] -= s2 * scratch.c[i]
        for l in range(k, scratch.blocks):
            held[l] = 0.0
    shift_factor(U, N, n, scratch.blocks, y, held)
    scratch.memo[USED_Y], scratch.memo[HAS_KAPPA] = y, 1.0
    lay_out(U, D, scratch.f, kappa, n, rows, Y, d)
    orthogonalise(Y, d, scratch.g, rows, at, U, D, noise.R == 0.0)
    for i in range(n):  # known theta: x is known ever better, geometrically; denormal numbers are six times slower
        if D[i] < scratch.least:
            D[i] = 0.0


@kernel
def add_noise(noise, state, scratch, R, s2, is_measured):
    """Write the noise on x into columns of Y and settle kappa; return the next free column and v's share of its error.

    Each column is noise shared by x (in Y) and y (in g). A measured y tells about it: regress on y, kappa its
    coefficients. A missing y was replaced in F by its prediction: then kappa = [a; 0], since -a y carries it into x.
    U itself takes the first columns of Y.
    """
    s, U, D, n, rows, kappa, Y, d, g = (
        state.s,
        state.U,
        state.D,
        scratch.n,
        scratch.rows,
        scratch.kappa,
        scratch.Y,
        scratch.d,
        scratch.g,
    )
    at, share = rows, 1.0
    is_held = False
    for l in range(scratch.inputs):
        is_held = is_held or state.input_variance[l] > 0.0
    if is_held or not is_measured:
        d[at], g[at] = R, 1.0
        for i in range(rows):
            Y[i, at] = kappa[i]
        at += 1
        for l in range(scratch.inputs):
            input_variance = state.input_variance[l]
            if input_variance > 0.0:
                b0 = D.size - scratch.direct - scratch.offset + l if scratch.direct > 0 else -1
                at = add_spread(U, D, n * (l + 2), b0, input_variance, n, rows, Y, d, g, at)
                d[at] = input_variance / s2
                g[at] = s[b0] if b0 >= 0 else 0.0
                for i in range(rows):
                    Y[i, at] = s[n * (l + 2) + i] if i < n else 0.0
                at += 1
        if is_measured:
            total = 0.0
            for c in range(rows, at):
                total += d[c] * g[c] * g[c]
            for i in range(rows):
                kappa[i] = 0.0
                for c in range(rows, at):
                    kappa[i] += d[c] * Y[i, c] * g[c]
                kappa[i] = kappa[i] / total if total > 0.0 else 0.0
            share = R / total if total > 0.0 else 0.0
        else:
            for i in range(rows):
                kappa[i] = s[n + i] if i < n else 0.0
        for c in range(rows, at):
            for i in range(rows):
                Y[i, c] -= kappa[i] * g[c]
    return add_columns(noise, rows, Y, d, at), share
