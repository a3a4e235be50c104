"""What a start from integrals is worth to the joint filter: a wide prior against the first four seconds, identified."""

from __future__ import annotations

import numpy as np

import driftwise as dw
from driftwise.estimators.algebraic_start.discrete import canonical
from driftwise.models.canonical import Canonical

from ..verdict import Estimate, Scaled, Section, Table, Verdict, short
from .second_order import THIS, Records, records

STEP, SAMPLES, FIRST, EARLY = 0.1, 200, 40, 50
NOISES = (0.005, 0.02, 0.1)
LISTED = {0.005: (2.3e-4, 9.7e-5), 0.02: (9.2e-4, 3.9e-4), 0.1: (4.5e-3, 2.1e-3)}  # started, after 5 and 20 s
KNOWN_BY = 200  # records, and other code
BATCH = {0.005: 8.9e-5, 0.02: 3.5e-4, 0.1: 1.8e-3}
NONE, STARTED, DEFAULT, TOLD = "wide prior", "start, B a constant", "start, any zeros", "least squares of 20 s"
STARTS = {NONE: None, STARTED: dw.estimators.AlgebraicStart(FIRST, zeros=0), DEFAULT: "algebraic"}


def filtered(given: Records, noise: float, start) -> np.ndarray:
    """Return the relative error of [a; b] after 5 and 20 s, (2, S); q is the coefficient of a second input, ones."""
    est = dw.Joint(2, inputs=2, noise=dw.models.OutputError(noise**2), dt=STEP, start=start)
    y, u = given.y + noise * given.noise, np.column_stack([given.u, np.ones(SAMPLES)])
    u = np.repeat(u[None], len(y), axis=0)
    early, _ = est.update_batch(est.start(len(y)), y[:, :EARLY], u[:, :EARLY])
    late, _ = est.update_batch(early, y[:, EARLY:], u[:, EARLY:])
    return np.array([relative(state["theta"][:, :4], given) for state in (early, late)])


def batch(given: Records, noise: float) -> np.ndarray:
    """Return the error of least squares over everything, (S,)."""
    theta = []
    for y in given.y + noise * given.noise:
        found = dw.estimators.algebraic_identification(y, given.u, order=2, zeros=0, dt=STEP, hold="zoh", disturbance=0)
        theta.append(found.discrete(STEP).values)
    return relative(np.array(theta), given)


def relative(theta, given: Records) -> np.ndarray:
    """Return |theta - truth| / |truth| of each record."""
    form = Canonical(2, 1)
    truth = np.array([canonical(form, np.array([*a, 0.0, b]), STEP, "zoh") for a, b in zip(given.a, given.b)])
    return np.linalg.norm(theta - truth, axis=1) / np.linalg.norm(truth, axis=1)


def section(seeds: int) -> Section:
    """The table of errors with and without a start, judged."""
    scaled, given = Scaled(seeds, 200), records(seeds, STEP, SAMPLES)
    found = {noise: {name: filtered(given, noise, start) for name, start in STARTS.items()} for noise in NOISES}
    whole = {noise: batch(given, noise) for noise in NOISES}
    rows = [
        [f"{noise:g}", *(" / ".join(short(float(np.median(e))) for e in found[noise][name]) for name in STARTS)]
        + [short(float(np.median(whole[noise])))]
        for noise in NOISES
    ]
    return Section(
        "A start for the joint filter",
        [
            "Plants of the same family at 10 Hz, measurement noise only; the filter estimates a1, a2, b1, b2 and, as a "
            "second input of ones, q. With a start it goes on from the least squares fit of its first 40 samples, "
            "which it has kept; no sample counts twice. That B is a constant is knowledge no sampled model can hold; "
            "it comes in through the start, and is worth a factor of two.",
        ],
        [Table(f"Median relative error of [a; b] after 5 / 20 s, {seeds} plants", ["σ", *STARTS, TOLD], rows)],
        verdicts=[*_listed(found), *_near_batch(found, whole, scaled), *_worth(found, scaled)],
    )


def _listed(found):
    for noise, listed in LISTED.items():
        got = Estimate.median(np.transpose(found[noise][STARTED]))
        expected = got.expected(listed, KNOWN_BY)
        yield Verdict(
            f"joint filter started from its first 4 s, σ = {noise:g}: error after 5 and 20 s",
            ", ".join(map(short, got.value)),
            f"{', '.join(f'{short(x)} + {short(r)}' for x, r in zip(listed, got.room(expected)))} or better (three "
            "standard errors of the difference)",
            got.is_at_most(expected),
            THIS,
        )


def _near_batch(found, whole, scaled):
    for noise in NOISES:
        got, best = (float(np.median(e)) for e in (found[noise][STARTED][1], whole[noise]))
        near = float(scaled.wide(0.18))
        yield Verdict(
            f"the same beside least squares of all 20 s, σ = {noise:g}",
            f"{got / best:.2f} times its error ({short(best)}; listed {short(BATCH[noise])})",
            f"at most {1 + near:.2f} times",
            bool(got <= (1 + near) * best),
            THIS,
        )


def _worth(found, scaled):
    for noise in NOISES:
        ratio = float(np.median(found[noise][NONE][0]) / np.median(found[noise][STARTED][0]))
        yield Verdict(
            f"what the start is worth after 5 s, σ = {noise:g}",
            f"errors {ratio:.1f} times smaller than from a wide prior",
            "at least 3 times",
            bool(ratio >= 3 / float(scaled.wide(1.0))),
            THIS,
        )
