"""When did the plant change? Two forecasts are watched, and their false alarms add up to a promised rate."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..detect.self_starting import SelfStarting
from .events import Event

PROMISED = "1 per 1000"  # of both together
SOON, SLOWLY = SelfStarting("1 per 1500"), SelfStarting("1 per 3000")
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

    def add(self, adaptive, steady, time, others=()) -> list[Event]:
        """Return the alarms of the next piece, (T,) scores each; samples count from its beginning.

        ``others`` are jumps that the model itself was watched for.
        """
        found = [(event.sample, event.since or 0) for event in others]
        for k, (detector, z) in enumerate(((SOON, adaptive), (SLOWLY, steady))):
            alarms = detector.scan(z, state=self._states[k])
            self._states[k] = alarms.state
            found += [(int(t), int(since)) for t, since in zip(alarms.samples, alarms.changes)]
        told = []
        for t, since in sorted(found):
            if self.samples + t - self._last > SAME:
                told.append(Event(t, float(time[t]), "CHANGE", "the forecast no longer fits", since=max(since, 0)))
            self._last = self.samples + t
        self.samples += len(adaptive)
        return told
