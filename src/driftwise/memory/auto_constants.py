"""Every constant of `AutoMemory`, with its reason.

NVRs and jumps are in units of the noise: a parameter off by its unit R/ms moves y as much as the noise does.
Those chosen by trial were chosen on the drawn systems of the scoreboard, with the seed that is kept for choosing.
"""

from ..engine.elementary import log

# How fast parameters drift
LEVELS = (0.0, 0.1)  # NVRs beside the learnt one: none, and as fast as can be told from noise (three samples)
SPEEDS = (  # probability a sample that each becomes each: a plant does so once in thousands of samples, and does not
    (0.9997, 5e-5, 2.5e-4),  # run fast for long. What leaks into constants from the fast filter is error, so the learnt
    (3e-4, 0.9994, 3e-4),  # one takes it up: where that is no likelier, bars of slow walks are too narrow
    (2e-4, 5e-5, 0.99975),
)
START, LEAST, MOST = 1e-2, 1e-6, 10.0  # learnt NVR: at first (high: its slope vanishes with it), memory of 1000 .. 0.3
BESIDE_STATE = 0.1  # times START: there the mean counts the learnt filter by its odds, from the first sample on; and
# after louder noise, with less to learn from, speeds go back to where they began
RASH, RASH_SAMPLES, UNSETTLED = 0.03, 100.0, 500.0  # 1 - lambda at first where a state has a past of its own, the
# samples in which it falls to a third, and those after which nothing is forgotten
SHY_OF_FAST, SHY_OF_DRIFT = 0.05, 0.003  # what the fast filter's odds count in the mean; and the deviation a step, in
# units, at which those of the learnt one count half: a constant is known to that after two thousand samples
SAMPLES, TAU, PRIOR = 300.0, 2.0, 4.0  # that count; deviations of log NVR among the parameters, and from the start

# Outliers
STRUCK, CHANCES = 0.2, 20.0  # before data: one sample in a hundred, with the weight of twenty
STRUCK_FADES = 0.998  # per sample, of that count: five hundred samples tell the share of outliers
OFTEN = 0.25  # at most: what is wrong oftener is no sensor's, but the model's
ISOLATED = 2.0  # clean samples before one that is taken for a wrong number alone: several in a row are something else
SUSPECT, SUSPECT_FREQUENT = 0.9, 0.95  # what is said of the others, at most; the second where outliers are frequent
FREQUENT = 0.02  # this share is
EVEN = 0.5  # what is said of a doubted one where they are rarer, at most: a jump looks alike
ADDITIVE, KINDS = 0.8, 2.0  # share of outliers that are additive, and how many are counted, before data

# Jumps and levels of the noise
RATE = 1e-3  # of each, a sample, before data: two in a record of two thousand
FALSE_RATE = 1e-5  # of jumps told that are none, as promised: .02 in such a record
JUMP_ODDS = log(RATE / FALSE_RATE)  # at these odds against none, or a level: sums of ratios keep that (Shiryaev 1963);
# at higher ones where outliers are frequent, by as much as the mean is shyer: three in a row look like a jump
LEVEL_ODDS = log(1000.0)  # of a level against none: loud samples make it suspected, and so begin its trial
LEVEL_OVER_JUMP = log(20.0)  # and against a jump: that something happened is no question then; who is set free follows
# louder noise as well, so many logs behind, and never more
BY_DRIFT = -2.0  # log odds that a jump needs against the interacting bank: it may have begun to drift fast, which is
# so many logs rarer than the bank takes it for; its fast filter follows a small jump as well as who knows of it
LEVEL_BY_DRIFT = 2.0  # and that a level needs: one that beats standing still only is drift
BY_DRIFT_YOUNG, LEARNT = 4.0, 200.0  # and both in the first samples, as long as speeds are guessed
SHY, SHY_OF_OUTLIERS = 1 / 8, 5e-4  # of the odds of a jump in the mean shown; or the second over the share of outliers:
# to move for nothing costs more than to wait for another sample, the more the oftener surprises are wrong numbers; and
# where these are more frequent than they were taken for before data, the farther a jump beyond WIDE would go
SHY_OF_STATE = 1 / 2  # the first beside a state, which errs as soon as parameters do: told jumps stay as sure
WELL_KNOWN = 1 / 200  # variance of the parameters, in units, below which a jump counts the less in proportion: so well
# are constants known after two hundred samples, and the better they are the more a false move costs
UNSEEN = -4.0  # log odds of which FAINT is out of reach
SLIGHT = 2.0  # log evidence below which no single parameter is thought of
FAINT = 0.05  # what is less probable is not shown: bars are there for 95 %
WIDE, WIDEST = 16.0, 4e6  # variance of a jump, in units: four deviations; or if that is larger the surprise itself,
# shared among the parameters: who is allowed more than outliers are would have them all
FAR, RAREST = 256.0, -1.0  # jumps beyond that variance become rarer (Cauchy's tail), by so many logs at most: wrong
# numbers do not, and the next sample decides
LAG_JUMP = 0.3  # variance of a jump of what a past output counts for, at most: stable plants leave it little room. A y
# at rest is its noise, and so many deviations of that would carry the next y, once it has left its level, anywhere
POLE_JUMP = 0.05  # the same beside a state: a deviation of .22 of a1, where the whole circle leaves it two at most
LONE = (
    5.0  # variance of a jump of one parameter, to weigh it: a wider one makes small jumps improbable; large ones tell
)
LOUD, LOUD_FREEDOM = 3.0, 1.0  # at a surprise the new sigma^2 over the old: so many times, hardly known (one sample)
PLAIN_FREEDOM = 2.0  # without one it may be either way: as it was, by two samples
STILL_LOUD = 1.2  # times sigma^2 of before: as long as that, drift is told in units of the noise before it was louder
LITTLE, WIDER_STILL = 4.0, 36.0  # beside a state, where two copies are set free: two deviations, or six
SETS = 4  # copies set free there, at most
KNOWN_FREEDOM = (
    30.0  # samples that they know sigma^2 by, at most: who is free to change it explains louder noise as well
)
FREED_FREEDOM = 4.0  # what is known of sigma^2 after a jump, at most: a level may have changed with it
STEP, MOMENTS = 4, 8  # samples between two moments at which one parameter may have jumped, and how many are kept
WORTH = 8.0  # variances of noise that a jump must explain before the sum over moments is worth its exponentials
MOMENT_BY_DRIFT = 0.0  # log odds that it needs against the bank, and against having walked all the time

# A jump told late, which moves nothing
SETTLED = 250.0  # samples before rows are kept: what stands against a jump is a walk at the speed learnt before
KEPT_ROWS, ANEW, KEPT_FILTERS, LOOK = (
    48,
    16,
    3,
    8,
)  # rows kept; filters are kept anew after so many, so many of them; and rows
# between two looks back, over all rows or all but sixteen
OF_JUMPS, ALL_JUMP = (0.5, 8.0), 0.3  # variances of a jump, in units, half of them each: a trial does not tell every
# large one; and how often all jump
FAST_SAYS = RATE  # probability that they have begun to drift as fast as the fast filter: as little as any is given
LATE = log(6.0)  # log odds at which it is told; at 3:1 records in rest would have .02 false ones, all that is allowed
RECENT = 12  # rows; what happened in the last of them is a trial's: no jump there is told late, louder noise counts
LATE_WORTH = 10.0  # variances of noise that a jump must explain before looking back is worth its cost
LATE_TRIAL = 3.0  # or the log odds against none that a trial has come to
LATE_GOES_ON = -1.0  # or the log odds that the last look came to: the sums above know 32 samples of one filter

# Trials
SURPRISE_OF_STATE = 4.0  # the same beside a state, as one in 22 does: there it is cheap to begin again
SURPRISE = 9.0  # times the variance of a prediction: a trial begins, as one sample in 370 does by chance
KEPT, WINDOW = 15 / 16, 16.0  # a sample, of the sums that suspicion rests on; so many samples they look back
CLIP = 3.0  # deviations that one sample says at most: an outlier alone is a surprise, not a suspicion
SUSPECT_JUMP = 4.0  # times what is known: nearly three deviations of the sum
SUSPECT_LOUD, SUSPECT_QUIET = 10.0, -7.5  # of the squares: two deviations (their distribution is lopsided)
DEAD = -6.0  # log odds of the best explanation other than none, below which a trial ends: a surprise that comes to
# nothing; a suspicion goes on, since who has seen a jump of one deviation needs thirty samples to be sure
DOUBTLESS = log(FALSE_RATE)  # log odds of what stood against a jump that is told, below which it stands
YOUNG = 100.0  # samples in which everything is suspicious
FRESH = 1.0  # samples, besides one for each parameter, before it does, or before a surprise begins another
HOPELESS = -1.0  # log odds below which one ends after OLD samples, or at a surprise
OLD, OLDEST = 32.0, 100.0  # samples; after the second any ends
JUMP_AGE, LEVEL_AGE = 2.0, 8.0  # samples before one is told: one alone may be an outlier; a level takes several

# A second start
YOUNG_ENOUGH = 200.0  # samples in which one is looked for
FARTHEST = 1e6  # variance of its parameters, in units: a thousand deviations
LEARNING, YOUTH = 10.0, 30.0  # samples, besides one a parameter, before its predictions count; and in which they do
FAMILIAR = 100.0  # times R: a prediction of as much variance says nothing, some regressor is new to it
BETTER, UNFIT = 5.0, -14.0  # log evidence at which it takes over; below which another begins
AT_ONCE = 2.5  # of it that one sample brings, at most: to who has fitted a wrong number the next one is less wrong
AGREE, WITHIN = 0.55, 0.176  # share of the last rows that has to agree; mean square of that half of normal errors
BEYOND = 16.0  # times the variance of those that agree: a row does not, as few do of any that are right
TRUSTED = 1.01  # times R: no regressor of such a row is in doubt
FEW, APART = 2, 3  # rows besides one a parameter that a fit begins with; so many rows apart
LEAST_KNOWN = 1e-6  # of a parameter, before any row, in units
OF_LEFT_OUT = 0.2  # of the rows left out are wrong themselves; the others have a wrong number among their regressors
BETWEEN, A_ROW = 5, 4.0  # rows between two looks at them; log evidence that each left out costs: one in twenty is wrong
AHEAD = 2.5  # log evidence of a start that goes on, however old; by so much one that was looked for again is behind,
# since some of many tries look better by chance
ENOUGH = 0.1  # of the squares of each regressor that rows which agree have to have

# Less noise where nothing but noise moves the regressors
SILENCE = 2e-3  # of the variance of the noise: a plant that has less of it left is switched off, and rests

# Less noise among outliers
QUIETER, KNOWN = 4.0, 8.0  # sigma^2 over what most rows say, from which on a filter begins with that; samples it is by
SMALLEST = 1e-4  # of sigma^2, a square that counts
OF_SQUARES = 1.2703628454614782  # -E log z^2 of normal errors: gamma + log 2
ROWS = 8.0  # of WINDOW that have to speak
UNLIKELY, LONGEST = -8.0, 100.0  # log evidence, and samples, after which that filter is given up
HAS_SEEN = 1.5  # outliers that it has to see: without, another level of the noise says as much, and a trial tells it

# Louder noise among outliers
LOUD_ENERGY = 16.0  # of the squares, as SUSPECT_LOUD: four deviations, at which a filter with louder noise begins
HARDLY_FAST = 0.01  # weight of the fast filter then
LOUD_AGE = 16.0  # samples before it takes over: what has jumped is followed by then
