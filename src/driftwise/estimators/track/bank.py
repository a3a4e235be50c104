"""The bank of a track: which models of motion compete, and where each keeps its numbers.

Every noise is a share of the plots' own: a grid of dimensionless numbers fits a ship's radar and a satellite receiver.
T is the time between plots, r the variance of a plot.
"""

from ...engine.dispatch import kernel
from ...engine.elementary import exp
from ...engine.layout import Field, Layout, each, numbers

# of a velocity forgotten at rate alpha, under white acceleration of intensity q: alpha T, q T^3 / r; constant velocity,
# and wandering: what a turn looks like that is too fast for the radar
STRAIGHT = (
    (0.0, 1e-4),
    (0.0, 1e-3),
    (0.0, 1e-2),
    (0.0, 0.1),
    (0.0, 1.0),
    (0.0, 10.0),
    (0.5, 100.0),
    (10.0, 1e3),
    (10.0, 1e5),
)
# of an acceleration forgotten at rate alpha, under white jerk of intensity j: alpha T, j T^5 / r
CURVED = ((0.0, 1.0), (0.2, 100.0))
# of a coordinated turn: q T^3 / r
TURNS = (0.1,)
# of the legs of one that goes by legs: angle turned between two plots, to the right, each rate twice the one before;
# q T^3 / r; how often one of those that begin is this
RATES = tuple(2.0**k for k in range(-5, 1))
LEG_RATES = (0.0, 0.0, *RATES, *(-rate for rate in RATES))
LEG_NOISES = (1e-3, 0.3, *(1e-3 for _ in RATES), *(1e-3 for _ in RATES))
LEG_SHARES = (0.25, 0.25, *(0.25 / len(RATES) for _ in RATES), *(0.25 / len(RATES) for _ in RATES))
# of the manoeuvre pole, learnt: radius rho of C(q) = (1 - rho q)^2
RADII = (0.2, 0.6, 0.87)

LINES, CURVES, CIRCLES, POLES = len(STRAIGHT), len(CURVED), len(TURNS), len(RADII)
LEGS, TURNING = len(LEG_RATES), len(RATES)
KALMAN = LINES + CURVES
BEHIND = (*(0.0,) * 6, 2.0, 1.0, 0.0)  # log weight by which each that is straight begins behind: the widest does not

# of the head of a row
SEEN, TIME, PERIOD, GAP, MANOEUVRE, ALERT, TRUST, SUSPECTED, DOUBT, LEAD, PACE, REFUSED = range(12)
# of each coordinate
FIRST, LAST, SPEED, LOG, STATED, SURPRISE, SUSPECT, CLAIMED, STILL, GRAIN, WAY, ASIDE, EACH = range(13)
SCALES = (*(4.0**k for k in range(-2, 6)), 4.0**6)  # of the predictive density's tails; the last is that of wild plots
TAILS = len(SCALES)
WILD = TAILS - 1
COUNTED = (*SCALES[:WILD], 9.0)  # .. and what each counts in the variance: how far a wild plot is off says nothing
LINE, CURVE = (
    6,
    10,
)  # per coordinate: position, velocity, their covariance, noise scale; acceleration, covariance with it
CIRCULAR = 5 + 15  # E, vE, N, vN, omega T and their covariance
AHEADS, MOVES = 2, 3  # what a target may do: go on in two ways, or move in three; of a coordinate as those numbers
COURSES = AHEADS + MOVES
LEG = 9  # share; E, vE, N, vN; of a coordinate the variance of p, E[p v*] as real and imaginary part, variance of v
CROSS, SPREADING, MANOEUVRING, ONSET, TURN, TURN_SD, POLE, POLE_SD, STATUS = range(9)  # told of a plot


def names(C) -> tuple[str, ...]:
    """Return what the members are called."""
    names = [f"wandering, {q:g}" if a else f"constant velocity, {q:g}" for a, q in STRAIGHT]
    names += [f"Singer, {j:g}" if a else f"constant acceleration, {j:g}" for a, j in CURVED]
    names += [f"turn, {q:g}" for q in TURNS[: circles(C)]]
    names += ["legs"] * legged(C)
    return (*names, *(f"manoeuvre pole, {rho:g}" for rho in RADII))


@kernel
def circles(C):
    """Return how many members turn: it takes a plane."""
    return CIRCLES if C == 2 else 0


@kernel
def legged(C):
    """Return how many members go by legs: one, in a plane."""
    return 1 if C == 2 else 0


@kernel
def moving(C):
    """Return how many members have a state: all but those with a learnt pole."""
    return KALMAN + circles(C) + legged(C)


@kernel
def goes_by_legs(C, i):
    """Say whether member i is the one that goes by legs."""
    return legged(C) > 0 and i == KALMAN + circles(C)


@kernel
def members(C):
    """Return how many members there are."""
    return moving(C) + POLES


@kernel
def triangle(n):
    """Return the size of the upper triangle of a matrix."""
    return n * (n + 1) // 2


@kernel
def pole_size(C):
    """Return the numbers of a member with a manoeuvre pole: two states a coordinate, the pole, covariance, scales."""
    return 2 * C + 1 + triangle(2 * C + 1) + C


@kernel
def legs_size(C):
    """Return the numbers of all legs: each number of all, one after the other, then a noise scale a coordinate."""
    return (LEG * LEGS + C) * legged(C)


@kernel
def linear_size(C):
    """Return the numbers of all members that are linear."""
    return (LINE * LINES + CURVE * CURVES) * C


@kernel
def courses_size(C):
    """Return the numbers of all that a target may do."""
    return (LINE * AHEADS + CURVE * MOVES) * C


@kernel
def circle_size(C):
    """Return the numbers of a member that turns."""
    return CIRCULAR + C


TRACK = Layout(
    *numbers(
        "head",
        seen="plots seen; fewer once they come faster than before: what is learnt of them begins anew",
        time="of the last",
        period="log of the typical time between plots",
        gap="and of the last",
        manoeuvre="probability of a manoeuvre",
        alert="whether one was told",
        trust="plots that the stated variance is worth",
        suspected="time from the last plot to one that may be wild and waits for the next; 0 where none does",
        doubt="how likely that one is wild",
        lead="how likely plots lead away from straight flight as a manoeuvre does",
        pace="log of the shortest time between plots at which their noise was learnt",
        refused="time from the last plot to one after it that was called wild; 0 where none was",
    ),
    Field(
        "plots",
        ("C", "EACH"),
        "each coordinate: first plot, last less the first, last velocity, log of a plot's variance, what was stated; "
        "e^2/variance of the last; the plot that waits, what was stated of it; equal steps in a row, the lattice's "
        "step that they show (0 is unknown); the way, of length 1, by what the target may do; "
        "the plot that was called wild",
    ),
    Field("tails", ("TAILS",), "plots that each scale of the tails is worth"),
    Field("weights", ("members(C)",), "log weight of each member"),
    Field(
        "linear",
        ("linear_size(C)",),
        "each that is linear, a coordinate after the other: position, velocity, covariance, scale; acceleration",
    ),
    Field("circle", ("circles(C)", "circle_size(C)"), "each that turns: state, covariance, scales"),
    Field("legs", ("legs_size(C)",), "share of each leg, then its mean and covariance, number by number; noise scales"),
    Field("pole", ("POLES", "pole_size(C)"), "each with a manoeuvre pole: state, covariance, scales"),
    Field(
        "courses",
        ("courses_size(C)",),
        "what the target may do: along the way and across it state and covariance, from the last plot on; how likely",
    ),
    Field("known", (), "plots that have shown how large the noise is; where its variance rises, by so much fewer"),
    given=("C",),
    EACH=EACH,
    TAILS=TAILS,
    linear_size=linear_size,
    courses_size=courses_size,
    POLES=POLES,
    members=members,
    circles=circles,
    circle_size=circle_size,
    legs_size=legs_size,
    pole_size=pole_size,
)
TRACK_SAMPLE = Layout(
    *each(
        "C",
        prediction="where the plot was expected",
        innovation="the plot less that",
        base="variance of the mixture, before its tails",
        log_score="log density given to the plot",
        lower="share of the density below the plot",
        upper="and above",
    ),
    Field("state", ("3 * C",), "position, velocity, acceleration of each coordinate"),
    Field("covariance", ("triangle(3 * C)",), "its upper triangle, row by row"),
    *numbers(
        "reported",
        cross="covariance of the two coordinates in the mixture",
        spreading="variance of the density over base",
        manoeuvring="probability of a manoeuvre",
        onset="1 where one is told to have begun",
        turn="turn rate",
        turn_sd="its standard deviation",
        pole="manoeuvre pole",
        pole_sd="its standard deviation",
        status="bits",
    ),
    Field("shares", ("TAILS",), "of the scales of the tails"),
    Field("weights", ("members(C)",), "of the members"),
    Field("unforeseen", (), "share of the density that stands for what no plot has shown"),
    Field("wider", ("C",), "each coordinate: by what its variance is larger than base"),
    given=("C",),
    TAILS=TAILS,
    members=members,
    triangle=triangle,
)
row_at, sample_at = kernel(TRACK.places), kernel(TRACK_SAMPLE.places)
row_size, columns = kernel(TRACK.size), kernel(TRACK_SAMPLE.size)


@kernel
def at_linear(C, i, c):
    """Return where coordinate c of member i of constant velocity, acceleration or Singer starts."""
    if i < LINES:
        return row_at(C).linear + (i * C + c) * LINE
    return row_at(C).linear + LINES * C * LINE + ((i - LINES) * C + c) * CURVE


@kernel
def at_circle(C, i):
    """Return where the i-th member that turns starts."""
    return row_at(C).circle + i * circle_size(C)


@kernel
def at_legs(C):
    """Return where the legs start."""
    return row_at(C).legs


@kernel
def at_pole(C, i):
    """Return where the i-th member with a manoeuvre pole starts."""
    return row_at(C).pole + i * pole_size(C)


@kernel
def of_coordinate(C, what, c):
    """Return where a number of coordinate c stands."""
    return row_at(C).plots + EACH * c + what


@kernel
def column(C, what, c):
    """Return the column of one of the first six names of `TRACK_SAMPLE`."""
    return what * C + c


@kernel
def period(row):
    """Return the typical time between plots."""
    return exp(row[PERIOD])
