"""The bank of a track: which models of motion compete, and where each keeps its numbers.

Every noise is a share of the plots' own: a grid of dimensionless numbers fits a ship's radar and a satellite receiver.
T is the time between plots, r the variance of a plot.
"""

import math

from ...engine.dispatch import kernel

# of a velocity forgotten at rate alpha, under white acceleration of intensity q: alpha T, q T^3 / r; constant velocity,
# and wandering: what a turn looks like that is too fast for the radar
STRAIGHT = ((0.0, 1e-4), (0.0, 1e-3), (0.0, 1e-2), (0.0, 0.1), (0.0, 1.0), (0.0, 10.0), (0.5, 100.0))
# of an acceleration forgotten at rate alpha, under white jerk of intensity j: alpha T, j T^5 / r
CURVED = ((0.0, 1.0), (0.2, 1e-2), (0.2, 1.0), (0.2, 100.0))
# of a coordinated turn: q T^3 / r
TURNS = (1e-3, 0.1)
# of the manoeuvre pole, learnt: radius rho of C(q) = (1 - rho q)^2
RADII = (0.2, 0.4, 0.6, 0.75, 0.87)

LINES, CURVES, CIRCLES, POLES = len(STRAIGHT), len(CURVED), len(TURNS), len(RADII)
KALMAN = LINES + CURVES

# of a row: plots seen, time of the last, log of the typical and of the last time between plots, probability of a
# manoeuvre, whether one was told, plots that the stated variance is worth; then per coordinate ..
SEEN, TIME, PERIOD, GAP, MANOEUVRE, ALERT, TRUST, HEAD = range(8)
# .. first plot, last plot less the first, last velocity between plots, log of a plot's variance, what was stated of it
FIRST, LAST, SPEED, LOG, STATED, EACH = range(6)
SCALES = tuple(4.0**k for k in range(-2, 6))  # of the predictive density's tails
TAILS = len(SCALES)
LINEAR = 10  # per coordinate: position, velocity, acceleration; upper triangle of their covariance; noise scale
CIRCULAR = 5 + 15  # E, vE, N, vN, omega T and their covariance
OUTPUTS = ("prediction", "innovation", "base", "log_score", "lower", "upper")  # of a row of the trace, per coordinate


def names(C) -> tuple[str, ...]:
    """Return what the members are called."""
    told = [f"wandering, {q:g}" if a else f"constant velocity, {q:g}" for a, q in STRAIGHT]
    told += [f"Singer, {j:g}" if a else f"constant acceleration, {j:g}" for a, j in CURVED]
    told += [f"turn, {q:g}" for q in TURNS[: circles(C)]]
    return (*told, *(f"manoeuvre pole, {rho:g}" for rho in RADII))


@kernel
def circles(C):
    """Return how many members turn: it takes a plane."""
    return CIRCLES if C == 2 else 0


@kernel
def members(C):
    """Return how many members there are."""
    return KALMAN + circles(C) + POLES


@kernel
def triangle(n):
    """Return the size of the upper triangle of a matrix."""
    return n * (n + 1) // 2


@kernel
def pole_size(C):
    """Return the numbers of a member with a manoeuvre pole: two states a coordinate, the pole, covariance, scales."""
    return 2 * C + 1 + triangle(2 * C + 1) + C


@kernel
def circle_size(C):
    """Return the numbers of a member that turns."""
    return CIRCULAR + C


@kernel
def at_tails(C):
    """Return where the counts of the tails start in a row; the log weights follow."""
    return HEAD + EACH * C


@kernel
def at_weights(C):
    """Return where the log weights start."""
    return at_tails(C) + TAILS


@kernel
def at_linear(C, i):
    """Return where member i of constant velocity, acceleration or Singer starts."""
    return at_weights(C) + members(C) + i * LINEAR * C


@kernel
def at_circle(C, i):
    """Return where the i-th member that turns starts."""
    return at_linear(C, KALMAN) + i * circle_size(C)


@kernel
def at_pole(C, i):
    """Return where the i-th member with a manoeuvre pole starts."""
    return at_circle(C, circles(C)) + i * pole_size(C)


@kernel
def row_size(C):
    """Return the numbers of a state."""
    return at_pole(C, POLES)


@kernel
def of_coordinate(C, what, c):
    """Return where a number of coordinate c stands."""
    return HEAD + EACH * c + what


# --- columns of a row of the trace: OUTPUTS per coordinate, then ... --------------------------------------------


@kernel
def column(C, what, c):
    """Return the column of one of OUTPUTS."""
    return what * C + c


@kernel
def at_state(C):
    """Return where position, velocity, acceleration of each coordinate start; the triangle of their covariance next."""
    return len(OUTPUTS) * C


@kernel
def at_covariance(C):
    """Return where the triangle of the covariance of the state starts."""
    return at_state(C) + 3 * C


@kernel
def at_told(C):
    """Return where the single numbers start: CROSS ... STATUS; shares of the tails and weights of the members next."""
    return at_covariance(C) + triangle(3 * C)


CROSS, SPREADING, MANOEUVRING, ONSET, TURN, TURN_SD, POLE, POLE_SD, STATUS, TOLD = range(10)


@kernel
def at_shares(C):
    """Return where the shares of the tails start."""
    return at_told(C) + TOLD


@kernel
def columns(C):
    """Return how many columns a row of the trace has."""
    return at_shares(C) + TAILS + members(C)


@kernel
def period(row):
    """Return the typical time between plots."""
    return math.exp(row[PERIOD])
