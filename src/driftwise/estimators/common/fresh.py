"""What parameters have done to a state since they are doubted, where the state has a past of its own.

A = dE[x | theta]/dtheta says what parameters that have always been the same did to x. Had they jumped a moment ago they
would have done nothing before. What they have done since a memory began to doubt them is B, which goes on as A does:

    B+ = F_x B + G,    F_x = shift_up - a e_1',    G = (-H s I, u I)

psi' = h_x' B + h_theta' is the row of whoever believes in the jump. If it is told, x moves along B and not along A, and
B is A from then on. As long as nothing is in doubt B holds the last few samples, the older the less: a doubt begins a
sample or two after the jump. Where outputs and inputs give the state A and B are the same after n samples, and nothing
is kept.

A row keeps a number, what the memory thinks of the doubt, and B. It sees the slopes, and that number behind them.
"""

from ...engine.dispatch import kernel
from ...memory.questions import BELIEVED

BEFORE = 0.5  # a sample, of what parameters did before a doubt begins, which it does late: by a sample or two


@kernel
def show_fresh(fresh, row, A, psi, root):
    """Fill the slopes, in units of the memory: psi with B in place of A; the first of the state is what is measured."""
    N = psi.size
    for j in range(N):
        row[j] = root * (psi[j] - A[0, j] + fresh[1 + j])
    row[N] = fresh[0]


@kernel
def follow_fresh(fresh, row, s, A, psi):
    """Do what the memory has decided; return by how much the innovation is larger after it.

    Where a jump is believed ``row`` has what each parameter jumped by; those that did not have always been as they are.
    """
    rows, N, less = A.shape[0], psi.size, 0.0
    if row[N] == BELIEVED:
        for j in range(N):
            if row[j] != 0.0:
                less += (A[0, j] - fresh[1 + j]) * row[j]
                psi[j] -= A[0, j] - fresh[1 + j]
                for i in range(rows):
                    s[i] -= (A[i, j] - fresh[1 + i * N + j]) * row[j]
                    A[i, j] = fresh[1 + i * N + j]
        for k in range(rows * N):
            fresh[1 + k] = A[k // N, k % N]
    fresh[0] = row[N]
    if fresh[0] == 0.0:
        for k in range(1, fresh.size):
            fresh[k] *= BEFORE
    return less


@kernel
def correct_fresh(fresh, gain, own, N):
    """B <- (I - K h_x') B, K = gain/own."""
    if fresh[0] > 0.0:
        for j in range(N):
            top = fresh[1 + j]
            for i in range(gain.size):
                fresh[1 + i * N + j] -= gain[i] / own * top


@kernel
def pass_fresh(fresh, s, n, blocks, y, u):
    """B <- F_x B + G, of an output y and inputs u."""
    N = (fresh.size - 1) // n
    for j in range(N):
        top = fresh[1 + j]
        for i in range(n):
            below = fresh[1 + (i + 1) * N + j] if i + 1 < n else 0.0
            fresh[1 + i * N + j] = below - s[n + i] * top
    for i in range(n):
        fresh[1 + i * N + i] -= y
        for l in range(blocks):
            fresh[1 + i * N + n * (l + 1) + i] += u[l]
