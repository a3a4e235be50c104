"""What no plot has shown yet: that the next is as far off as the class lets one expect of a second one.

density     (1 - w) sum q_j N(m, kappa_j s) + w N(m, s + v)     in each coordinate
chance      w = A/(n + A) after n plots, none of which was so: the rule of succession; of what rests that it leaves, too
variance    v = (B d)^2, B of what is fast for the class, d since the last plot; while a place repeats, a cell's, too,
            at rest that of any velocity of the class from any time on (`departure`)

So a track that began precisely, or rests, does not swear that it goes on so: its errors may become those of the class
from one plot on, or it may turn as the class does, which no plot of its own has shown.
"""

from ...engine.dispatch import kernel
from ...engine.elementary import square
from . import bank, departure

BEFOREHAND = 0.07  # plots that were so, before the first
UNSEEN = 3.8  # s of what is fast: error on a lattice whose step is unknown, any from 2 ms of it to a minute, rms
FAR = 0.1  # of what is fast for the class in the time: how far off a plot is of which nothing else is known


@kernel
def may_leave(task, row, C, d):
    """Say whether the next plot, d seconds after the last, may be that of what rested and has left."""
    return row[bank.SEEN] >= 2.0 and departure.may_come(task, row, C, d)


@kernel
def share(task, row, C, d):
    """Return how likely the plot that comes d seconds after the last is so."""
    w = BEFOREHAND / (row[bank.SEEN] + BEFOREHAND)
    return 1.0 - (1.0 - w) * (1.0 - departure.OFTEN) if may_leave(task, row, C, d) else w


@kernel
def of_class(task, d):
    """Return the variance of a plot, d seconds after the last, of which the class alone is known."""
    return square(FAR * task.fastest * d)


@kernel
def largest_cell(row, C):
    """Return the step of the coarsest lattice that a coordinate was seen to lie on, 0 if none was."""
    step = 0.0
    for k in range(C):
        step = max(step, row[bank.of_coordinate(C, bank.GRAIN, k)])
    return step


@kernel
def variance(task, row, C, d, c):
    """Return the same of a coordinate, that of the first plot that leaves a cell whose size nobody knows included."""
    v = of_class(task, d) + (departure.reach(task, d) if may_leave(task, row, C, d) else 0.0)
    if not (row[bank.of_coordinate(C, bank.STILL, c)] > 0.0 and row[bank.of_coordinate(C, bank.GRAIN, c)] == 0.0):
        return v
    return v + square(max(UNSEEN * task.fastest, largest_cell(row, C)))
