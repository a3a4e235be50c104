"""When did the plant change? Two forecasts are watched, and their false alarms add up to a promised rate."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..detect.alarms import scan
from ..detect.self_starting import Learning
from ..results.events import Event

FALSE = 1000  # samples in which one false alarm is allowed, of both together
SHARES = 1500, 3000  # of the forecast that adapts, and of the models that never forget
# The thresholds of SelfStarting at these rates; to work them out again would take a second of every run.
SOON, SLOWLY = (
    Learning(np.array([1.5, -1.5, 3.0, -3.0]), 4.0, np.array([mean, mean, far, far, louder]), 0.0, 20.0)
    for mean, far, louder in (
        (6.80687216921444, 6.633330911018825, 5.814275746482731),
        (7.499087361316398, 7.315391997759459, 6.503417931783994),
    )
)
SAME = 30  # samples within which alarms are about one change


class Watching:
    """Alarms of `SelfStarting` on two series of normal scores, fed in pieces.

    One is of a forecast that adapts: what even that did not see coming. The other is of simple models that never
    forget: a shift that an adaptive forecast learns before it stands out. Together at most one false alarm in 1000
    samples is promised, where the scores have the law they should have.
    """

    def __init__(self):
        self._states: list[Any] = [None, None]
        self._last = -np.inf
        self.samples = 0

    def add(self, adaptive, steady, time) -> list[Event]:
        """Return the alarms of the next piece, (T,) scores each; samples count from its beginning."""
        found = []
        for k, (detector, z) in enumerate(((SOON, adaptive), (SLOWLY, steady))):
            alarms = scan(detector, z, state=self._states[k])
            self._states[k] = alarms.state
            found += [(int(t), int(since)) for t, since in zip(alarms.samples, alarms.changes)]
        reported = []
        for t, since in sorted(found):
            if self.samples + t - self._last > SAME:
                reported.append(Event(t, float(time[t]), "CHANGE", "the forecast no longer fits", since=max(since, 0)))
            self._last = self.samples + t
        self.samples += len(adaptive)
        return reported
