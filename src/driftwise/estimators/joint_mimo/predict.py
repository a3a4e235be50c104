"""Time update of several outputs: F is a shift of each output's state plus data times blocks of parameters.

What is uncertain among the data stands in front of the unknowns, so all but the second-order terms is one linear map:
for a product r z of an uncertain parameter and an uncertain datum (moments of jointly Gaussian variables, Isserlis)

    E r z = r z + cov(r, z),    cov(r z, r' z') - its linear part = cov(r, r') cov(z, z') + cov(r, z') cov(r', z)
"""

from ...engine.dispatch import kernel, rare
from ...engine.ud import entry, orthogonalise
from ..joint.predict import drop_measured
from .row import covariance, place

ROUND = 1e-14  # a pivot so far below its diagonal is round-off


@kernel
def propagate(form, noise, scratch, group, g):
    """s(t | t) to s(t+1 | t): mean and factors, the front dropped."""
    if scratch.q[g] == 0.0:
        shift_mean(form, scratch, group, 0)
        shift_light(form, scratch, group)
        drop_measured(group.U, group.D, group.n)
    else:
        propagate_dense(form, noise, scratch, group, g)


@kernel
def shift_mean(form, scratch, group, q):
    """x+ = shift of each output's x, plus data times parameters."""
    s = group.s
    for j in range(group.first, group.last):
        lo, hi = int(form.x_at[j]) - group.x0 + q, int(form.x_at[j + 1]) - group.x0 + q
        for i in range(lo, hi - 1):
            s[i] = s[i + 1]
        s[hi - 1] = 0.0
    for b in range(group.blocks.size // 4):
        if group.blocks[4 * b + 2] >= 0.0:
            m, row = q + int(group.blocks[4 * b]), q + int(group.blocks[4 * b + 2])
            z = scratch.z[int(group.blocks[4 * b + 3])]
            for i in range(int(group.blocks[4 * b + 1])):
                s[row + i] += z * s[m + i]


@kernel
def shift_light(form, scratch, group):
    """The same for the parameter columns of U, in place; the group has one output."""
    U, n = group.U, group.n
    at = n * (n - 1) // 2
    for c in range(n, group.N):
        column = U[at : at + c]
        for i in range(n - 1):
            column[i] = column[i + 1]
        column[n - 1] = 0.0
        at += c
    add_blocks(scratch, group)


@kernel
def add_blocks(scratch, group):
    """Add data times parameter rows of U to its state rows."""
    U = group.U
    for b in range(group.blocks.size // 4):
        if group.blocks[4 * b + 2] >= 0.0:
            m, row = int(group.blocks[4 * b]), int(group.blocks[4 * b + 2])
            size, z = int(group.blocks[4 * b + 1]), scratch.z[int(group.blocks[4 * b + 3])]
            for c in range(m, group.N):
                at = c * (c - 1) // 2
                column = U[at : at + c]
                above = c - m
                if above < size:
                    column[row + above] += z
                for i in range(min(above, size)):
                    column[row + i] += z * column[m + i]


@rare
def propagate_dense(form, noise, scratch, group, g):
    """The time update that re-triangularises the state: correlated noise, and every kind of missing sample."""
    q, n, N = int(scratch.q[g]), group.n, group.N
    s, D, U, Y, d, c = group.s, group.D, group.U, scratch.Y, scratch.d, scratch.c
    p, of = int(form.outputs), group.last - group.first
    v = q - of
    s2 = scratch.s2[g]
    for i in range(n):
        c[i] = 0.0
        for j in range(n):
            scratch.V[i, j] = 0.0
    add_products(form, scratch, group, g)
    for src in range(scratch.z.size):  # the outputs may have told something about an uncertain datum
        scratch.b[src] = scratch.z[src]
        if scratch.spread[src] > 0.0:
            scratch.z[src] += s[place(form, src)]
    shift_mean(form, scratch, group, q)
    for i in range(n):
        s[q + i] += s2 * c[i]
        for j in range(of):
            s[q + i] += noise.kappa[(group.x0 + i) * p + group.first + j] * s[v + j]

    lay_out(form, noise, scratch, group, q, v)
    add_blocks(scratch, group)
    at = q + n
    at = add_factor(scratch.V, n, s2, Y, d, scratch.g, at)
    lo, hi = int(noise.G_at[g]), int(noise.G_at[g + 1])
    for k in range((hi - lo) // n):
        d[at] = 1.0
        for i in range(n):
            Y[i, at] = noise.G[lo + k * n + i]
        at += 1
    for src in range(scratch.z.size):
        scratch.z[src] = scratch.b[src]
    for i in range(N):
        s[i], D[i] = s[q + i], D[q + i]
    orthogonalise(Y, d, scratch.g, n, at, U, D, form.exact == 1.0)
    for i in range(n):
        if D[i] < form.least[group.x0 + i]:
            D[i] = 0.0


@kernel
def lay_out(form, noise, scratch, group, q, v):
    """Write the front and state columns of F U into Y, and into the row's U the others, short of data times theta."""
    n, N, s, D, A, U, Y, d = group.n, group.N, group.s, group.D, group.A, group.U, scratch.Y, scratch.d
    p, of = int(form.outputs), q - v
    for c in range(q + n):
        d[c] = D[c]
        for i in range(n):
            Y[i, c] = 0.0
        for j in range(of):
            if v + j <= c:
                weight = entry(A, v + j, c)
                for i in range(n):
                    Y[i, c] += noise.kappa[(group.x0 + i) * p + group.first + j] * weight
    for c in range(n, N):
        at, A_at = c * (c - 1) // 2, (c + q) * (c + q - 1) // 2
        to, column = U[at : at + c], A[A_at : A_at + c + q]
        for i in range(n - 1):
            to[i] = column[q + i + 1]
        for i in range(n, c):
            to[i] = column[q + i]
    for j in range(group.first, group.last):
        lo, hi = int(form.x_at[j]) - group.x0, int(form.x_at[j + 1]) - group.x0
        for i in range(lo, hi - 1):
            for c in range(q + i + 1, q + n):
                Y[i, c] += entry(A, q + i + 1, c)
        for c in range(n, N):
            U[c * (c - 1) // 2 + hi - 1] = 0.0
    for c in range(n, N):
        at, A_at = c * (c - 1) // 2, (c + q) * (c + q - 1) // 2
        to = U[at : at + c]
        for j in range(of):
            weight = A[A_at + v + j]
            for i in range(n):
                to[i] += noise.kappa[(group.x0 + i) * p + group.first + j] * weight
    for b in range(group.blocks.size // 4):
        src = int(group.blocks[4 * b + 3])
        if group.blocks[4 * b + 2] >= 0.0 and scratch.spread[src] > 0.0:
            m, row = q + int(group.blocks[4 * b]), int(group.blocks[4 * b + 2])
            for i in range(int(group.blocks[4 * b + 1])):
                add_error(group, Y, q, row + i, place(form, src), s[m + i])


@rare
def add_error(group, Y, q, row, source, weight):
    """Add weight times row ``source`` of A, the error of a datum, to state row ``row``, in Y and in the row's U."""
    n, A = group.n, group.A
    for c in range(source, q + n):
        Y[row, c] += weight * entry(A, source, c)
    for c in range(n, group.N):
        group.U[c * (c - 1) // 2 + row] += weight * A[(c + q) * (c + q - 1) // 2 + source]


@rare
def add_products(form, scratch, group, g):
    """Fill c with the mean and V with the covariance that products of errors add to x (relative to sigma^2)."""
    q = int(scratch.q[g])
    size, A, D, blocks = q + group.N, group.A, group.D, group.blocks
    for b in range(blocks.size // 4):
        src = int(blocks[4 * b + 3])
        if blocks[4 * b + 2] < 0.0 or scratch.spread[src] == 0.0:
            continue
        m, row, here = q + int(blocks[4 * b]), int(blocks[4 * b + 2]), place(form, src)
        for i in range(int(blocks[4 * b + 1])):
            scratch.c[row + i] += covariance(A, D, size, m + i, here)
        for b2 in range(b + 1):
            src2 = int(blocks[4 * b2 + 3])
            if blocks[4 * b2 + 2] < 0.0 or scratch.spread[src2] == 0.0:
                continue
            m2, row2, there = q + int(blocks[4 * b2]), int(blocks[4 * b2 + 2]), place(form, src2)
            P_zz = covariance(A, D, size, here, there)
            for i in range(int(blocks[4 * b + 1])):
                P_mz = covariance(A, D, size, m + i, there)
                for j in range(int(blocks[4 * b2 + 1])):
                    both = covariance(A, D, size, m + i, m2 + j) * P_zz
                    both += P_mz * covariance(A, D, size, m2 + j, here)
                    scratch.V[row + i, row2 + j] += both
                    if b2 < b:
                        scratch.V[row2 + j, row + i] += both


@kernel
def add_factor(V, n, weight, Y, d, size, at):
    """Append columns of covariance weight V (destroyed) to Y; return the next free column. ``size`` is scratch."""
    for j in range(n):
        size[j] = ROUND * V[j, j]
    for j in range(n - 1, -1, -1):
        pivot = V[j, j]
        if pivot > size[j]:
            d[at] = weight * pivot
            for i in range(n):
                Y[i, at] = V[i, j] / pivot if i <= j else 0.0
            for i in range(j):
                for l in range(i + 1):
                    V[l, i] -= Y[l, at] * V[i, j]
            at += 1
    return at
