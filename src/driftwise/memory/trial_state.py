"""What a trial of `AutoMemory` keeps: copies of a filter, the evidence for each, what is shown of them."""

from ..engine.dispatch import kernel
from ..engine.layout import Field, Layout, each, numbers
from .modes import size_of

SAME, FREED, LEVEL = range(3)  # the copies
COPIES = 3
AGE, GAP, LEADER, BEFORE, ALONE, WHICH, BESIDE, ODDS = range(8)  # of the head
IMPOSSIBLE = -1e300

TRIAL = Layout(
    *numbers(
        "head",
        age="samples since it began; 0: none runs",
        gap="samples among which what it is about may have happened",
        leader="which filter of the bank the copies are of",
        before="sigma^2 of it then",
        alone="log evidence of a jump of one parameter, over that of none",
        which="the likeliest one",
        beside="log evidence of the bank itself",
        odds="log odds of a jump, over those at which it is told",
    ),
    *each(
        "3",
        found="log evidence of each copy; the first is none, or one parameter that jumped",
        shown="its probability",
        moved="its share in the mean that is shown",
    ),
    Field("weights", ("M",), "of the filters of the bank when it began"),
    Field("copies", ("3 * size_of(N)",), "as it was, parameters set free, sigma^2 unknown"),
    Field("dense", ("3 * half",), "their P, packed, between a sample and the time update"),
    Field("F", ("N * N",), "what the first has wrong now by what it had wrong when it began, column by column"),
    *each("N", score="F' psi e/T, summed", known="(F' psi)^2/T, summed"),
    given=("N", "M"),
    size_of=size_of,
    half="N * (N + 1) // 2",
)
open_trial, trial_size = kernel(TRIAL.open), kernel(TRIAL.size)


@kernel
def is_told(trial):
    """Say whether the jump is told: then the bank is what jumped, and the copies may still take it back."""
    return trial.found[FREED] <= IMPOSSIBLE


@kernel
def show_none(trial):
    """Let what is shown be the bank alone."""
    trial.head[ODDS] = 0.0
    for k in range(COPIES):
        trial.shown[k] = trial.moved[k] = 0.0
