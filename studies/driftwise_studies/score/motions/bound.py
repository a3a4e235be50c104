"""What the share of tracks whose mean NIS is in .5 to 1.5 can be: ours beside one that knows the error of every plot.

A mean of squares is what its largest square is. The first plot after a precise start, of a manoeuvre that is large
beside the errors or after a rest in one cell is hundreds to millions of its variance, whoever waits for it unknowing.

A second table has what chance alone leaves of .5 to 1.5 by number of plots: the exact filter, whose errors are white
and of the variance it says, has a mean NIS of chi-squared(2n)/2n. 99 in 100 of its tracks are within ``chance``. Who
does not know when a manoeuvre comes has too much variance until it does, and then too little: see off manoeuvres.

Run: python -m driftwise_studies.score.motions.bound [--seed 0] [--scenes 600]
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.stats import chi2

from .drawing import asked
from .field import number, table
from .measured import FEW, FIRST, LONG, Found, play
from .scene import ALONE

HEAD = (
    "",
    "tracks",
    "in",
    "below",
    "above",
    f"above by {FEW} plots",
    *(f"{where} who knows" for where in ("in", "below", "above")),
)


BY_PLOTS = (
    "plots",
    "tracks",
    "in, exact filter",
    "99 % chance at the least",
    *(
        f"{what}, {who}"
        for who in ("ours", "who knows")
        for what in ("in", "within chance", "median", "off manoeuvres")
    ),
)
EDGES = LONG, 50, 100, 200, 1000


def within_chance(nis, plots) -> np.ndarray:
    """Return which mean NIS are in the 99 % interval of an exact filter's; two coordinates each."""
    freedom = 2.0 * (np.asarray(plots) - FIRST)
    return (chi2.ppf(0.005, freedom) <= nis * freedom) & (nis * freedom <= chi2.ppf(0.995, freedom))


def in_widened(found: list[Found], least: float = 0.8, most: float = 1.5) -> float:
    """Return the share of long tracks whose NIS is in a band, widened by chance for each one's own number of plots.

    A band is widened to its least times the lower end of the 99 % interval of an exact filter's mean NIS, and to its
    most times the upper end: where a track would be whose true mean is at an end of the band.
    """
    nis, plots = np.array([(t.nis, t.plots) for f in found for t in f.tracks if t.plots >= LONG]).reshape(-1, 2).T
    freedom = 2.0 * (plots - FIRST)
    low, high = (chi2.ppf(part, freedom) / freedom for part in (0.005, 0.995))
    return float(np.mean((least * low <= nis) & (nis <= most * high)))


def by_plots(ours: list[Found], knowing: list[Found]) -> str:
    """Return the second table."""
    rows = []
    for least, most in pairwise(EDGES):
        freedom = 2.0 * (least - FIRST)
        exact = chi2.cdf(1.5 * freedom, freedom) - chi2.cdf(0.5 * freedom, freedom)
        ends = chi2.ppf([0.005, 0.995], freedom) / freedom
        row = [f"{least} to {most - 1}", "", number(float(exact)), f"{ends[0]:.2f} to {ends[1]:.2f}"]
        for found in (ours, knowing):
            told = [(t.nis, t.quiet_nis, t.plots) for f in found for t in f.tracks if least <= t.plots < most]
            nis, quiet, plots = np.array(told).reshape(-1, 3).T
            row[1] = row[1] or str(len(nis))
            row += [number(float(np.mean(hit))) for hit in ((nis >= 0.5) & (nis <= 1.5), within_chance(nis, plots))]
            row += [number(float(np.median(nis)), 2), number(float(np.nanmedian(quiet)), 2)]
        rows.append(row)
    return table(rows, BY_PLOTS)


def shares(found: list[Found], trouble: str | None) -> tuple[int, list[float]]:
    """Return how many long tracks scenes with a trouble have, and the shares of them in, below and above the band."""
    chosen = [f for f in found if trouble is None or trouble in (f.scene.troubles or ("nothing",))]
    both = np.array([(t.nis, t.most_nis) for f in chosen for t in f.tracks if t.plots >= LONG]).reshape(-1, 2)
    low, high = both[:, 0] < 0.5, both[:, 0] > 1.5
    parts = ~(low | high), low, high, high & (both[:, 1] <= 1.5)
    return len(both), [float(np.mean(part)) if len(both) else np.nan for part in parts]


def main(arguments=None) -> None:
    """Print both tables."""
    seed, scenes = asked(__doc__, arguments, scenes=600)
    ours, knowing = (play(seed, range(scenes), stated=stated) for stated in (False, True))
    rows = []
    for trouble in (None, *ALONE):
        (n, mine), (_, theirs) = shares(ours, trouble), shares(knowing, trouble)
        rows.append([trouble or "all", str(n), *map(number, mine), *map(number, theirs[:3])])
    print(table(rows, HEAD), by_plots(ours, knowing), sep="\n")


if __name__ == "__main__":
    main()
