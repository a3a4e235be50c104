"""Was an outlier of the sensor alone (additive), or does the plant go on from it (innovational)? What follows tells.

Among the regressors of an `ARX` the first has to be replaced, the second must not be. Either way the sample itself says
the same; the next outputs are predicted from what was expected, y - e, or from what was measured, and as many as there
are lags are evidence of which it was. So a plant soon shows how many of its outliers are of either kind, and the next
one begins with that. If it was the first sample of a jump it was neither: who thinks so regresses on what was measured.
Source: Fox (1972), "Outliers in time series", J. R. Statist. Soc. B 34, 350-363.
"""

from ..engine.dispatch import kernel
from ..engine.elementary import exp
from ..engine.layout import Layout, each, numbers
from .auto_constants import ADDITIVE, CLIP, KINDS

ADDITIVE_SO_FAR, COUNTED, Y, EXPECTED = range(4)  # of the head

PAST = Layout(
    *numbers(
        "head",
        additive="outliers so far that were additive",
        counted="of so many that were outliers",
        y="output just seen",
        was_expected="what it was expected to be",
    ),
    *each(
        "N",
        measured="past outputs, newest first",
        expected="what each was expected to be",
        rho="probability that it was an outlier; 0: more likely none",
        odds="log odds that it was additive, by what followed",
    ),
    given=("N",),
)
open_past, past_size = kernel(PAST.open), kernel(PAST.size)


@kernel
def share_additive(past):
    """Return how many outliers in one are additive, as far as that is known."""
    return (past.head[ADDITIVE_SO_FAR] + ADDITIVE * KINDS) / (past.head[COUNTED] + KINDS)


@kernel
def weigh_kinds(memory, past, psi, theta, e, V, y):
    """Take an innovation e of variance V, regressors known, as evidence of what the outliers among them were."""
    for i in range(int(memory.past)):
        if past.rho[i] > 0.0:
            additive = e + theta[i] * (psi[i] + past.expected[i])
            innovational = e + theta[i] * (psi[i] + past.measured[i])
            past.odds[i] += 0.5 * (clipped(innovational, V) - clipped(additive, V))
    past.head[Y], past.head[EXPECTED] = y, y - e


@kernel
def as_expected(memory, past, row, c):
    """Return the row with what outliers among it were expected to be: it is how large regressors are. ``c`` is scratch.

    Of a wrong number a share stays there, which tells nothing of them, and is too large to be forgotten soon.
    """
    for i in range(row.size):
        c[i] = past.expected[i] if i < int(memory.past) and past.rho[i] > 0.0 else row[i]
    return c


@kernel
def clipped(e, V):
    """Return e^2/V, that of CLIP deviations at most."""
    return min(e * e / V, CLIP * CLIP)


@kernel
def exchange(memory, past, psi, theta, e, age):
    """Let the outliers of the last ``age`` samples stand in psi as measured; return the innovation then.

    What stood there is kept in their place: a second call lets all be as it was.
    """
    for i in range(min(int(memory.past), int(age))):
        if past.rho[i] > 0.0:
            was = psi[i]
            psi[i], past.measured[i] = -past.measured[i], -was
            e += theta[i] * (was - psi[i])
    return e


@kernel
def pass_kinds(memory, past, rho):
    """Let the past be a sample older, whose output was an outlier with probability rho; count the oldest."""
    last = int(memory.past) - 1
    if past.rho[last] > 0.0:
        share = share_additive(past)
        past.head[ADDITIVE_SO_FAR] += past.rho[last] * share / (share + (1.0 - share) * exp(-past.odds[last]))
        past.head[COUNTED] += past.rho[last]
    for i in range(last, 0, -1):
        past.measured[i], past.expected[i] = past.measured[i - 1], past.expected[i - 1]
        past.rho[i], past.odds[i] = past.rho[i - 1], past.odds[i - 1]
    past.measured[0], past.expected[0] = past.head[Y], past.head[EXPECTED]
    past.rho[0], past.odds[0] = rho, 0.0
