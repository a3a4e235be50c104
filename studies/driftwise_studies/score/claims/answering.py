"""A hidden fault that moves the output and columns beside it: how often it is told where these are taken as inputs.

Run: python -m driftwise_studies.score.claims.answering [--records 12] [--seed 0]

"Fault": an output and two to four columns, each a level and noise of the first order, of their own. For a fifth to a
third of the record something that nobody measures moves all of them, by two to six deviations, within 1 to 60
samples, the columns up to five samples after the output. "Inputs step": the same columns move the same way, but are
inputs, and the output answers to them and to nothing else: nothing in the plant changed. "Noisy sensors": the same,
but the small moves are the sensors' and do nothing. "Steady": the columns of a fault, without it. Told is a fault of
which a change of any kind is dated within sixty samples of where it begins.

"Small moves do nothing" counts the records whose response promises more of the inputs' small moves than the output
shows (`small_moves`): of a fault the columns' noise should do something, and does not.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter, medfilt

from driftwise.analysis.segmentation import Hindsight, hindsight

from .command import show

KINDS = FAULT, INPUTS, SENSORS, STEADY = "fault", "inputs step", "noisy sensors", "steady"
NEAR = 60  # samples from its beginning within which a fault is told
WIDE, FAR = 61, 2.5  # samples of the median that small moves are from; deviations below one that count


def coloured(rng, T: int, phi: float) -> np.ndarray:
    """Return noise of the first order, (T,), of deviation one."""
    return lfilter([np.sqrt(1 - phi**2)], [1, -phi], rng.standard_normal(T + 200))[200:]


def answering(seed: int, number: int, kind: str) -> tuple[np.ndarray, np.ndarray, int]:
    """Return y (T,), u (T, k), and the sample at which all begin to move."""
    rng = np.random.default_rng([seed, number, 31])
    T, k = int(rng.integers(600, 1200)), int(rng.integers(2, 5))
    if kind == STEADY:
        T = 2000
    length = int(T * rng.uniform(0.2, 0.33))
    first = int(T * rng.uniform(0.35, 0.6))
    lasts = float(np.exp(rng.uniform(0, np.log(60))))
    t = np.arange(T)
    moved = np.clip((t - first) / lasts, 0, 1) - np.clip((t - first - length) / lasts, 0, 1)
    if kind == STEADY:
        moved[:] = 0.0
    sizes = rng.uniform(2, 6, 1 + k) * rng.choice([-1.0, 1.0], 1 + k)
    late, phi = rng.integers(0, 6, k), rng.uniform(0, 0.7, 1 + k)
    steps = np.column_stack([size * np.append(np.zeros(n), moved[: T - n]) for size, n in zip(sizes[1:], late)])
    u = np.column_stack([coloured(rng, T, p) for p in phi[1:]]) + steps
    y = coloured(rng, T, phi[0])
    if kind in (INPUTS, SENSORS):
        pole, gains = rng.uniform(0.3, 0.9), rng.uniform(0.3, 1.5, k)
        return y + lfilter([0, 1 - pole], [1, -pole], (u if kind == INPUTS else steps) @ gains), u, first
    return y + sizes[0] * moved, u, first


def told(kind: str, found: Hindsight | None, first: int) -> tuple[bool, int]:
    """Return whether the fault is told, and how many changes are none of a fault's."""
    dates = [jump.at for jump in found.jumps()] if found else []
    return (any(abs(at - first) <= NEAR for at in dates), 0) if kind == FAULT else (False, len(dates))


def small_moves(found: Hindsight) -> tuple[float, float]:
    """Return the part of what small moves of the inputs are said to do that they do, and its deviation.

    What a response says of its inputs is split into its median over `WIDE` samples and the rest; both are whitened as
    the response is, and regressed on beside each other.
    """
    now = found.response
    said = sum(lfilter([1.0], now.denominator, now.driven(i, now.moved(i))) for i in range(len(now.b)))
    slow = medfilt(said, WIDE)
    X = (now.whitened(np.vstack([slow - slow.mean(), said - slow])) * now.weight).T
    left = now.left * now.weight
    more = np.linalg.lstsq(X, left, rcond=None)[0]
    variance = np.linalg.pinv(X.T @ X)[1, 1] * np.mean((left - X @ more) ** 2)
    return float(1 + more[1]), float(np.sqrt(variance))


def do_nothing(found: Hindsight | None) -> bool:
    """Say whether small moves do clearly less than they are said to."""
    if found is None or not len(found.response.b):
        return False
    part, deviation = small_moves(found)
    return part + FAR * deviation < 1


def table(seed: int, records: int) -> str:
    """Return the faults that are told and the changes that are none, as a table of Markdown."""
    rows = [
        "| columns | records | faults told | changes that are none | small moves do nothing |",
        "| --- | --- | --- | --- | --- |",
    ]
    for kind in KINDS:
        seen = list[tuple[bool, int, bool]]()
        for number in range(records):
            y, u, first = answering(seed, number, kind)
            found = hindsight(y, u)
            seen.append((*told(kind, found, first), do_nothing(found)))
        faults, false, less = (sum(column) for column in zip(*seen))
        counts = (f"{faults}", "") if kind == FAULT else ("", f"{false}")
        rows.append(f"| {kind} | {records} | {counts[0]} | {counts[1]} | {less} |")
    return "\n".join(rows)


if __name__ == "__main__":
    show(table, __doc__, 12)
