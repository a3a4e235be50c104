"""How often a sensor sees an object: medians of time differences, learnt as plots come."""

from __future__ import annotations

OWN, POOLED = 15, 63  # time differences remembered for an object and sensor; for a sensor over all objects
ENOUGH = 5  # differences of its own an object needs until the sensor's need no longer count


def _median(values: list[float]) -> float:
    """Return the lower median: of two differences one may be a gap, and is the longer one."""
    return sorted(values)[(len(values) - 1) // 2]


class Scans:
    """The time differences of every sensor, over all objects.

    Each object keeps a clock, a dict from sensor to ``[time of the last plot, differences ..]``, which `tick` moves.
    """

    def __init__(self, pooled: dict[str, list[float]] | None = None):
        self.pooled = {} if pooled is None else pooled

    def tick(self, clock: dict[str, list[float]], sensor: str, time: float, longest: float) -> None:
        """Move an object's clock on: a sensor saw it; a time beyond ``longest`` is a pause, not a scan."""
        seen = clock.get(sensor)
        if seen is None:
            clock[sensor] = [time]
            return
        delta = time - seen[0]
        seen[0] = time
        if not 0 < delta <= longest:
            return
        seen.append(delta)
        if len(seen) > 1 + OWN:
            del seen[1]
        pool = self.pooled.setdefault(sensor, [])
        pool.append(delta)
        if len(pool) > POOLED:
            del pool[0]

    def usual(self, sensor: str) -> float:
        """Return the time in which a sensor sees an object again, s, whichever; 0 is unknown."""
        pool = self.pooled.get(sensor)
        return _median(pool) if pool else 0.0

    def shortest(self, sensor: str) -> float:
        """Return the shortest time in which a sensor saw an object again, s, of the last ones; 0 is unknown."""
        return min(self.pooled.get(sensor, ()), default=0.0)

    def period(self, clock: dict[str, list[float]]) -> float:
        """Return the time in which an object is seen again, s: of the slowest sensor that sees it; 0 is unknown."""
        slowest = 0.0
        for sensor, seen in clock.items():
            own = _median(seen[1:]) if len(seen) > 1 else 0.0
            if len(seen) <= ENOUGH:
                own = max(own, self.usual(sensor))
            slowest = max(slowest, own)
        return slowest
