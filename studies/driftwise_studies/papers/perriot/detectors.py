"""Tests for a jump of the optimal gain, for many records at once; each looks at a `Sample` and says +1, -1 or 0."""

from __future__ import annotations

import numpy as np

from .hampton import PHI, QUIET, Mean, Sample


def printed_signal(s: Sample):
    """Return Z = R^-1 Q of section 4.2."""
    return s.way.Z


class Studentised:
    """The signal over its own scale: f nu or psi nu over the root of the running means of both squares."""

    def __init__(self, score=False):
        self.score = score
        self.row, self.error = Mean(100), Mean(100)

    def __call__(self, s: Sample):
        """Return the signal; the means take the sample in after use."""
        row = s.psi if self.score else s.f
        scale = np.sqrt(self.row.value * self.error.value) if s.n > 1 else np.inf
        self.row.add(row * row)
        self.error.add(s.nu * s.nu)
        return row * s.nu / scale


class Hinkley:
    """Two cumulative sums of section 4.3, each with its own (dmu, h); both start anew after any alarm."""

    def __init__(self, signal, up, down, N0=(26.5, 26.5)):
        self.signal, self.up, self.down, self.N0 = signal, up, down, N0

    def start(self, count):
        """Forget everything."""
        self.a, self.b = np.zeros(count), np.zeros(count)

    def look(self, s: Sample):
        """Return the direction of each alarm; the increase where both fire."""
        Z = self.signal(s)
        if s.n <= QUIET:
            return 0
        (dmu, h), (dmu_down, h_down) = self.up, self.down
        self.a, self.b = np.maximum(0, self.a + Z - dmu), np.maximum(0, self.b - Z - dmu_down)
        fired = np.where(self.a >= h, 1, np.where(self.b >= h_down, -1, 0))
        self.a, self.b = np.where(fired, 0.0, self.a), np.where(fired, 0.0, self.b)
        return fired


class Windows:
    """Sums A_m of the last m signals, m <= 200, emptied after an alarm: the largest, or their mixture."""

    LONGEST = 200
    SPREAD = 0.09  # prior variance of the mean in the mixture

    def __init__(self, signal, threshold, mixture=False, N0=(26.5, 26.5)):
        self.signal, self.threshold, self.mixture, self.N0 = signal, threshold, mixture, N0

    def start(self, count):
        """Forget everything."""
        self.sums, self.length = np.zeros((count, self.LONGEST)), np.zeros((count, self.LONGEST))

    def look(self, s: Sample):
        """Return the direction of each alarm."""
        Z = self.signal(s)
        if s.n <= QUIET:
            return 0
        slot = s.n % self.LONGEST  # a window that began 200 samples ago makes room for one that begins now
        self.sums[:, slot] = self.length[:, slot] = 0.0
        open_ = self.length > 0
        open_[:, slot] = True
        self.sums += np.where(open_, Z[:, None], 0.0)
        self.length += open_
        A, m = self.sums, np.maximum(self.length, 1.0)
        if self.mixture:
            t = self.SPREAD
            weight = np.where(open_, np.exp(t * A * A / (2 * (1 + m * t))) / np.sqrt(1 + m * t), 0.0)
            size, side = weight.sum(axis=1), np.sign((weight * A).sum(axis=1))
        else:
            gain = A * A / (2 * m)
            best = gain.argmax(axis=1)[:, None]
            size, side = np.take_along_axis(gain, best, 1)[:, 0], np.sign(np.take_along_axis(A, best, 1)[:, 0])
        fired = np.where(size >= self.threshold, side, 0).astype(int)
        self.sums[fired != 0] = self.length[fired != 0] = 0.0
        return fired


class Probes:
    """Filters with fixed gains beside the adaptive one; an alarm when one of them has explained y better for long.

    g_m = max(0, g_m + (nu^2 - nu_m^2)/(2 c)): its drift is negative while K is optimal, so no dmu is needed. Bad at
    small upward jumps; its run length depends on the optimal gain.
    """

    GRID = np.array([0.05, 0.12, 0.25, 0.45, 0.75])[:, None]

    def __init__(self, threshold, N0=26.5):
        self.threshold, self.N0 = threshold, (N0, N0)

    def start(self, count):
        """Forget everything."""
        (self.xp, self.g), self.c = np.zeros((2, len(self.GRID), count)), Mean(50)

    def look(self, s: Sample):
        """Return the direction of each alarm."""
        nu, fired = s.y - self.xp, np.zeros(s.y.shape, int)
        if s.n > QUIET:
            self.g = np.maximum(0, self.g + (s.nu**2 - nu**2) / (2 * self.c.value))
            side = np.where(self.GRID[self.g.argmax(axis=0), 0] > s.K, 1, -1)
            fired = np.where(self.g.max(axis=0) >= self.threshold, side, 0)
            self.g = np.where(fired, 0.0, self.g)
        self.c.add(s.nu**2)
        self.xp = PHI * (self.xp + self.GRID * nu)
        return fired
