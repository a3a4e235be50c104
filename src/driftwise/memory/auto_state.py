"""What `AutoMemory` keeps: the filters that interact, what learns a speed, and a trial beside them."""

from typing import NamedTuple

import numpy as np

from ..engine.dispatch import kernel
from ..engine.layout import Field, Layout, numbers
from .additive import open_past, past_size
from .at_rest import LOUDNESS
from .auto_constants import LEVELS, MOMENTS, STRUCK_FADES
from .bank import bank_size, open_bank
from .less_noise import MOST
from .likelihood_drift import learner_size, open_learner
from .moments import moments_size, open_moments
from .resolution import RESOLUTION
from .retrospect import open_retrospect, retrospect_size
from .robust_start import open_rows, rows_size
from .second_start import open_second, second_size, share_of
from .suspicion import open_suspicion, suspicion_size
from .trial_state import open_trial, trial_size
from .unknown_drift import open_drift_state

RHO, CLEAN, VERDICT, STRUCK_SO_FAR, COUNTED, SINCE_NOW, IS_ISOLATED = range(7)  # its own numbers
QUIET, STRUCK_BEFORE, SINCE_GAP, HEAD = range(7, 11)  # and how many
MODES = len(LEVELS) + 1

AUTO = Layout(
    *numbers(
        "head",
        rho="probability that the sample just taken in was an outlier",
        clean="samples since the last one",
        verdict="what the trial decided",
        struck="outliers so far",
        counted="of so many samples",
        since="how long ago began what was decided; -1: the noise is quieter",
        isolated="whether the samples before the last were no outliers",
        quiet="sigma^2 before the noise became louder; 0: it has not",
        struck_before="outliers until the trial began: what it explains were none",
        since_gap="samples since an output was missing",
    ),
    Field("bank", ("bank_size(N, M)",), "the filters that interact"),
    Field("suspicion", ("suspicion_size(N)",), "whether something may have happened"),
    Field("trial", ("trial_size(N, M)",), "what may have happened a moment ago"),
    Field("second", ("second_size(N)",), "another start"),
    Field("learner", ("learner_size(N, N)",), "what learns the ratio of the last mode"),
    Field("rows", ("rows_size(N)",), "the last rows, some of which another start begins with"),
    Field("past", ("past_size(N)",), "what past outputs were, and how many outliers were of which kind"),
    Field("moments", ("moments_size(N, M, MOMENTS)",), "when one parameter may have jumped"),
    *RESOLUTION,
    *MOST,
    Field("late", ("retrospect_size(N, looks)",), "the last rows, in which something may have jumped"),
    *LOUDNESS,
    given=("N", "M", "looks"),
    bank_size=bank_size,
    suspicion_size=suspicion_size,
    second_size=second_size,
    trial_size=trial_size,
    learner_size=learner_size,
    rows_size=rows_size,
    past_size=past_size,
    moments_size=moments_size,
    retrospect_size=retrospect_size,
    MOMENTS=MOMENTS,
)
open_auto, auto_size = kernel(AUTO.open), kernel(AUTO.size)


class Parts(NamedTuple):
    """Views of everything `AutoMemory` keeps: those of `DRIFT_STATE`, `AUTO`, and its parts."""

    drift: tuple
    own: tuple
    head: np.ndarray
    sums: tuple
    trial: tuple
    second: tuple
    learner: tuple
    rows: tuple
    past: tuple
    moments: tuple
    resolution: np.ndarray
    most: np.ndarray
    late: tuple
    loudness: np.ndarray
    spare: np.ndarray  # where the first rows stood: copies set free, or scratch


@kernel
def open_parts(memory, state, N):
    """Return the views."""
    drift = open_drift_state(state, N)
    looks = 0
    if drift.own.size > auto_size(N, MODES, 0):  # rows are kept in regressions alone
        looks = 1
    parts = open_auto(drift.own, N, MODES, looks)
    bank, trial = open_bank(parts.bank, N, MODES), open_trial(parts.trial, N, MODES)
    sums = open_suspicion(parts.suspicion, N)
    second, learner = open_second(parts.second, N), open_learner(parts.learner, N, N)
    rows, past = open_rows(parts.rows, N), open_past(parts.past, N)
    moments = open_moments(parts.moments, N, MODES, MOMENTS)
    late = open_retrospect(parts.late, N, looks)
    return Parts(
        drift,
        bank,
        parts.head,
        sums,
        trial,
        second,
        learner,
        rows,
        past,
        moments,
        parts.resolution,
        parts.most,
        late,
        parts.loudness,
        parts.rows[1:],
    )


@kernel
def share_of_outliers(memory, head, struck):
    """Return how many samples in one are outliers, as far as that is known, if ``struck`` have been some."""
    return share_of(memory, struck, head[COUNTED])


@kernel
def count_outlier(head, rho):
    """Take into their share a sample that is one with probability rho."""
    head[STRUCK_SO_FAR] = STRUCK_FADES * head[STRUCK_SO_FAR] + rho
    head[COUNTED] = STRUCK_FADES * head[COUNTED] + 1.0
