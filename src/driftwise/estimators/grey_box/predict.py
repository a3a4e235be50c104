"""Time update of the joint filter of state and parameters: s and U D U' from one instant to the next.

The parameters stay what they are: U_x,theta <- F U_x,theta + S U_theta,theta, and the state is made triangular again.
"""

from ...engine.dense import at
from ...engine.dispatch import kernel
from ...engine.status import UNDEFINED
from ...engine.ud import entry, factor_within, orthogonalise
from .gain_slopes import differentiate_step, find_slopes, is_wanted, pass_slopes
from .row import room_of
from .transform import in_units
from .transition import is_number, step_plant


@kernel
def factor_noise(scratch):
    """Fill the factors of Q."""
    for j in range(scratch.Dq.size):
        for i in range(j + 1):
            scratch.packed[at(i, j)] = scratch.Q[i, j]
    factor_within(scratch.packed, scratch.Uq, scratch.Dq)


@kernel
def predict(form, plant, seconds, s, state, scratch):
    """Take state and covariance so many seconds on; return a status."""
    n, m, U, D, J, Y = int(form.n), 0, state.U, state.D, scratch.J, scratch.Y
    for j in range(int(form.m)):
        m = int(form.m) if D[n + j] > 0.0 else m  # where all parameters are known nothing depends on them
    if is_wanted(form, D) > 0.0:
        find_slopes(form, state, room_of(form, scratch))
        differentiate_step(form, plant, seconds, s, state, room_of(form, scratch), scratch)
    in_units(form, s[n:], scratch.values, scratch.rates)
    status = step_plant(form, plant, s[:n], state.held, seconds, m, scratch)
    if not is_number(m, scratch):
        return UNDEFINED
    if form.walks > 0.0:
        factor_noise(scratch)
    if is_wanted(form, D) > 0.0:
        pass_slopes(form, state, scratch)
    # U_x,theta <- F U_x,theta + S U_theta,theta
    for c in range(n, n + m):
        column = U[c * (c - 1) // 2 :]
        for i in range(n):
            total = J[i, c] * scratch.rates[c - n]
            for l in range(n):
                total += J[i, l] * column[l]
            for j in range(n, c):
                total += J[i, j] * scratch.rates[j - n] * column[j]
            scratch.dx[i] = total
        for i in range(n):
            column[i] = scratch.dx[i]
    # U_xx D_x U_xx' <- F U_xx D_x U_xx' F' + Q (Thornton)
    for i in range(n):
        s[i] = scratch.next[i]
        scratch.weight[i] = D[i]
        scratch.weight[n + i] = scratch.Dq[i] if form.walks > 0.0 else 0.0
        first = 0
        for j in range(n):
            Y[i, j] = J[i, j]
            for l in range(j):
                Y[i, j] += J[i, l] * U[first + l]
            first += j
            Y[i, n + j] = entry(scratch.Uq, i, j) if i <= j and form.walks > 0.0 else 0.0
    columns = 2 * n if form.walks > 0.0 else n
    orthogonalise(Y, scratch.weight, scratch.g, n, columns, U, D, False)
    return status
