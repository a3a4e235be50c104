"""`Fit`: whether a model still predicts as it says, window by window; where it does not, it is identified again."""

from __future__ import annotations

import math

import numpy as np

from ..engine import compile
from ..engine.elementary import log
from ..fleet.columns import Columns
from ..fleet.counters import SET_ASIDE

LAGS = 10  # of the autocorrelations that are looked at
CLIP = 3.0  # deviations to which errors are drawn in: a jump, or an outlier, is no other model
RUN = 2.0  # windows in a row that are not fine
NIS = 0.8, 1.25  # fine in a window of any length: beyond, bars are 12 % off
CORRELATED = 0.01  # fine: less than a hundredth of the variance is not worth a model
SURE = 2.58  # deviations that hold 99 %
FRESH = dict(
    seen=0.0, squares=0.0, run=0.0, nis=np.nan, correlated=np.nan, rest=0.0, patience=1.0, collected=0.0, score=0.0
)
ASKED, COLLECTED = 2.0, 1.0  # what `look` tells of a sample: the model is to be identified again; one to do so with
LONGEST = 1024.0  # windows until a model that stayed may be asked for again, at most


class Fit(Columns):
    """How well the last ``window`` samples of each series were predicted, and what is collected to choose anew.

    A window is fine where the mean of its squared standardized errors (NIS) and their autocorrelations are, those of
    lags 1 to 10 together, less what chance makes of them: (Q - lags)/(n + 2), Q of Ljung and Box. After two windows in
    a row that are not, the next ``window`` samples are collected, and a model is chosen by them. Of one that stays
    nevertheless it is not asked again for as many windows as ``patience`` says, each time twice as many. Errors are
    drawn in to three deviations. ``score`` is the log density of the later half of what was collected, of errors so
    drawn in, as the present model predicted it. ``window`` 0: nothing is watched.

    Bad at: plants that become another one more often than every third window; noise with tails, of which a model is
    chosen again in vain now and then.
    """

    def __init__(self, window: int = 0, size: int = 0):
        lags = [f"{word}{lag}" for word in ("error", "product") for lag in range(1, LAGS + 1)]
        super().__init__(FRESH | dict.fromkeys(lags, 0.0) if window else {}, size)
        self.window = window

    @property
    def fine(self) -> tuple[float, float, float]:
        """Lowest and highest NIS of a window that is fine, and its highest autocorrelation: 99 % of sound ones."""
        half, n = SURE * math.sqrt(2.0 / self.window), self.window
        chance = LAGS * (1 - 2 / (9 * LAGS) + 2.33 * math.sqrt(2 / (9 * LAGS))) ** 3  # chi-square, Wilson and Hilferty
        return min(NIS[0], 1 - half), max(NIS[1], 1 + half), max(CORRELATED, (chance - LAGS) / (n + 2))

    def take(self, at, outs) -> np.ndarray:
        """Take what samples of rows ``at`` (n,) showed, in order of time; return `ASKED`, `COLLECTED` or 0 of each."""
        told = np.zeros(len(at))
        if self.window and len(at):
            self.grow(int(at.max()) + 1)
            limits = np.array([self.window, *self.fine, CLIP, RUN, LONGEST])
            compile.function(look, 2, "index", 2, 1, 1)(
                self._numbers, np.ascontiguousarray(at, np.int64), np.ascontiguousarray(outs), told, limits
            )
        return told

    def begin(self, row: int, patience: float = 1.0) -> None:
        """Watch a series afresh."""
        for name, value in zip(self.names, self._fresh[:, 0]):
            self[name][row] = value
        self["patience"][row] = patience

    def stays(self, row: int) -> None:
        """Go on watching a series whose model stays."""
        self["collected"][row] = self["score"][row] = 0.0

    def words(self, row: int) -> str:
        """Return what is not fine with a series."""
        low, high, most = self.fine
        nis, correlated = self["nis"][row], self["correlated"][row]
        said = [f"NIS {nis:.3g}, fine {low:.3g} to {high:.3g}"] if not low <= nis <= high else []
        said += [f"whiteness {correlated:.3g}, fine to {most:.3g}"] if correlated > most else []
        return f"{'; '.join(said)}, in {self.window} samples and in those before"


def look(numbers, at, outs, told, limits):
    """Put errors into the windows of their series; say of each sample what comes of it."""
    SEEN, SQUARES, IN_A_ROW, SIZE, LEFT, REST, PATIENCE, COUNT, SCORE, FIRST = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9
    window, clip = limits[0], limits[4]
    for i in range(at.size):
        s = at[i]
        e, variance, status = outs[i, 1], outs[i, 2], int(outs[i, 3])
        is_seen, z = math.isfinite(e) and variance > 0.0, 0.0
        if is_seen:
            z = max(min(e / math.sqrt(variance), clip), -clip)
        is_asked = numbers[COUNT, s] > 0.0
        if is_asked:
            numbers[COUNT, s] += 1.0
            told[i] = 1.0
            if is_seen and 0.5 * window < numbers[COUNT, s] - 1.0 <= window:
                numbers[SCORE, s] -= 0.5 * (log(variance) + z * z)
        if status & SET_ASIDE:
            is_seen, z = False, 0.0
        numbers[SEEN, s] += is_seen
        numbers[SQUARES, s] += z * z
        for lag in range(LAGS - 1, -1, -1):
            numbers[FIRST + LAGS + lag, s] += z * numbers[FIRST + lag, s]
            numbers[FIRST + lag, s] = numbers[FIRST + lag - 1, s] if lag > 0 else z
        if numbers[SEEN, s] < window:
            continue
        squares, q = max(numbers[SQUARES, s], 1e-300), 0.0
        for lag in range(LAGS):
            r = numbers[FIRST + LAGS + lag, s] / squares
            q += r * r / (window - lag - 1.0)
            numbers[FIRST + LAGS + lag, s] = 0.0
        numbers[SIZE, s] = squares / window
        numbers[LEFT, s] = window * q - LAGS / (window + 2.0)
        numbers[SEEN, s], numbers[SQUARES, s] = 0.0, 0.0
        is_fine = limits[1] <= numbers[SIZE, s] <= limits[2] and numbers[LEFT, s] <= limits[3]
        numbers[IN_A_ROW, s] = 0.0 if is_fine else numbers[IN_A_ROW, s] + 1.0
        numbers[REST, s] = max(numbers[REST, s] - 1.0, 0.0)
        if numbers[IN_A_ROW, s] >= limits[5] and numbers[REST, s] == 0.0 and not is_asked:
            numbers[COUNT, s], told[i] = 1.0, 2.0
            numbers[REST, s] = numbers[PATIENCE, s] + 1.0
            numbers[PATIENCE, s] = min(2.0 * numbers[PATIENCE, s], limits[6])
    return 0.0
