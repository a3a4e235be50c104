"""What a plant does from one sample to the next, and the exact slopes of that by its state and its parameters.

Linear in the state, x' = A x + b, and A, b have the slopes A_j, b_j by the parameters. Over t seconds

    x(t) = x + E [x; 1],   E = sum_k t^k/k! A^(k-1) [A, b],    dE/dtheta_j term by term,

over t / 2^i and doubled i times: E <- 2 E + E_x E, E_x being all but the last column (Al-Mohy and Higham, 2009), with
Q, the noise that walks of density W add: its series from Q' = W + A Q + Q A', doubled by Q <- Q + F Q F'. A, b,
A_j and b_j come from n + 1 evaluations of the formulas. Where they bend in the state, Runge and Kutta's method of
fourth order is differentiated along with the steps it takes. A discrete plant says its next state itself.
"""

import math

from ...engine.dispatch import kernel, rare
from ...engine.status import STIFF
from ...models.formula_kernels import move

SHORT = 0.5  # |A| t up to which the series is taken
LEAST = 1e-17  # its terms below this are left out
STRIDE = 0.1  # |A| t of one step of Runge and Kutta
MOST = 500  # steps of Runge and Kutta in one sample


@kernel
def norm(slopes, n):
    """Return the largest row sum of the slopes by the state."""
    largest = 0.0
    for i in range(n):
        total = 0.0
        for l in range(n):
            total += abs(slopes[i, l])
        largest = max(largest, total)
    return largest


@kernel
def step_plant(form, plant, x, u, seconds, m, scratch):
    """Fill ``scratch.next``, x some seconds later with u held, ``J`` = [F, S], and ``Q``; return a status.

    S is that by the first ``m`` parameters: none, where all are known.
    """
    n, k, J = x.size, int(form.inputs), scratch.J
    if form.is_continuous == 0.0:
        move(plant, x, u, scratch.values, scratch.next, scratch.slopes)
        for i in range(n):
            for l in range(n):
                J[i, l] = scratch.slopes[i, l]
            for j in range(m):
                J[i, n + j] = scratch.slopes[i, n + k + j]
        noise_of_slopes(form, seconds, scratch)
        return 0
    if form.is_linear == 0.0:
        status = step_by_slopes(form, plant, x, u, seconds, m, scratch)
        noise_of_slopes(form, seconds, scratch)
        return status
    take_apart(form, plant, u, m, scratch)
    expand_series(form, seconds, m, scratch)
    for i in range(n):
        scratch.next[i] = x[i] + scratch.E[i, n]
        for l in range(n):
            scratch.next[i] += scratch.E[i, l] * x[l]
            J[i, l] = scratch.E[i, l] + (1.0 if i == l else 0.0)
        for j in range(m):
            at = i * (n + 1)
            J[i, n + j] = scratch.slope_E[j, at + n]
            for l in range(n):
                J[i, n + j] += scratch.slope_E[j, at + l] * x[l]
    return 0


@kernel
def take_apart(form, plant, u, m, scratch):
    """Fill M = [A, b] and its slopes by the parameters: the formulas at x = 0, and one unit further along each axis."""
    n, k, w = scratch.next.size, int(form.inputs), scratch.next.size + 1
    x = scratch.next
    for i in range(n):
        x[i] = 0.0
    move(plant, x, u, scratch.values, scratch.dx, scratch.slopes)
    for i in range(n):
        scratch.M[i, n] = scratch.dx[i]
        for l in range(n):
            scratch.M[i, l] = scratch.slopes[i, l]
        for j in range(m):
            scratch.slope_M[j, i * w + n] = scratch.slopes[i, n + k + j]
    for l in range(n if m > 0 else 0):
        x[l] = 1.0
        move(plant, x, u, scratch.values, scratch.dx, scratch.slopes)
        x[l] = 0.0
        for i in range(n):
            for j in range(m):
                scratch.slope_M[j, i * w + l] = scratch.slopes[i, n + k + j] - scratch.slope_M[j, i * w + n]


@kernel
def expand_series(form, seconds, m, scratch):
    """Fill E and its slopes, and Q."""
    n, w, M, E, term = scratch.next.size, scratch.next.size + 1, scratch.M, scratch.E, scratch.term
    reach, h, doublings = norm(M, n) * seconds, seconds, 0
    while reach > SHORT and doublings < 60:
        reach, h, doublings = 0.5 * reach, 0.5 * h, doublings + 1
    for i in range(n):
        for c in range(w):
            E[i, c] = term[i, c] = h * M[i, c]
            for j in range(m):
                scratch.slope_E[j, i * w + c] = scratch.slope_term[j, i * w + c] = h * scratch.slope_M[j, i * w + c]
        for l in range(n):
            scratch.Q[i, l] = scratch.V[i, l] = h * form.walk[i * n + l]
    size, order = reach, 1
    while size > LEAST and order < 30:
        order += 1
        size *= reach / order
        for j in range(m):  # h/k (A term_j + A_j term)
            times(M, scratch.slope_term[j], scratch.spare, n)
            add_times(scratch.slope_M[j], term, scratch.spare, n)
            for i in range(n):
                for c in range(w):
                    value = scratch.spare[i, c] * (h / order)
                    scratch.slope_term[j, i * w + c] = value
                    scratch.slope_E[j, i * w + c] += value
        for i in range(n):
            for c in range(w):
                scratch.spare[i, c] = 0.0
                for l in range(n):
                    scratch.spare[i, c] += M[i, l] * term[l, c]
        for i in range(n):
            for c in range(w):
                term[i, c] = scratch.spare[i, c] * (h / order)
                E[i, c] += term[i, c]
        if form.walks > 0.0:
            product(M, scratch.V, scratch.G, n)
            for i in range(n):
                for l in range(n):
                    scratch.V[i, l] = (scratch.G[i, l] + scratch.G[l, i]) * (h / order)
                    scratch.Q[i, l] += scratch.V[i, l]
    for _ in range(doublings):
        for j in range(m):
            times(E, scratch.slope_E[j], scratch.spare, n)
            add_times(scratch.slope_E[j], E, scratch.spare, n)
            for i in range(n):
                for c in range(w):
                    scratch.slope_E[j, i * w + c] = 2.0 * scratch.slope_E[j, i * w + c] + scratch.spare[i, c]
        if form.walks > 0.0:
            double_noise(E, scratch.Q, scratch.V, scratch.G, n)
        for i in range(n):
            for c in range(w):
                scratch.spare[i, c] = 0.0
                for l in range(n):
                    scratch.spare[i, c] += E[i, l] * E[l, c]
        for i in range(n):
            for c in range(w):
                E[i, c] = 2.0 * E[i, c] + scratch.spare[i, c]


@kernel
def product(A, B, C, n):
    """Fill C = A B, (n, n); A may be wider."""
    for i in range(n):
        for l in range(n):
            C[i, l] = 0.0
            for r in range(n):
                C[i, l] += A[i, r] * B[r, l]


@kernel
def double_noise(E, Q, V, G, n):
    """Q <- Q + (I + E) Q (I + E)'."""
    product(E, Q, V, n)
    for i in range(n):
        for l in range(n):
            V[i, l] += Q[i, l]
    for i in range(n):
        for l in range(n):
            G[i, l] = V[i, l]
            for r in range(n):
                G[i, l] += V[i, r] * E[l, r]
    for i in range(n):
        for l in range(n):
            Q[i, l] += 0.5 * (G[i, l] + G[l, i])


@kernel
def noise_of_slopes(form, seconds, scratch):
    """Fill Q where the plant bends, or is discrete: with the slopes as they are, by the trapezoidal rule."""
    n, W, J = scratch.next.size, form.walk, scratch.J
    for i in range(n):
        for l in range(n):
            carried = W[i * n + l]
            if form.is_continuous > 0.0:
                carried = 0.0
                for r in range(n):
                    carried += J[i, r] * W[r * n + r] * J[l, r]
            scratch.Q[i, l] = 0.5 * seconds * (W[i * n + l] + carried)


@kernel
def times(A, flat, out, n):
    """Fill out = A_x B for a table B that lies flat, (n, n + 1); A_x is all of A but the last column."""
    w = n + 1
    for i in range(n):
        for c in range(w):
            out[i, c] = 0.0
            for l in range(n):
                out[i, c] += A[i, l] * flat[l * w + c]


@kernel
def add_times(flat, B, out, n):
    """Add A_x B for a table A that lies flat, (n, n + 1)."""
    w = n + 1
    for i in range(n):
        for c in range(w):
            for l in range(n):
                out[i, c] += flat[i * w + l] * B[l, c]


@rare
def step_by_slopes(form, plant, x, u, seconds, m, scratch):
    """Fill next and J by Runge and Kutta's method, in steps short against what the slopes say; return a status."""
    n, k, status = x.size, int(form.inputs), 0
    J, K, stage, point = scratch.J, scratch.K, scratch.stage, scratch.mean
    for i in range(n):
        scratch.next[i] = x[i]
        for c in range(n + m):
            J[i, c] = 1.0 if i == c else 0.0
    move(plant, scratch.next, u, scratch.values, scratch.dx, scratch.slopes)
    wanted = norm(scratch.slopes, n) * seconds / STRIDE
    if not wanted < MOST:
        wanted, status = MOST, STIFF
    steps = int(wanted) + 1
    h = seconds / steps
    for _ in range(steps):
        for i in range(n):
            scratch.spare[i, 0] = 0.0  # the sum of the stages' dx
            point[i] = scratch.next[i]
            for c in range(n + m):
                K[i, c] = 0.0
                stage[i, c] = J[i, c]
        for part in range(4):
            weight = 2.0 if part == 1 or part == 2 else 1.0
            way = 0.5 * h if part < 2 else h
            move(plant, point, u, scratch.values, scratch.dx, scratch.slopes)
            for c in range(n + m):
                for i in range(n):
                    total = scratch.slopes[i, k + c] if c >= n else 0.0
                    for l in range(n):
                        total += scratch.slopes[i, l] * stage[l, c]
                    scratch.term[i, 0] = total
                for i in range(n):
                    K[i, c] += weight * scratch.term[i, 0]
                    stage[i, c] = J[i, c] + way * scratch.term[i, 0]
            for i in range(n):
                scratch.spare[i, 0] += weight * scratch.dx[i]
                point[i] = scratch.next[i] + way * scratch.dx[i]
        for i in range(n):
            scratch.next[i] += (h / 6.0) * scratch.spare[i, 0]
            for c in range(n + m):
                J[i, c] += (h / 6.0) * K[i, c]
    return status


@kernel
def is_number(m, scratch):
    """Say whether the step came to numbers."""
    n, total = scratch.next.size, 0.0
    for i in range(n):
        total += abs(scratch.next[i])
        for c in range(n + m):
            total += abs(scratch.J[i, c])
    return total < math.inf
