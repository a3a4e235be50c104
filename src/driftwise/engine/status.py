"""Status bits: what happened at a sample, one bit each."""

from enum import IntFlag

MISSING_OUTPUT = 1
MISSING_INPUT = 2
REJECTED = 4
EXACT = 8
FLOORED = 16
JUMP = 32
CAPPED = 64
BAD_VALUE = 128
LOST = 256
SKIPPED = 512
PROJECTED = 1024
FILLED = 2048
NOISE = 4096
OUTLIER = 8192
AT_REST = 16384
NOT_READY = 32768
STARTED = 65536
NOT_STARTED = 131072
LATE = 262144
UNDEFINED = 524288
CURVED = 1048576
AT_EDGE = 2097152
STIFF = 4194304


class Status(IntFlag):
    """What happened at a sample; several may be true at once.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    >>> y[5] = float("nan")
    >>> status = dw.ARX(1, 1).scan(y, u).status
    >>> dw.Status(int(status[5]))
    <Status.MISSING_OUTPUT: 1>
    >>> bool(status[5] & dw.Status.MISSING_OUTPUT)
    True
    """

    MISSING_OUTPUT = MISSING_OUTPUT  # y was NaN: exact-moment step
    MISSING_INPUT = MISSING_INPUT  # an input was NaN: predicted from what it has shown so far
    REJECTED = REJECTED  # the gate took y for an outlier: treated as missing
    EXACT = EXACT  # y was known exactly beforehand (T = 0): no update
    FLOORED = FLOORED  # the round-off floor outweighed R
    JUMP = JUMP  # the innovations say that the parameters have jumped: they were freed
    CAPPED = CAPPED  # a parameter's variance was held: at its prior's, or at what one typical sample leaves
    BAD_VALUE = BAD_VALUE  # infinite or absurdly large: taken as missing
    LOST = LOST  # the state left every bound in a gap, or was no number any more: restarted
    SKIPPED = SKIPPED  # a regressor was missing or before the record, or an instrument failed: nothing was learnt
    PROJECTED = PROJECTED  # the new parameters were unstable: they were drawn back
    FILLED = FILLED  # a regressor was missing and predicted, or may be a glitch: its variance counts
    NOISE = NOISE  # the innovations say that the noise has become louder: its variance is learnt anew
    OUTLIER = OUTLIER  # y is more likely an outlier than not: it taught next to nothing
    AT_REST = AT_REST  # nothing moves: neither the speed of drift nor the noise variance is learnt
    NOT_READY = NOT_READY  # too few samples, or a deviation above the tolerance: the estimate is NaN
    STARTED = STARTED  # the samples so far were identified at once, and the estimate is theirs from here on
    NOT_STARTED = NOT_STARTED  # they could not be identified, or not well: the filter keeps its own estimate
    LATE = LATE  # it came later than what comes late is waited for: not taken
    UNDEFINED = UNDEFINED  # a formula of the plant gave no number: nothing was moved, or learnt, by it
    CURVED = CURVED  # the plant bends within the error bars, which are not to be believed
    AT_EDGE = AT_EDGE  # for long a parameter has been where its prior, or its bounds, hardly allow it to be
    STIFF = STIFF  # the plant is too fast for the time between samples to be taken in steps


MEANING = {
    Status.MISSING_OUTPUT: "output missing",
    Status.MISSING_INPUT: "input missing, predicted",
    Status.REJECTED: "outlier ignored",
    Status.EXACT: "output known exactly, nothing to learn",
    Status.FLOORED: "noise variance raised to the round-off floor",
    Status.JUMP: "parameters jumped, freed again",
    Status.CAPPED: "parameter variance held, nothing excites it",
    Status.BAD_VALUE: "absurd value taken as missing",
    Status.LOST: "state lost, restarted from the range of the data",
    Status.SKIPPED: "not all regressors known (or an instrument failed), nothing learnt",
    Status.PROJECTED: "drawn back, the new parameters were unstable",
    Status.FILLED: "a regressor was missing or in doubt",
    Status.NOISE: "noise level rose",
    Status.OUTLIER: "outlier, hardly counted",
    Status.AT_REST: "plant at rest, nothing adapted",
    Status.NOT_READY: "estimate not ready",
    Status.STARTED: "started from the samples so far, identified at once",
    Status.NOT_STARTED: "the samples so far could not be identified, no start from them",
    Status.LATE: "came too late, not taken",
    Status.UNDEFINED: "a formula gave no number, nothing moved by it",
    Status.CURVED: "the plant bends within the error bars, which are too small",
    Status.AT_EDGE: "a parameter at the edge of what its prior allows, for long",
    Status.STIFF: "the plant is too fast for the time between samples",
}
