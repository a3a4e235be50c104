"""A plant as data: its dynamics, its troubles, and how its record is written."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

TROUBLES = (
    "level jump", "gain jump", "noise jump", "coloured", "drift", "season", "outliers", "stuck", "quantised",
    "irregular", "sparse", "closed loop", "nonlinear", "delay", "missing",
)  # fmt: skip


@dataclass(frozen=True)
class Jump:
    """What changes at a sample: the level by ``size`` (deviations of y), a gain or the noise by a factor."""

    what: str  # level, gain or noise
    at: int
    size: float
    input: int = 0


@dataclass(frozen=True)
class Plant:
    """y = sum B_i/A f(u_i) + level + noise, on a grid of ``samples`` steps of ``dt`` seconds."""

    number: int
    troubles: frozenset[str]
    samples: int
    dt: float
    poles: tuple[complex, ...]
    numerators: tuple[tuple[float, ...], ...]  # of each input, as shares of its gain
    gains: tuple[float, ...]
    delays: tuple[int, ...]  # samples until the first answer, 0 or more
    excitation: str
    level: float
    snr: float
    noise: str  # white, equation or coloured
    rho: float  # of coloured noise
    jumps: tuple[Jump, ...] = ()
    ramp: float = 0.0  # of the level over the record, in deviations of y
    season: tuple[float, int] = (0.0, 0)  # amplitude in deviations of y, period in samples
    outliers: tuple[float, float] = (0.0, 0.0)  # share, size in deviations of y
    stuck: tuple[int, int] = (0, 0)  # where from, how long
    levels: int = 0  # steps in which y is written, over two deviations
    every: int = 1  # of how many rows one has an output
    loop: float = 0.0  # gain of the controller, as a share of 1 / gain of the plant
    nonlinearity: str = ""  # square or saturation
    missing: float = 0.0

    @property
    def a(self) -> np.ndarray:
        """1, a1, .. of the common denominator."""
        return np.real(np.poly(self.poles))

    @property
    def is_irregular(self) -> bool:
        """Whether rows come at random instants of the grid."""
        return "irregular" in self.troubles

    @property
    def time_constants(self) -> list[float]:
        """Time constant of each mode, in samples, the slowest first."""
        return sorted({float(-1 / np.log(abs(p))) for p in self.poles}, reverse=True)

    @property
    def periods(self) -> list[float]:
        """Period of each oscillation, in samples."""
        return [float(2 * np.pi / abs(np.angle(p))) for p in self.poles if p.imag > 0]

    @property
    def about(self) -> str:
        """What it is, in one line."""
        what = ", ".join(sorted(self.troubles)) or "nothing"
        return f"{self.number}: order {len(self.poles)}, {len(self.gains)} inputs, {self.samples} samples, {what}"
