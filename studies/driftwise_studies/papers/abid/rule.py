"""Section 5: what the fuzzy rule hears, what it can do, and that the compiled memories are the plain ones."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

import driftwise as dw

from ..verdict import Scaled, Section, Verdict, short
from . import claims, plain
from .example import OURS, PAPER, SKIP
from .systems import System, system

Y_UNIT, U_UNIT = 1e3, 1e-2


def section(seeds: int) -> Section:
    """Increments, the floor of the rule, its bounds, units, and this package's two memories."""
    scaled = Scaled(seeds, 400)
    s = system("a", scaled.records(50, 8))
    path = plain.follow(s, plain.Known(s.q))
    return Section(
        "The fuzzy rule",
        [
            "Table 1 has equal rows for a positive and a negative step, so it is a table of two inputs of two values "
            "each. Steps carry nothing per parameter; and with a perfectly tuned filter one innovation in six is still "
            'partly "large", so that the rule never becomes least squares. It cannot run away either: q lies between '
            "the first and the last level, and P between those of two plain filters.",
        ],
        verdicts=[_increments(path), _floor(path, scaled), _sandwich(s), _units(s), *_same(s)],
    )


def _increments(path):
    """|K e| over its deviation, for each parameter whose variance the sample changed visibly."""
    less = (path.variance - path.filtered_variance)[:, SKIP:]
    step = (path.filtered - path.theta)[:, SKIP:]
    ratio = np.abs(step) / np.sqrt(np.where(less > 0, less, np.nan))
    clear = less > 1e-4 * path.variance[:, SKIP:]
    one = np.sqrt(path.nis[:, SKIP:])[..., None]
    off = float(np.nanmax(np.where(clear, np.abs(ratio - one) / one, np.nan)))
    return Verdict(
        "steps over their standard deviations are the same number for all parameters, |ε|/√S",
        f"largest relative difference {short(off)}, over {clear.sum()} steps",
        "below 1e-8",
        off < 1e-8,
        f"{PAPER} 5",
        claims.INCREMENT,
    )


def _floor(path, scaled):
    degree = float(np.clip((np.sqrt(path.nis[:, SKIP:]) - 1) / 2, 0, 1).mean())
    near = float(scaled.wide(0.004))
    return Verdict(
        'the rule\'s floor: how far ε is "large" on average when all is well',
        f"{degree:.3f}, so the mean NVR is at least {degree * 1e-2 + (1 - degree) * 1e-4:.1e}",
        f".083 ± {near:.3f}, 9e-4",
        abs(degree - 0.083) <= near,
        OURS,
    )


def compiled(s: System, memory, P0=1000.0):
    """Return this package's regression on the rows of a system, told its variance."""
    return dw.Regression(s.psi.shape[2], memory=memory, variance=s.told, P0=P0)


def _sandwich(s):
    """P of the rule between those of the slowest and of the fastest level, sample by sample."""
    first, _, last = dw.memory.FuzzyDrift().levels
    memories = (dw.memory.Drift(s.phi, nvr=first), dw.memory.FuzzyDrift(phi=s.phi), dw.memory.Drift(s.phi, nvr=last))
    worst = np.inf
    for y, psi in zip(s.y, s.psi):
        P = [compiled(s, memory).scan(y, psi, keep="covariance").covariance for memory in memories]
        worst = min(worst, *(np.linalg.eigvalsh(b - a).min() for a, b in pairwise(P)))
    return Verdict(
        "P of the fuzzy rule lies between those of its slowest and its fastest level (Loewner)",
        f"smallest eigenvalue of the differences {worst:.0e}, {s.y.size} samples",
        "at least −1e-9",
        bool(worst >= -1e-9),
        OURS,
    )


def _units(s):
    """The same records with y a thousand times, u a hundredth: b and its prior change units, nothing else does."""
    size = np.array([1.0, 1.0, Y_UNIT / U_UNIT, Y_UNIT / U_UNIT])
    psi = s.psi * np.array([Y_UNIT, Y_UNIT, U_UNIT, U_UNIT])
    other = replace(s, y=Y_UNIT * s.y, psi=psi, theta=size * s.theta, told=Y_UNIT**2 * s.told)
    off = 0.0
    for i in range(len(s.y)):
        a = compiled(s, dw.memory.FuzzyDrift(phi=s.phi)).scan(s.y[i], s.psi[i])
        b = compiled(other, dw.memory.FuzzyDrift(phi=s.phi), P0=1000 * size**2).scan(other.y[i], other.psi[i])
        spread = np.abs(a.parameters).max(axis=0)
        off = max(off, float((np.abs(b.parameters / size - a.parameters) / spread).max()))
    return Verdict(
        "other units of y and u change nothing",
        f"largest relative difference of a parameter {short(off)}",
        "below 1e-9",
        off < 1e-9,
        OURS,
    )


def _same(s):
    """This package's memories beside the plain ones of `plain`."""
    few = system("a", 4)
    pairs = {
        "FuzzyDrift(as_published=True)": (dw.memory.FuzzyDrift(as_published=True, phi=few.phi), plain.Fuzzy()),
        "AuxiliaryFilter": (dw.memory.AuxiliaryFilter(phi=few.phi), plain.Auxiliary()),
    }
    for name, (memory, rule) in pairs.items():
        mine = np.array([compiled(few, memory).scan(y, psi).innovation for y, psi in zip(few.y, few.psi)])
        off = float(np.abs(mine - plain.follow(few, rule).e).max())
        yield Verdict(
            f"this package's {name} is the plain one of this page",
            f"largest difference of an innovation {short(off)}",
            "below 1e-8",
            off < 1e-8,
            OURS,
        )
