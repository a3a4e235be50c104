"""A plant as data: its dynamics, its troubles, and how its record is written."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SLOWEST = 1  # of a lag that jumps: the slowest mode alone
DRAWN = (
    "level jump", "gain jump", "noise jump", "coloured", "drift", "season", "outliers", "stuck", "quantised",
    "irregular", "sparse", "closed loop", "nonlinear", "delay", "missing",
)  # fmt: skip
TROUBLES = *DRAWN, "lag jump"  # the last beside the others, of some files: what else a seed draws is as it was


@dataclass(frozen=True)
class Jump:
    """What changes at a sample: the level by ``size`` (deviations of y), a gain, the noise or a lag by a factor.

    A lag is all time constants or, where ``input`` is one, the slowest; gains stay.
    """

    what: str  # level, gain, noise or lag
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

    def poles_at(self, sizes=None) -> list[tuple[int, np.ndarray]]:
        """Return the first sample of each stretch with poles of its own, and these; ``sizes`` of jumps if others."""
        found, poles = [(0, np.array(self.poles))], np.array(self.poles)
        for jump, size in zip(self.jumps, [jump.size for jump in self.jumps] if sizes is None else sizes):
            if jump.what == "lag":
                least = abs(poles).max() - 1e-9 if jump.input == SLOWEST else 0.0
                poles = np.where(abs(poles) > least, poles ** (1 / size), poles)
                found.append((jump.at, poles))
        return found

    @property
    def is_irregular(self) -> bool:
        """Whether rows come at random instants of the grid."""
        return "irregular" in self.troubles

    @property
    def time_constants(self) -> list[float]:
        """Time constant of each mode, in samples, the slowest first."""
        return sorted({float(-1 / np.log(abs(p))) for p in self.poles}, reverse=True)

    @property
    def slowest(self) -> float:
        """The longest time constant that it ever has, in samples."""
        return max(float(-1 / np.log(abs(p).max())) for _, p in self.poles_at())

    @property
    def periods(self) -> list[float]:
        """Period of each oscillation, in samples, as it is at the end."""
        return [float(2 * np.pi / abs(np.angle(p))) for p in self.poles_at()[-1][1] if p.imag > 0]

    @property
    def about(self) -> str:
        """What it is, in one line."""
        what = ", ".join(sorted(self.troubles)) or "nothing"
        return f"{self.number}: order {len(self.poles)}, {len(self.gains)} inputs, {self.samples} samples, {what}"
