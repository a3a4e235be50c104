"""The paper's example, every way to run it: three sizes of Q, the gain printed and correct, and five rules for Q."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from . import plain
from .systems import system

SIZES = (1e-4, 1e-3, 1e-2)
SKIP = 50  # samples that do not count
B1, SHOWN = 2, 0  # the parameter and the record of the paper's figures
PAPER = "Abid and Kamoun 2008, section"
OURS = "this package's comparison of memories"
KNOWN, FUZZY, TUNED = "known Q", "fuzzy, documented default", "fuzzy, tuned on the example"
AUXILIARY, SLOW = "auxiliary filter, tuned", "auxiliary filter, slow start"
RULES = {
    KNOWN: plain.Known,
    FUZZY: lambda q: plain.Fuzzy(),
    TUNED: lambda q: plain.Fuzzy((0.0, 0.1, 1.0), increment=0.1),
    AUXILIARY: lambda q: plain.Auxiliary(),
    SLOW: lambda q: plain.Auxiliary(0.01, 0.99, 1.0),
}
GAINS = {False: "correct", True: "printed"}


@dataclass(frozen=True)
class Score:
    """What a run is worth, from sample 50 on, predictions throughout; a number for each record where it says (S,)."""

    prediction: np.ndarray  # (S,) mean square of e
    b1: np.ndarray  # (S,) mean square error of b1
    nis: float
    lag1: float  # correlation of neighbours of e/sqrt(S)
    inside: float  # share of e within its 95 % band
    b1_inside: float
    claimed: np.ndarray  # (4,) mean square error of each parameter over its P
    e: np.ndarray  # of the record shown
    estimate: np.ndarray
    truth: np.ndarray

    @property
    def rmse(self) -> float:
        """Root mean square of e."""
        return float(np.sqrt(self.prediction.mean()))

    @property
    def deviation(self) -> float:
        """Standard error of `rmse`."""
        return float(self.prediction.std() / np.sqrt(len(self.prediction)) / (2 * self.rmse))

    @property
    def b1_rmse(self) -> float:
        """Root mean square error of b1."""
        return float(np.sqrt(self.b1.mean()))


def score(path: plain.Path, theta) -> Score:
    """Return the score of a path beside the true parameters."""
    e, S, error = path.e[:, SKIP:], path.S[:, SKIP:], (path.theta - theta)[:, SKIP:]
    white = e / np.sqrt(S)
    P = path.variance[:, SKIP:]
    return Score(
        (e**2).mean(axis=1),
        (error[..., B1] ** 2).mean(axis=1),
        float((white**2).mean()),
        float((white[:, 1:] * white[:, :-1]).mean() / (white**2).mean()),
        float((np.abs(white) < 1.96).mean()),
        float((np.abs(error[..., B1]) < 1.96 * np.sqrt(P[..., B1])).mean()),
        (error**2).mean(axis=(0, 1)) / P.mean(axis=(0, 1)),
        path.e[SHOWN],
        path.theta[SHOWN, :, B1],
        theta[SHOWN, :, B1],
    )


@lru_cache(maxsize=2)
def scores(seeds: int) -> dict[tuple[float, bool, str], Score]:
    """Return the score of each (size of Q, printed gain or not, rule), all on the same records."""
    found = {}
    for size in SIZES:
        s = system("a", seeds, q=size)
        for printed in GAINS:
            for name, rule in RULES.items():
                found[size, printed, name] = score(plain.follow(s, rule(s.q), printed), s.theta)
    return found


def wins(mine: Score, other: Score) -> tuple[float, float]:
    """Return the share of records with the smaller prediction error, and with the smaller error of b1."""
    return float((mine.prediction < other.prediction).mean()), float((mine.b1 < other.b1).mean())
