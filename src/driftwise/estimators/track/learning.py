"""What a track learns of its plots: their noise, the tails of its forecast, the lattice they lie on.

noise        of each member and coordinate: c <- c + g (min(e^2/S, 9) - 1) c, above what no plot is; at a start that
             was wild it falls at once where two plots are near what is expected
variance     of a plot, from the second differences of the first twelve
tails        a plot is shared out among the scales that may have made it
pace         plots that come faster than any so far have less noise than what was learnt of it: as at the start
lattice      a step that equals the one before it shows no error; the first that does not shows the lattice
lines        a plot on the line of those before it was drawn by a publisher, and shows no error either
"""

import math

from ...engine.dispatch import kernel
from ...engine.elementary import exp, log, square
from . import bank, circle, legs, linear, pole, unforeseen

MOST = 9.0  # that one e^2/S counts for the noise, unless the last was as large
LOUD, AT_ONCE = 25.0, 0.5  # two such in a row are no accident: so much of the second the noise takes at once
CALM, CALM_BEFORE = 0.15, 0.5  # e^2/S of both coordinates, and of the plot before: a noise scale is too large
EASED, TAUGHT = 0.3, 1.0  # what such a plot leaves of it, above what second differences say ..
FRESH, TRIED = 3.0, 30.0  # .. beyond so many plots, and while so few are known that wild ones may have taught it
FUZZ, EXACT = 0.01, 1e-9  # of a lattice's step, and of a step itself: what is no difference
EQUAL, RULED = 1.0, 2.0  # a step, by the one before it
CELLS = 0.2  # of a step that repeats: the cell, rms, where it is that of one, of two, .. or plots are exact
BENT, ROUNDED = 3e-7, 1e-8  # 1/m, what a plane bends of a line of degrees; m, what numbers of this size round
LEAST_COUNT = 1e-3  # of the tails, of what they start with
LEAST_WILD = 0.02  # .. and plots that were wild: however many were not, one may be
YOUNG = 20.0  # plots, memory of the tails at first
LOG_MEAN = 1.27  # -E log z^2, z normal
EVEN = bank.SCALES.index(1.0)  # the scale of what errs as expected
LEARNT_BY = 12  # plots: the variance of a plot is then left to the noise of each member
PERIODS = 50.0  # plots by which the typical time between plots is known
FASTER = 2.5  # than plots have come so far: their noise is learnt anew, ..
KNOWN, ANEW = 8.0, 6.0  # .. once so many plots were seen, as if only these had been
PACES = 200.0  # plots in which the shortest time between them is forgotten
FINEST, COARSEST = 1e-6, 1e6  # a plot's standard deviation, of what is fast for the class between two plots
PRIOR = (0.1, 0.4, 2.0, 0.25, 0.06, 0.02, 0.01, 0.005, 0.05)  # plots that each scale of the tails is worth beforehand


@kernel
def enter(task, row, t, y, R, C):
    """Take the first plot; R (C,) its stated variance, NaN is unknown."""
    row[bank.SEEN], row[bank.TIME], row[bank.MANOEUVRE], row[bank.ALERT], row[bank.TRUST] = (
        1.0,
        t,
        task.starts,
        0.0,
        1.0,
    )
    for c in range(C):
        row[bank.of_coordinate(C, bank.FIRST, c)], row[bank.of_coordinate(C, bank.LAST, c)] = y[c], 0.0
        row[bank.of_coordinate(C, bank.SPEED, c)] = 0.0
        row[bank.of_coordinate(C, bank.STATED, c)] = R[c]
        if R[c] > 0.0:
            row[bank.TRUST] = task.claim
    row[bank.row_at(C).known] = 1.0
    for j in range(bank.TAILS):
        row[bank.row_at(C).tails + j] = PRIOR[j]
    for i in range(bank.members(C)):
        row[bank.row_at(C).weights + i] = -bank.BEHIND[i] if i < bank.LINES else task.doubt


@kernel
def least_variance(task, row, T, c):
    """Return the variance below which no plot's is taken: that of rounding, where places are those of a lattice."""
    return max(
        square(FINEST * task.fastest * T), square(row[bank.of_coordinate(int(task.coordinates), bank.GRAIN, c)]) / 12.0
    )


@kernel
def sane(task, row, T, R, c):
    """Return a stated variance, within what plots of the class can have; NaN stays."""
    return min(max(R, least_variance(task, row, T, c)), square(COARSEST * task.fastest * T)) if R > 0.0 else R


@kernel
def start_members(task, row, d, C, unit):
    """Start the bank.members on the first plot, now that the time to the second is known."""
    row[bank.PERIOD] = row[bank.GAP] = row[bank.PACE] = log(d)
    T = bank.period(row)
    for c in range(C):
        stated = sane(task, row, T, row[bank.of_coordinate(C, bank.STATED, c)], c)
        unit[c] = stated if stated > 0.0 else unforeseen.of_class(task, d)
        row[bank.of_coordinate(C, bank.LOG, c)] = log(unit[c])
    linear.begin(row, C, T, task.fastest, unit)
    for i in range(bank.circles(C)):
        circle.begin(row, C, i, T, task.fastest, unit)
    if C == 2:
        legs.begin(row, C, task.fastest, unit)


@kernel
def measure_units(task, row, C, T, R, unit, g):
    """Fill the variance of a plot by what is known of it, and g: how much of that this plot has."""
    for c in range(C):
        unit[c] = max(exp(row[bank.of_coordinate(C, bank.LOG, c)]), least_variance(task, row, T, c))
        stated = sane(task, row, T, row[bank.of_coordinate(C, bank.STATED, c)], c)
        g[c] = sane(task, row, T, R[c], c) / stated if stated > 0.0 and R[c] > 0.0 else 1.0


@kernel
def compare_steps(row, C, d, y, off, exact):
    """Fill by how much each step differs from the one before it, and EQUAL where it does not, as on a lattice.

    RULED where the line from the plots before goes on, to what a plane bends of a line of degrees: no error is that
    small, and who resampled the record drew the plot there.
    """
    gap, coarse, size2, apart2 = exp(row[bank.GAP]), 0.0, 0.0, 0.0
    for c in range(C):
        before, step = row[bank.of_coordinate(C, bank.SPEED, c)], y[c] - row[bank.of_coordinate(C, bank.LAST, c)]
        off[c] = abs(step - before * gap)
        coarse = max(coarse, row[bank.of_coordinate(C, bank.GRAIN, c)], off[c])
        size2 += square(step)
        apart2 += square(step - before * d)
    is_ruled = size2 > 0.0 and apart2 <= square(ROUNDED + BENT * size2)
    for c in range(C):
        is_equal = off[c] <= EXACT * abs(y[c] - row[bank.of_coordinate(C, bank.LAST, c)])
        was_still = row[bank.of_coordinate(C, bank.STILL, c)] > 0.0
        exact[c] = EQUAL if is_equal or (was_still and off[c] < FUZZ * coarse) else RULED if is_ruled else 0.0


@kernel
def is_ruled(C, exact):
    """Say whether a publisher drew a plot on the line from those before it."""
    found = False
    for c in range(C):
        found = found or exact[c] == RULED
    return found


@kernel
def shows_lattice(row, C, c, exact):
    """Say whether a plot is the first to leave a lattice whose step is not known: how far it goes says nothing."""
    was_still = row[bank.of_coordinate(C, bank.STILL, c)] > 0.0 and row[bank.of_coordinate(C, bank.GRAIN, c)] == 0.0
    return was_still and exact[c] == 0.0


@kernel
def is_mute(row, C, c, exact):
    """Say whether a plot tells nothing of errors: it repeats a place whose cell nobody knows."""
    return row[bank.of_coordinate(C, bank.GRAIN, c)] == 0.0 and exact[c] == EQUAL


@kernel
def shows_spread(row, C, c, exact):
    """Say whether a plot shows how errors spread: it neither repeats a place whose cell nobody knows nor leaves it."""
    return not (is_mute(row, C, c, exact) or shows_lattice(row, C, c, exact))


@kernel
def repeated(row, C, c, y):
    """Return how many times the variance of a plot is that of one which repeats the place of all so far.

    On a lattice whose step is not known they have one error: all of them say no more than 1.6 (the sum of 1/k^2).
    """
    if row[bank.of_coordinate(C, bank.GRAIN, c)] > 0.0 or y[c] != row[bank.of_coordinate(C, bank.LAST, c)]:
        return 1.0
    return square(1.0 + row[bank.of_coordinate(C, bank.STILL, c)])


@kernel
def cell_variance(task, row, C, c):
    """Return the variance of a place within a cell of its lattice, on which steps repeat: its own, another's, any.

    A step that repeats and is not zero is some number of cells: the cell is hardly larger, and may be as large.
    """
    own = row[bank.of_coordinate(C, bank.GRAIN, c)]
    if own > 0.0:
        return square(own) / 12.0
    step, any_cell = unforeseen.largest_cell(row, C), square(unforeseen.UNSEEN * task.fastest)
    if row[bank.of_coordinate(C, bank.SPEED, c)] != 0.0:
        walked = abs(row[bank.of_coordinate(C, bank.SPEED, c)]) * exp(row[bank.GAP])
        return square(min(step, walked) if step > 0.0 else CELLS * walked) / 12.0
    return square(step) / 12.0 if step > 0.0 else any_cell


@kernel
def outlying(C, parts):
    """Return how likely a plot is an outlier: that a wide scale of the tails has made it."""
    most = 0.0
    for c in range(C):
        total, far = 0.0, 0.0
        for j in range(bank.TAILS):
            total += parts[c * bank.TAILS + j]
            far += parts[c * bank.TAILS + j] if bank.SCALES[j] > 10.0 else 0.0
        most = max(most, far / total if total > 0.0 else 1.0)
    return most


@kernel
def fade_tails(task, row, C, times):
    """Let the tails forget what so many coordinates of a plot have told."""
    fade, first = 1.0 - 1.0 / min(task.tails, YOUNG + row[bank.SEEN]), bank.row_at(C).tails
    for j in range(bank.TAILS):
        for _ in range(times):
            row[first + j] *= fade


@kernel
def learn_tails(task, row, C, exact, parts):
    """Share the plot out among the scales that may have made it, but for that of wild ones."""
    first, teach = bank.row_at(C).tails, 0
    for c in range(C):
        teach += 1 if shows_spread(row, C, c, exact) else 0
    fade_tails(task, row, C, teach)
    for c in range(C):
        if not shows_spread(row, C, c, exact):
            continue
        if exact[c] == EQUAL:  # as on a lattice, whose errors are as large as its cells
            row[first + EVEN] += 1.0
            continue
        p = 0.0
        for j in range(bank.WILD):
            p += parts[c * bank.TAILS + j]
        for j in range(bank.WILD):
            if p > 0.0:
                row[first + j] += parts[c * bank.TAILS + j] / p
            else:  # no scale makes it: the widest does
                row[first + j] += 1.0 if j == bank.WILD - 1 else 0.0
    for j in range(bank.TAILS):
        row[first + j] = max(row[first + j], LEAST_WILD if j == bank.WILD else LEAST_COUNT * PRIOR[j])


@kernel
def was_calm(row, C, y):
    """Say whether a plot may show that noise scales are too large: the one before was near its forecast.

    It takes both coordinates, and a place that is not the last one again.
    """
    if C < 2 or not FRESH < row[bank.SEEN] < TRIED:
        return False
    for c in range(C):
        if not row[bank.of_coordinate(C, bank.SURPRISE, c)] < CALM_BEFORE:
            return False
        if y[c] == row[bank.of_coordinate(C, bank.LAST, c)]:
            return False
    return True


@kernel
def is_calm(C, i, y, mean, S):
    """Say whether a plot is much nearer to what member i expects than its noise would have it."""
    for c in range(C):
        if not square(y[c] - mean[i, c]) < CALM * S[i, c]:
            return False
    return True


@kernel
def follow(row, C, i, y, mean, S, calm, share, least, scale, c):
    """Return what the noise scale of member i, coordinate c, becomes, at least ``least``; no ``share``, as it was."""
    if share[c] == 0.0 or not math.isfinite(mean[i, c]):
        return scale
    if calm and scale > TAUGHT and is_calm(C, i, y, mean, S):
        return max(EASED * scale, least[c])
    return grown(row, C, square(y[c] - mean[i, c]) / S[i, c], share, least, scale, c)


@kernel
def follow_legs(row, C, z2, calm, share, least, scale, c):
    """Return the same of the member that goes by legs: ``z2`` (C,) are squared deviations by what legs seem since."""
    if share[c] == 0.0:
        return scale
    if calm and scale > TAUGHT and z2[0] < CALM and z2[1] < CALM:
        return max(EASED * scale, least[c])
    return grown(row, C, z2[c], share, least, scale, c)


@kernel
def grown(row, C, z2, share, least, scale, c):
    """Return a noise scale after an error of so many squared deviations."""
    last = row[bank.of_coordinate(C, bank.SURPRISE, c)]
    scale *= 1.0 + (min(z2, max(MOST, last)) - 1.0) * (AT_ONCE if min(z2, last) > LOUD else share[c])
    return max(scale, least[c])


@kernel
def prepare_to_follow(task, row, C, T, unit, exact, share, least):
    """Fill how much a plot counts for the noise scales of a coordinate, and the least that these can be."""
    for c in range(C):
        least[c] = least_variance(task, row, T, c) / unit[c]
        share[c] = max(1.0 / task.noise, 1.0 / (row[bank.SEEN] + 3.0))
        if row[bank.SEEN] < 2.0 or exact[c] == RULED or is_mute(row, C, c, exact):  # nothing is learnt
            share[c] = 0.0


@kernel
def learn_noise(row, C, d, y, g, unit, exact):
    """Let the second differences of the first plots say what the variance of a plot is."""
    if row[bank.SEEN] < 2.0 or row[bank.SEEN] > LEARNT_BY:
        return
    for c in range(C):
        v, last = row[bank.of_coordinate(C, bank.SPEED, c)], row[bank.of_coordinate(C, bank.LAST, c)]
        ahead = d / exp(row[bank.GAP])
        if exact[c] > 0.0:
            continue
        e = y[c] - last - d * v
        z = e * e / (1.0 + square(1.0 + ahead) + ahead * ahead) / g[c]
        level, at = log(max(z, 1e-8 * unit[c])) + LOG_MEAN, bank.of_coordinate(C, bank.LOG, c)
        row[at] += (level - row[at]) / (row[bank.SEEN] - 1.0 + row[bank.TRUST])


@kernel
def note(row, C, d, y, told, off, exact):
    """Keep what the next step needs of the plot."""
    for c in range(C):
        still, grain = bank.of_coordinate(C, bank.STILL, c), bank.of_coordinate(C, bank.GRAIN, c)
        if exact[c] == EQUAL:
            row[still] += 1.0
        elif exact[c] == 0.0 and row[still] > 0.0:
            row[grain] = min(row[grain], off[c]) if row[grain] > 0.0 else off[c]
            row[still] = 0.0
    for c in range(C):
        row[bank.of_coordinate(C, bank.SURPRISE, c)] = square(y[c] - told[c]) / told[C + c]
        row[bank.of_coordinate(C, bank.SPEED, c)] = (y[c] - row[bank.of_coordinate(C, bank.LAST, c)]) / d
        row[bank.of_coordinate(C, bank.LAST, c)] = y[c]
    row[bank.TIME] += d
    row[bank.GAP] = log(d)
    row[bank.SEEN] += 1.0
    row[bank.row_at(C).known] = min(row[bank.row_at(C).known] + 1.0, row[bank.SEEN])


@kernel
def follow_pace(row, d):
    """Let the shortest time between plots follow; where plots come faster than any, all is learnt as if from ANEW on.

    What an object did in a long interval and no member could follow stands in the noise, which no shorter one has.
    """
    now = max(log(d), row[bank.GAP])  # of two in a row the longer
    if row[bank.SEEN] > KNOWN and now + log(FASTER) < row[bank.PACE]:
        row[bank.SEEN] = ANEW
    row[bank.PACE] = min(row[bank.PACE] + max(now - row[bank.PACE], 0.0) / PACES, now)


@kernel
def follow_period(row, C, d):
    """Let the typical time between plots follow; states that are measured in it are rescaled."""
    follow_pace(row, d)
    before = row[bank.PERIOD]
    row[bank.PERIOD] += (log(d) - before) / min(row[bank.SEEN], PERIODS)
    if row[bank.SEEN] >= 2.0:
        factor = exp(row[bank.PERIOD] - before)
        for i in range(bank.POLES):
            pole.rescale(row, C, i, factor)
