"""What was at rest leaves: any velocity of the class, from any time on since the last plot.

Every member then expects what an object can do that left at a time u, uniform between two plots d apart, with velocity
v of variance s^2, the class's:

    E (u v)^2 = s^2 d^2/3,   E u v^2 = s^2 d/2,   E v^2 = s^2

which is added to its covariance. So such a plot says where it is and, within that, how fast, and nothing of noise.
Until it comes the chance that it will is part of the forecast (`unforeseen`): there the speed is any up to what is
fast, and s^2 a sixth of that squared.
"""

from ...engine.dispatch import kernel
from ...engine.elementary import square
from . import bank, circle, legs, linear, pole

REST = 0.01  # of what is fast: who went slower between the last two plots was at rest
OFTEN = 0.05  # of plots: that what rests has left, to anywhere the class can go in the time
TAKES = 10.0  # s, from rest to what is fast: between plots that are nearer a departure is a manoeuvre like others


@kernel
def may_come(task, row, C, d):
    """Say whether the object was slow between the last two plots, and the next is late enough for a departure."""
    if d < TAKES:
        return False
    speed2 = 0.0
    for c in range(C):
        speed2 += square(row[bank.of_coordinate(C, bank.SPEED, c)])
    return speed2 <= square(REST * task.fastest)


@kernel
def reach(task, d):
    """Return the variance of where it is d seconds after it was seen at rest, if it has left."""
    return square(task.fastest * d) / 18.0


@kernel
def likelihood(task, row, C, d, y, parts):
    """Return the density of a coordinate of a plot if the object has left its rest; 0 where that explains nothing.

    It was slow, the plot is no farther than what is fast goes, and in a coordinate no scale of the tails is likelier.
    """
    far2 = 0.0
    for c in range(C):
        far2 += square(y[c] - row[bank.of_coordinate(C, bank.LAST, c)])
    if far2 > square(task.fastest * d) or not may_come(task, row, C, d):
        return 0.0
    left = OFTEN / (2.0 * task.fastest * d)
    for c in range(C):
        stayed = 0.0
        for j in range(bank.WILD):
            stayed += parts[c * bank.TAILS + j]
        if left > stayed:
            return left
    return 0.0


@kernel
def leave(task, row, C, T, d, unit):
    """Widen every member, which is at the time of the plot, by all velocities of the class."""
    vv = square(task.fastest)
    pp, pv = vv * d * d / 3, vv * d / 2
    for i in range(bank.KALMAN):
        for c in range(C):
            at = bank.at_linear(C, i, c)
            r = unit[c] * row[at + linear.SCALE]
            row[at + linear.PP] += pp / r
            row[at + linear.PV] += pv / r
            row[at + linear.VV] += vv / r
    for i in range(bank.circles(C)):
        p = bank.at_circle(C, i) + circle.P
        for c in range(C):
            row[p + circle.index(2 * c, 2 * c)] += pp
            row[p + circle.index(2 * c, 2 * c + 1)] += pv
            row[p + circle.index(2 * c + 1, 2 * c + 1)] += vv
    if C == 2:
        L = row[bank.at_legs(C) :]
        for j in range(bank.LEGS):
            L[legs.PP + j] += pp
            L[legs.RE + j] += pv
            L[legs.VV + j] += vv
    for i in range(bank.POLES):
        pole.widen(row, C, i, vv * T * T)
