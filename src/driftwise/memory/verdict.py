"""What a trial comes to: the probability of each explanation, what is shown of it, and what is decided."""

from ..engine.dense import at
from ..engine.dispatch import kernel, rare
from ..engine.elementary import exp, log
from .auto_constants import (
    BY_DRIFT,
    BY_DRIFT_YOUNG,
    CHANCES,
    FAINT,
    JUMP_AGE,
    JUMP_ODDS,
    LEARNT,
    LEVEL_AGE,
    LEVEL_BY_DRIFT,
    LEVEL_ODDS,
    LEVEL_OVER_JUMP,
    RATE,
    SHY,
    SHY_OF_OUTLIERS,
    SHY_OF_STATE,
    STILL_LOUD,
    STRUCK,
    UNSEEN,
    WELL_KNOWN,
    WIDE,
    WIDEST,
)
from .likelihood_drift import begin_again, derivatives
from .lone_jump import move_alone, spread_alone
from .modes import WEIGHT, hand_over, mode, own_sigma2
from .trial_state import (
    AGE,
    ALONE,
    BEFORE,
    BESIDE,
    COPIES,
    FREED,
    GAP,
    IMPOSSIBLE,
    LEVEL,
    ODDS,
    SAME,
    WHICH,
    is_told,
)

NOTHING, A_JUMP, A_LEVEL, NO_JUMP = range(4)


@kernel
def judge(memory, trial, outliers, known, seen, unit):
    """Set the probabilities of the copies, faint ones to zero; return what is decided, NOTHING while it goes on.

    ``outliers`` is their share, ``known`` what it was when the trial began: what it is about may be none.
    """
    head, found, shown, moved = trial.head, trial.found, trial.shown, trial.moved
    prior = log(RATE * head[GAP])
    if is_told(trial):
        return reconsider(trial, prior)
    jump = prior if memory.jumps > 0.0 else IMPOSSIBLE
    shown[SAME] = found[SAME] + head[ALONE] + jump - head[BESIDE]
    shown[FREED] = found[FREED] + jump - head[BESIDE]
    shown[LEVEL] = found[LEVEL] + prior - head[BESIDE]
    best, level = max(shown[SAME], shown[FREED]), shown[LEVEL]
    none = max(found[SAME] - head[BESIDE], level)
    shy = min(SHY_OF_STATE if memory.has_state > 0.0 else SHY, SHY_OF_OUTLIERS / max(outliers, SHY_OF_OUTLIERS))
    if known > STRUCK / CHANCES:
        shy *= WIDE / max(how_far(memory, trial, unit), WIDE)
    head[ODDS] = max((best - none) / (JUMP_ODDS + log(SHY / min(shy, SHY))), 0.0) if memory.jumps > 0.0 else 0.0
    weigh_up(shown, moved, shy * by_knowledge(memory, trial, unit))
    by_drift = BY_DRIFT if seen > LEARNT else BY_DRIFT_YOUNG
    if head[ODDS] > 1.0 and head[AGE] >= JUMP_AGE and best > by_drift:
        return A_JUMP
    if (
        level > max(found[SAME] - head[BESIDE] + LEVEL_ODDS, best + LEVEL_OVER_JUMP)
        and head[AGE] >= LEVEL_AGE
        and level > max(by_drift, LEVEL_BY_DRIFT)
    ):
        return A_LEVEL
    return NOTHING


@kernel
def how_far(memory, trial, unit):
    """Return how far parameters went that were set free: mean square, in deviations, WIDEST at most."""
    same, freed, far = mode(trial.copies, SAME, unit.size), mode(trial.copies, FREED, unit.size), 0.0
    for i in range(unit.size):
        far += (freed.theta[i] - same.theta[i]) * (freed.theta[i] - same.theta[i]) / unit[i]
    return min(WIDEST, far / (unit.size * own_sigma2(memory, same.own)))


@kernel
def by_knowledge(memory, trial, unit):
    """Return how much less a jump counts in the mean, the better the parameters are known."""
    N, known = unit.size, 0.0
    if memory.stakes == 0.0:
        return 1.0
    for i in range(N):
        known += trial.dense[SAME * (N * (N + 1) // 2) + at(i, i)] / unit[i]
    return min(1.0, known / (N * WELL_KNOWN))


@kernel
def reconsider(trial, prior):
    """Set the probabilities of what stood against a jump that is told; return what it is after all, if it is none."""
    head, found, shown = trial.head, trial.found, trial.shown
    shown[SAME], shown[FREED] = found[SAME] - head[BESIDE], IMPOSSIBLE
    shown[LEVEL] = found[LEVEL] + prior - head[BESIDE]
    same, level, head[ODDS] = shown[SAME], shown[LEVEL], 0.0
    weigh_up(shown, trial.moved, 1.0)
    if level > max(same + LEVEL_ODDS, JUMP_ODDS):
        return A_LEVEL
    return NO_JUMP if same > max(level, JUMP_ODDS) else NOTHING


@rare
def stand_against(trial, odds):
    """Let a trial go on beside a jump of these log odds against the bank that another has told."""
    head = trial.head
    head[BESIDE] += odds
    trial.found[FREED] = IMPOSSIBLE
    for k in range(COPIES):
        trial.shown[k] = trial.moved[k] = 0.0
    head[AGE] = 1.0


@kernel
def level_on_trial(trial):
    """Return the log odds of another level of the noise against the bank, IMPOSSIBLE where none is tried."""
    head = trial.head
    return trial.found[LEVEL] + log(RATE * head[GAP]) - head[BESIDE] if head[AGE] > 0.0 else IMPOSSIBLE


@kernel
def jump_on_trial(trial):
    """Return the log odds of a jump against none, IMPOSSIBLE where none is tried, or it is told."""
    head, found = trial.head, trial.found
    if head[AGE] == 0.0 or is_told(trial):
        return IMPOSSIBLE
    return max(found[FREED], found[SAME] + head[ALONE]) + log(RATE * head[GAP]) - found[SAME]


@kernel
def weigh_up(shown, moved, shy):
    """Turn log odds of the copies against the bank into probabilities, and into shares in the mean that is shown."""
    top = max(max(shown[SAME], shown[FREED]), shown[LEVEL])
    if top < UNSEEN:
        for k in range(COPIES):
            shown[k] = moved[k] = 0.0
        return
    top = max(top, 0.0)
    total = exp(-top)
    all_moved = total
    for k in range(COPIES):
        shown[k] = exp(shown[k] - top)
        moved[k] = shown[k] if k == LEVEL else shy * shown[k]
        total += shown[k]
        all_moved += moved[k]
    for k in range(COPIES):
        is_faint = shown[k] <= FAINT * total
        shown[k], moved[k] = (0.0, 0.0) if is_faint else (shown[k] / total, moved[k] / all_moved)


@rare
def say_how_far(trial, unit, out):
    """Write what each parameter jumped by, if it did."""
    same, freed = mode(trial.copies, SAME, unit.size), mode(trial.copies, FREED, unit.size)
    is_alone, one = trial.found[SAME] + trial.head[ALONE] > trial.found[FREED], int(trial.head[WHICH])
    for i in range(unit.size):
        out[i] = 0.0 if is_alone else freed.theta[i] - same.theta[i]
    if is_alone:
        out[one] = spread_alone(trial, unit, one) * trial.score[one]


@rare
def follow(memory, trial, learner, bank, dense, unit, what):
    """Let the bank be what has won; return how long ago that began, -1 where the noise is quieter."""
    N, k, level = unit.size, LEVEL, own_sigma2(memory, mode(trial.copies, LEVEL, unit.size).own)
    since = -1.0 if what == A_LEVEL and level < trial.head[BEFORE] else trial.head[AGE]
    if what == A_JUMP:
        k = FREED
        if trial.found[SAME] + trial.head[ALONE] > trial.found[FREED]:
            k = SAME
            move_alone(trial, unit, 1.0)
    elif what == NO_JUMP:
        k = SAME
    if what != A_LEVEL:
        for j in range(N):
            begin_again(learner, j)
    else:  # P and Q stay what they are; relative to sigma^2 they change
        change = trial.head[BEFORE] / level
        for j in range(N):
            _, dP = derivatives(learner, j)
            for i in range(dP.size):
                dP[i] *= change
    half = N * (N + 1) // 2
    P = trial.dense[k * half : (k + 1) * half]
    hand_over(bank, dense, mode(trial.copies, k, N), P)
    for m in range(memory.levels.size):
        mode(bank, m, N).own[WEIGHT] = trial.weights[m]
    if what == A_JUMP:  # what stood against it may still be right
        if k == SAME:
            move_alone(trial, unit, -1.0)
        best = max(trial.found[FREED], trial.found[SAME] + trial.head[ALONE]) + log(RATE * trial.head[GAP])
        stand_against(trial, best - trial.head[BESIDE])
    else:
        trial.head[AGE] = 0.0
    return since


@rare
def quieter(memory, trial, learner, quiet):
    """Return sigma^2 before the noise became louder, 0 where it is not; learnt ratios are to the quiet noise."""
    level = own_sigma2(memory, mode(trial.copies, LEVEL, memory.cap.size).own)
    before = quiet if quiet > 0.0 else trial.head[BEFORE]
    if level > STILL_LOUD * before:
        return before
    for j in range(learner.eta.size):
        eta = memory.start + learner.eta[j] + log(before / level)
        learner.eta[j] = min(max(eta, memory.least), memory.most) - memory.start
    return 0.0
