"""A scene as data: what moves, how it is seen, what troubles there are."""

from __future__ import annotations

from typing import NamedTuple


class Kind(NamedTuple):
    """A class of objects: what the tracker is told of it, and what is possible; pairs are least and most."""

    told: float  # m/s, what is fast for the class
    speed: tuple[float, float]  # m/s
    acceleration: tuple[float, float]  # m/s^2, of manoeuvres
    scan: tuple[float, float]  # s
    deviation: tuple[float, float]  # m
    leg: tuple[float, float]  # s, between manoeuvres
    can_rest: bool
    circles: bool = False  # turns go on for whole circles


KINDS = {
    "flight": Kind(250.0, (80.0, 250.0), (2.0, 12.0), (0.5, 12.0), (5.0, 200.0), (30.0, 300.0), False),
    "jet": Kind(250.0, (150.0, 300.0), (15.0, 60.0), (1.0, 8.0), (10.0, 100.0), (15.0, 90.0), False),
    "helicopter": Kind(60.0, (5.0, 60.0), (1.0, 6.0), (0.5, 6.0), (2.0, 30.0), (15.0, 90.0), True),
    "glider": Kind(40.0, (18.0, 40.0), (2.0, 6.0), (1.0, 12.0), (3.0, 15.0), (30.0, 200.0), False, True),
    "uav": Kind(20.0, (1.0, 20.0), (1.0, 8.0), (0.02, 2.0), (0.01, 2.0), (4.0, 40.0), True),
    "boat": Kind(8.0, (1.0, 10.0), (0.05, 0.5), (1.0, 120.0), (1.0, 15.0), (60.0, 1200.0), True),
    "walker": Kind(2.0, (0.5, 2.0), (0.2, 1.0), (0.5, 10.0), (0.5, 8.0), (10.0, 200.0), True),
    "limb": Kind(5.0, (0.2, 4.0), (2.0, 20.0), (0.01, 0.03), (0.001, 0.01), (0.5, 3.0), True),
    "animal": Kind(2.0, (0.05, 1.0), (0.1, 0.5), (600.0, 86400.0), (5.0, 50.0), (3600.0, 86400.0), True),
}
ALONE = (
    *("nothing", "rests", "lattice", "wild", "gaps", "precise start", "uneven", "heavy", "second sensor", "stated"),
    "company",
)


class Sensor(NamedTuple):
    """How plots are made."""

    name: str
    scan: float  # s
    deviation: float  # m
    first: float = 0.0  # s, of its first plot
    offset: tuple[float, float] = (0.0, 0.0)  # m
    clock: float = 0.0  # s that its stamps are late


class Scene(NamedTuple):
    """One drawn scene; ``seed`` makes its random numbers."""

    number: int
    seed: tuple[int, ...]
    name: str
    kind: Kind
    troubles: tuple[str, ...]
    plots: int  # of the first sensor
    sensors: tuple[Sensor, ...]
    objects: int = 1
    keyed: bool = True
    single: bool = False  # the tracker is told that all is one object
    lattice: float = 0.0  # m
    wild: float = 0.0  # share of the plots
    along: bool = False  # wild plots lie along the track
    missing: float = 0.0
    pauses: int = 0
    precise: tuple[int, float] = (0, 1.0)  # first plots, factor of their deviation
    uneven: float = 0.0  # share of a scan; 2: reports at 1, 3 and 10 scans
    heavy: bool = False
    stated: float = 0.0  # factor of the variance that is told; 0: none is
    early: int = 0  # of the first ten plots that are wild
    resampled: float = 0.0  # share of the plots that were seen, the others lie on lines between those; 0: all were
    handover: tuple[int, float] = (0, 1.0)  # first plots, factor of the time between them
    behind: float = 0.0  # share of the plots at which a position stays behind, to catch up in those that follow
    late: str = ""  # the way of `latency` by which positions are old when they are stamped

    def __str__(self):
        scans = " and ".join(f"{s.scan:.3g} s, {s.deviation:.2g} m" for s in self.sensors)
        return f"{self.number}: {self.name}, {self.plots} plots, {scans}; {', '.join(self.troubles) or 'nothing'}"
