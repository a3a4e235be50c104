"""What `AutoMemory` answers: its filters see a sample, pass time, and tell what happened."""

import math

from ..detect.watch import SINCE, STATISTIC, WHICH
from ..engine.dense import at, dot
from ..engine.dispatch import bulky, kernel, rare
from ..engine.elementary import log
from ..engine.status import AT_REST, CAPPED, NOISE, OUTLIER
from ..engine.ud import predicted_variance
from .additive import as_expected, pass_kinds, share_additive, weigh_kinds
from .at_rest import get_used, is_awake, noise_left
from .auto_constants import (
    CHANCES,
    EVEN,
    FREQUENT,
    ISOLATED,
    JUMP_ODDS,
    LEARNT,
    LOUD_ENERGY,
    SETTLED,
    SHY,
    SHY_OF_OUTLIERS,
    SMALLEST,
    STRUCK,
    SURPRISE,
    SUSPECT,
    SUSPECT_FREQUENT,
    TRUSTED,
    YOUNG,
    YOUNG_ENOUGH,
)
from .auto_shown import blend, drift_together, know_as_the_bank, merge_shy, mixture_with_copies
from .auto_state import (
    CLEAN,
    HEAD,
    IS_ISOLATED,
    MODES,
    QUIET,
    RHO,
    SINCE_GAP,
    SINCE_NOW,
    STRUCK_BEFORE,
    STRUCK_SO_FAR,
    VERDICT,
    count_outlier,
    open_parts,
    share_of_outliers,
)
from .bank import FREEDOM_NOW, SIGMA2_NOW, WAITS, count_mixture
from .first_samples import forget_a_little, is_unsettled
from .less_noise import begin_if_loud, begin_if_quiet, go_on_beside, hear
from .likelihood_drift import carry, climb, follow, ratio
from .mixing import drift_apart, drift_beside_state, interact, merge, take_dense_along, take_modes_along
from .modes import WEIGHT, begin_modes, fold, mode, unfold
from .modes import update as update_bank
from .moments import ODDS as MOMENT_ODDS
from .moments import OVER_DRIFT as MOMENT_OVER_DRIFT
from .moments import SINCE as MOMENT_SINCE
from .moments import add_up, expected, follow_moment, forget_moments, look_back
from .noise_level import follow_level, stay_as_fast
from .questions import BELIEVED, DOUBTED, LIKELY
from .resolution import follow_resolution, least_variance
from .retrospect import FOUND, forget_rows, is_known, look_back_late, wait_on
from .retrospect import ODDS as LATE_ODDS
from .retrospect import SINCE as LATE_SINCE
from .robust_start import remember
from .second_start import AGE as SECOND_AGE
from .second_start import concede, is_explained, let_start, start_again
from .set_free import MILDLY, compete, make_room, sets_in
from .suspicion import calm, suspect
from .trial import argue, begin_anew, begin_trial, end_trial, is_to_begin, is_to_end, limit_of, time_update_copies
from .trial_state import AGE, ODDS, is_told, show_none
from .unknown_drift import SEEN, UNEXCITED, excite_by_noise, lean, open_drift_state, rest
from .verdict import A_JUMP, A_LEVEL, NO_JUMP, NOTHING, judge, level_on_trial, quieter, say_how_far, stand_against
from .verdict import follow as follow_verdict


@kernel
def begin_auto(memory, state, view):
    """Let every filter begin as the estimator does."""
    parts = open_parts(memory, state, view.D.size)
    begin_modes(memory, parts.own.bank, view.theta, view.U, view.D)
    for i in range(view.D.size):
        parts.learner.eta[i] = memory.home


@bulky
def try_out(memory, parts, e, R, evidence, rho, outliers, view, least):
    """Let the trial see the sample, and follow what it decides; return the probability of an outlier to all."""
    trial, head, own, unit, N = parts.trial, parts.head, parts.own, parts.drift.unit, view.theta.size
    is_right = memory.has_state == 0.0 and head[CLEAN] <= N and head[SINCE_GAP] >= N
    same, freed, level = argue(memory, parts, e, R, is_right, view.theta, evidence, outliers, view, unit, least)
    known = share_of_outliers(memory, head, head[STRUCK_BEFORE])
    head[VERDICT] = judge(memory, trial, outliers, known, parts.drift.head[SEEN], unit)
    is_shy = memory.has_state > 0.0 and outliers > SHY_OF_OUTLIERS / SHY  # then the state is no bolder than the mean
    part = trial.moved if is_shy else trial.shown
    rho = (1.0 - part[0] - part[1] - part[2]) * rho + part[0] * same + part[1] * freed + part[2] * level
    if head[VERDICT] != NOTHING:
        concede(trial, parts.second)
        if view.fresh.size > 0 and head[VERDICT] == A_JUMP:
            say_how_far(trial, unit, view.fresh)
        head[SINCE_NOW] = follow_verdict(memory, trial, parts.learner, own.bank, own.dense, unit, head[VERDICT])
        if head[VERDICT] != NO_JUMP:
            head[STRUCK_SO_FAR] = head[STRUCK_BEFORE]
        if head[VERDICT] == A_LEVEL:
            head[QUIET] = quieter(memory, trial, parts.learner, head[QUIET])
        calm(parts.sums)
    elif is_to_end(trial):
        end_trial(trial)
        if not compete(memory, parts) or sets_in(parts).began[0] != MILDLY:
            calm(parts.sums)
    return rho


@kernel
def left_to_drift(trial, verdict):
    """Return how much of a sample speeds are learnt from: what may be a jump or louder noise says nothing of drift."""
    return 0.0 if verdict != NOTHING else 1.0 - trial.shown[0] - trial.shown[1] - trial.shown[2]


@rare
def tell_moment(memory, parts, view):
    """Tell a jump of one parameter at some moment of the last samples; the bank is what jumped."""
    trial, head, own, moments, unit = parts.trial, parts.head, parts.own, parts.moments, parts.drift.unit
    follow_moment(memory, moments, parts.learner, own.bank, own.dense, unit, view.c)
    head[VERDICT], head[SINCE_NOW] = A_JUMP, moments.head[MOMENT_SINCE]
    if trial.head[AGE] > 0.0:
        stand_against(trial, moments.head[MOMENT_OVER_DRIFT])
    trial.head[ODDS] = moments.head[MOMENT_ODDS]
    calm(parts.sums)
    forget_moments(moments)


@kernel
def adapt_auto(memory, state, e, R, view):
    """Let bank, learner and trial see a sample; theta and P become those of what is shown; return T."""
    theta, U, D, s2, parts = view.theta, view.U, view.D, view.s2, open_parts(memory, state, view.D.size)
    own, trial, drift, learner, head = parts.own, parts.trial, parts.drift, parts.learner, parts.head
    N, M, T = D.size, MODES, predicted_variance(view.f, D, R)
    is_first = drift.head[SEEN] == 0.0
    are_known = view.has_past > 0.0 or R <= memory.R  # beside a state with a past of its own R always is more
    square, is_alone = e * e / T, memory.past > 0.0 and memory.past == memory.moving  # no input, but noise
    left = noise_left(parts.loudness, drift.head, max(square, SMALLEST * s2)) if is_alone else 1.0
    is_unexcited = excite_by_noise(memory, drift, as_expected(memory, parts.past, view.row, view.c), are_known, left)
    if is_alone:
        get_used(parts.loudness, drift.head, square)
    if is_unexcited and is_awake(memory, drift, trial, e * e > SURPRISE * s2 * T):
        is_unexcited = False
    if follow_resolution(parts.resolution, view.y, is_first) and not is_unexcited:
        is_unexcited = rest(drift)
    least = least_variance(parts.resolution) / memory.R
    if head[QUIET] > 0.0:
        stay_as_fast(head, drift.unit, s2)
    lean(drift, R, T)
    if own.head[WAITS] > 0.0:  # one more output of the same sample
        fold(own.bank, own.dense, N)
        if trial.head[AGE] > 0.0:
            fold(trial.copies, trial.dense, N)
            if compete(memory, parts):
                fold(sets_in(parts).copies, sets_in(parts).dense, N)
    outliers, is_on = share_of_outliers(memory, head, head[STRUCK_SO_FAR]), False
    is_late = drift.head[SEEN] >= YOUNG_ENOUGH and not is_unexcited and memory.outliers * memory.learns > 0.0
    if is_late and drift.head[SEEN] == YOUNG_ENOUGH:
        parts.second.head[SECOND_AGE] = 0.0
    if memory.has_state > 0.0 and drift.head[SEEN] >= YOUNG_ENOUGH and parts.rows.taken[0] > 0.0:
        make_room(parts)
    if not is_unexcited and drift.head[SEEN] > 4.0 * N:
        surprise, is_on, limit = e * e / (s2 * T), trial.head[AGE] > 0.0, limit_of(memory, drift, view)
        if R <= TRUSTED * memory.R:
            hear(parts.most, e, T, s2)
        if is_late and outliers > STRUCK / CHANCES:
            begin_if_quiet(memory, parts.second, parts.most, own.bank, M, s2)
        is_suspicious = suspect(parts.sums, view.psi, e, T, s2) or drift.head[SEEN] < YOUNG
        if is_to_begin(trial, parts, surprise, limit, is_suspicious, head[CLEAN] >= ISOLATED):
            begin_trial(memory, trial, parts.spare, own.bank, drift.unit, M, surprise, limit, is_suspicious, view.b)
            if memory.stakes == 0.0 and drift.head[SEEN] > LEARNT:
                know_as_the_bank(memory, parts)
            head[STRUCK_BEFORE] = head[STRUCK_SO_FAR]
            is_on = True
        elif is_on and compete(memory, parts) and surprise >= limit and not is_told(trial):
            begin_anew(memory, trial, parts.spare, drift.unit, surprise, view.b)
        if is_late and parts.sums.energy[0] > LOUD_ENERGY:
            begin_if_loud(memory, parts.second, trial, own.bank)
    is_early = drift.head[SEEN] < YOUNG_ENOUGH and not is_unexcited
    said = e + dot(view.psi, theta)
    if memory.keeps_rows > 0.0 and is_early and R <= TRUSTED * memory.R:
        remember(parts.rows, view.psi, said)
    looks_back = memory.stakes * memory.jumps > 0.0 and drift.head[SEEN] > LEARNT and not is_unexcited
    looks_late = looks_back and drift.head[SEEN] > SETTLED
    slow, slow_e, slow_T, slow_s2, slow_weight = mode(own.bank, 0, N).own, 0.0, 1.0, 1.0, 1.0
    if looks_back:
        slow_e, slow_T, slow_s2 = expected(memory, own.bank, e, R, theta, view)
        slow_weight = slow[WEIGHT]
    if memory.past > 0.0:
        weigh_kinds(memory, parts.past, view.psi, theta, e, s2 * (T - R + memory.R), said)
    evidence, rho = update_bank(memory, own, e, R, theta, view, outliers, is_unexcited, is_unexcited, least)
    own.head[WAITS] = 0.0 if is_unexcited else 1.0
    if is_unexcited:
        unfold(own.bank, own.dense, N)
    error, spread, own_s2, part = own.logs[M], own.logs[M + 1], own.logs[M + 2], own.logs[M + 3]
    follow(learner, view.psi, view.b, error, spread, own_s2, part, view.c)
    climbs = drift.head[SEEN] > 2.0 * N and not is_unexcited
    if climbs and memory.has_state == 0.0:
        climb(memory, learner, error / math.sqrt(own_s2 * spread), part)
    head[VERDICT] = NOTHING
    if is_early and drift.head[SEEN] > 2.0 * N:
        has_won = start_again(memory, parts.second, parts.rows, e, R, evidence, drift.unit, theta, own.P, view, least)
        if has_won and not is_explained(trial, parts.second):
            let_start(memory, parts.second, own.bank, own.dense, learner, own.P)
            end_trial(trial)
            is_on = climbs = False
    elif is_late and parts.second.head[SECOND_AGE] > 0.0:
        has_won = go_on_beside(memory, parts.second, e, R, evidence, outliers, theta, own.P, view, least)
        if has_won and not is_explained(trial, parts.second):
            follow_level(memory, parts, s2)
            is_on = climbs = looks_late = looks_back = False
    if is_on:
        rho = try_out(memory, parts, e, R, evidence, rho, outliers, view, least)
    elif trial.head[AGE] > 0.0:  # at rest nothing is decided, and what was probable stays so
        rho *= 1.0 - trial.shown[0] - trial.shown[1] - trial.shown[2]
        unfold(trial.copies, trial.dense, N)
        if compete(memory, parts):
            unfold(sets_in(parts).copies, sets_in(parts).dense, N)
    else:
        show_none(trial)
    if climbs and memory.has_state > 0.0:
        climb(memory, learner, error / math.sqrt(own_s2 * spread), part * left_to_drift(trial, head[VERDICT]))
    if head[VERDICT] != NOTHING:
        forget_moments(parts.moments)
    elif looks_back:
        over_bank, share = log(slow[WEIGHT] / slow_weight), 1.0 - own.logs[M + 4]
        add_up(parts.moments, view.psi, slow_e, slow_T, slow_s2, share, over_bank)
        if look_back(memory, parts.moments, own.bank, drift.unit, drift.q, level_on_trial(trial)):
            tell_moment(memory, parts, view)
    head[RHO], head[IS_ISOLATED] = rho, 1.0 if head[CLEAN] >= ISOLATED else 0.0
    head[CLEAN] = 0.0 if rho > 0.5 else head[CLEAN] + 1.0
    head[SINCE_GAP] += 1.0
    if not is_unexcited and head[VERDICT] == NOTHING:
        count_outlier(head, rho)
    if memory.stakes > 0.0:
        own.head[FREEDOM_NOW], own.head[SIGMA2_NOW] = merge_shy(memory, own, learner, theta, U, D)
    else:
        own.head[FREEDOM_NOW], own.head[SIGMA2_NOW] = merge(memory, own, theta, U, D)
    if view.fresh.size > 0:
        view.fresh[N] = BELIEVED if head[VERDICT] == A_JUMP else DOUBTED if trial.head[AGE] > 0.0 else 0.0
    if head[VERDICT] == NOTHING and trial.shown[0] + trial.shown[1] + trial.shown[2] > 0.0:
        blend(memory, parts, view)
    if head[VERDICT] == A_JUMP or (head[VERDICT] != NOTHING and is_told(trial)) or not (looks_late or is_unexcited):
        forget_rows(parts.late)
    elif looks_late:
        look_back_late(memory, parts, view.psi, said, memory.R / R if R > memory.R else 1.0, 1.0 - own.logs[M + 4])
    return T


@kernel
def count_auto(memory, state, count, chi2, weight, gain):
    """Freedom and sigma^2 are those of what is shown."""
    drift = open_drift_state(state, memory.cap.size)
    return count_mixture(memory, drift, drift.own[HEAD:], count, chi2, gain)


@kernel
def outlier_probability_auto(memory, state):
    """What is said of several in a row is not certain, nor of one where they are rare: they may be something else."""
    head = open_drift_state(state, memory.cap.size).own
    if head[VERDICT] != NOTHING:
        return 0.0
    rho, is_frequent = head[RHO], share_of_outliers(memory, head, head[STRUCK_SO_FAR]) > FREQUENT
    if head[IS_ISOLATED] == 0.0:
        rho = min(rho, SUSPECT_FREQUENT if is_frequent else SUSPECT)
    return min(rho, EVEN) if rho <= SUSPECT and not is_frequent and memory.has_state == 0.0 else rho


@kernel
def additive_share_auto(memory, state):
    """Where past outputs are regressors, what follows an outlier tells."""
    return share_additive(open_parts(memory, state, memory.cap.size).past) if memory.past > 0.0 else 1.0


@kernel
def doubted_output_auto(memory, state):
    """Return the last output, as measured and as expected, if it was an outlier of a plant that goes on from some."""
    past = open_parts(memory, state, memory.cap.size).past
    if memory.past > 0.0 and past.rho[0] > 0.0:
        return past.measured[0], past.expected[0]
    return math.nan, math.nan


@kernel
def found_jump_auto(memory, state, detector_state):
    """Tell a jump, and when the trial that found it began; none a second time that was told late."""
    parts = open_parts(memory, state, memory.cap.size)
    late, is_new = parts.late.head, parts.head[VERDICT] == A_JUMP
    detector_state[STATISTIC] = parts.trial.head[ODDS]
    if is_new:
        detector_state[SINCE], detector_state[WHICH] = parts.head[SINCE_NOW], -1.0
        is_new = not is_known(parts.late, parts.head[SINCE_NOW])
    elif late[FOUND] > 0.0:
        detector_state[STATISTIC] = late[LATE_ODDS] / JUMP_ODDS
        detector_state[SINCE], detector_state[WHICH] = late[LATE_SINCE], -1.0
        is_new = True
    return 1.0 if is_new else 0.0


@kernel
def time_update_auto(memory, state, elapsed, view):
    """Take all filters one sample on."""
    N, M, status = view.theta.size - view.first, MODES, 0  # of which a compiler may know more than of settings
    parts = open_parts(memory, state, N)
    own, trial, drift, learner, head, q = parts.own, parts.trial, parts.drift, parts.learner, parts.head, parts.own.q
    is_unexcited, waits = drift.head[UNEXCITED] > 0.0, own.head[WAITS] > 0.0
    for i in range(N):
        for m in range(M - 1):
            q[m * N + i] = memory.levels[m] * drift.unit[i]
        q[(M - 1) * N + i] = drift.q[i] = ratio(memory, learner, i) * drift.unit[i]
    if not waits:
        unfold(own.bank, own.dense, N)
    for i in range(N):
        view.c[i] = own.dense[(M - 1) * own.P.size + at(i, i)]
    carry(learner, memory.phi[:N], drift.q, view.c, memory.cap)
    if is_unsettled(drift, view):
        forget_a_little(parts, view, waits)
    if waits:
        is_capped = interact(memory, own, own.bank, q, N)
    else:
        is_capped = drift_apart(memory, own.bank, q, view.b)
    if trial.head[AGE] > 0.0:
        time_update_copies(memory, trial, parts.spare, compete(memory, parts), q, waits, view.b)
    own.head[WAITS] = 0.0
    wait_on(parts.late)
    if memory.past > 0.0:
        is_one = view.surprise >= 0.0 and head[RHO] > LIKELY and head[VERDICT] == NOTHING
        pass_kinds(memory, parts.past, head[RHO] if is_one else 0.0)
    if view.surprise != view.surprise:
        head[SINCE_GAP] = 0.0
    if view.surprise >= 0.0:
        status |= AT_REST if is_unexcited else 0
        status |= NOISE if head[VERDICT] == A_LEVEL and head[SINCE_NOW] > 0.0 else 0
        status |= OUTLIER if head[RHO] > 0.5 and head[VERDICT] == NOTHING else 0
    status |= CAPPED if is_capped else 0
    if view.first > 0:
        drift_beside_state(memory, own.bank, q, view)
    else:
        drift_together(memory, own, waits, view.theta, view.U, view.D, view)
    return 1.0, status


@kernel
def mixture_auto(memory, state, R, view, out):
    """Write what the filters predict."""
    mixture_with_copies(memory, open_parts(memory, state, view.theta.size), R, view, out)


@kernel
def take_along_auto(memory, state, change, view):
    """Every filter goes along."""
    N, parts = memory.cap.size, open_parts(memory, state, memory.cap.size)
    own, trial, waits = parts.own, parts.trial, parts.own.head[WAITS] > 0.0
    take_modes_along(memory, own.bank, change, view)
    if waits:
        take_dense_along(memory, own.bank, own.dense, change, view)
    if trial.head[AGE] > 0.0:
        if waits:
            fold(trial.copies, trial.dense, N)
        take_modes_along(memory, trial.copies, change, view)
        if waits:
            unfold(trial.copies, trial.dense, N)
        if compete(memory, parts):
            if waits:
                fold(sets_in(parts).copies, sets_in(parts).dense, N)
            take_modes_along(memory, sets_in(parts).copies, change, view)
            if waits:
                unfold(sets_in(parts).copies, sets_in(parts).dense, N)
