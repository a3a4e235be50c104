"""A system as data: what it is, what troubles it, and where it is stable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

RADIUS = 0.95  # of all frozen poles, with and without the loop
ALONE = (
    "nothing", "walk all", "walk some", "jumps", "louder", "quieter", "outliers", "coloured", "quantised",
    "closed loop", "rest", "missing",
)  # fmt: skip


@dataclass(frozen=True)
class System:
    """One system, as data; `about` says it in a line."""

    number: int
    na: int  # past outputs; -1: a regression on regressors that are given
    nb: tuple[int, ...]  # coefficients of each input; of a regression, one each
    theta: tuple[float, ...]  # where its parameters begin
    sigma: float
    deviations: tuple[float, ...]  # of each parameter
    input: tuple[str, float]  # its kind and number: pole, levels, gain of the loop
    nvr: tuple[float, ...] = ()  # of each parameter, 0 where it rests; none: nothing walks
    jumps: tuple[tuple[float, tuple[int, ...]], ...] = ()  # size in deviations, which parameters
    steps: tuple[float, ...] = ()  # what the noise is multiplied with, at each of its steps
    outliers: tuple[float, float] = (0.0, 0.0)  # share, size in deviations of the noise
    of_process: bool = False  # outliers are of e, which the plant feels (innovational), not of what is measured of y
    rest: tuple[int, bool] = (0, False)  # how many samples, whether the noise rests as well
    missing: tuple[float, int] = (0.0, 1)  # share, mean length of a run

    @property
    def troubles(self) -> tuple[str, ...]:
        """Return the names of what is there, of `ALONE`."""
        walks = [v > 0 for v in self.nvr]
        louder = self.steps[:1] and self.steps[0] > 1
        there = {
            "walk all": all(walks) and any(walks), "walk some": any(walks) and not all(walks), "jumps": self.jumps,
            "louder": louder, "quieter": self.steps and not louder, "outliers": self.outliers[0],
            self.input[0]: self.input[0] in ALONE, "rest": self.rest[0], "missing": self.missing[0],
        }  # fmt: skip
        return tuple(name for name in ALONE if there.get(name)) or ("nothing",)

    @property
    def rests(self) -> bool:
        """Whether its parameters never move."""
        return not self.jumps and not any(self.nvr)

    @property
    def about(self) -> str:
        """Return it in one line."""
        shape = f"regression({len(self.theta)})" if self.na < 0 else f"arx({self.na}; {','.join(map(str, self.nb))})"
        words = [f"{self.number}: {shape} sigma {self.sigma:.2g}, input {self.input[0]} {self.input[1]:.2g}"]
        if any(self.nvr):
            words.append("nvr " + " ".join(f"{v:.0e}" if v else "0" for v in self.nvr))
        words += [f"jump {size:.1f} of {','.join(map(str, who))}" for size, who in self.jumps]
        words += [f"noise x {step:.2g}" for step in self.steps]
        if self.outliers[0]:
            share, size = self.outliers
            words.append(f"outliers {100 * share:.1f} % of {size:.0f}" + " of the process" * self.of_process)
        if self.rest[0]:
            words.append(f"rest {self.rest[0]}" + " quiet" * self.rest[1])
        if self.missing[0]:
            words.append(f"missing {100 * self.missing[0]:.0f} % in runs of {self.missing[1]}")
        return ", ".join(words)


def changed(system: System, **what) -> System:
    """Return it with some fields replaced."""
    return System(**{**system.__dict__, **what})


def is_stable(a, radius: float = RADIUS) -> np.ndarray:
    """Say which polynomials 1 + a1/z + .. (last axis) have all roots within ``radius`` (Schur-Cohn, step down)."""
    a = np.asarray(a, float) / radius ** np.arange(1, np.shape(a)[-1] + 1)
    good = np.ones(a.shape[:-1], bool)
    with np.errstate(all="ignore"):
        while a.shape[-1]:
            k = a[..., -1:]
            good &= np.abs(k[..., 0]) < 1
            a = (a[..., :-1] - k * a[..., -2::-1]) / (1 - k * k)
    return good


def stays(system: System, theta) -> np.ndarray:
    """Say whether the plant of ``theta`` (.., n) is stable, by itself and in its loop."""
    if system.na < 1:
        return np.ones(np.shape(theta)[:-1], bool)
    a, (kind, gain) = theta[..., : system.na], system.input
    good = is_stable(a)
    if kind == "closed loop":
        b = theta[..., system.na : system.na + system.nb[0]]
        size = max(system.na, system.nb[0])
        looped = np.zeros((*np.shape(a)[:-1], size))
        looped[..., : system.na] += a
        looped[..., : system.nb[0]] += gain * b
        good = good & is_stable(looped)
    return good
