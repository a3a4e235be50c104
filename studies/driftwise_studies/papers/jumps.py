"""A parameter that jumps: never forgetting, a random walk, and forgetting until a jump."""

from __future__ import annotations

from typing import Any

import numpy as np

import driftwise as dw
from driftwise.engine.status import JUMP as JUMPED

from .records import canonical, scan_all
from .verdict import Scaled, Section, Table, Verdict, numbers

SOURCE = "this package's study, beyond the paper"
BEFORE, AFTER = np.array([0.7, -1.5]), np.array([0.3, -0.7])
JUMP, T, R = 500, 1000, 0.09
WINDOWS = {"300–500": slice(300, JUMP), "500–560": slice(JUMP, 560), "560–1000": slice(560, T)}


def section(seeds: int) -> Section:
    """Let a jump from one plant to another at sample 500 of 1000 and watch the memories follow."""
    scaled = Scaled(seeds)
    records = scaled.records(100)
    y, u, truth = jumping_records(records)
    memories: dict[str, Any] = {
        "never": dw.Constant(),
        "walk, Q_π = 1e-5": dw.RandomWalk(1e-5),
        "walk, Q_π = 1e-4": dw.RandomWalk(1e-4),
        "until a jump (VarianceCUSUM), P_rr += I": dw.RestartOnChange(),
    }
    rows, errors = [], {}
    for name, memory in memories.items():
        est = dw.Joint(2, 1, noise=dw.models.EquationError(R), memory=memory, P0=100.0)
        e, _, _, parameters = scan_all(est, y, u)
        off = parameters[:, :, 1::-1] - truth  # a_0, a_1
        mse = [np.mean(e[:, w] ** 2) / R for w in WINDOWS.values()]
        errors[name] = [np.sqrt(np.mean(off[:, w] ** 2)) for w in WINDOWS.values()]
        rows.append([name, *(f"{v:.3g}" for v in mse), *(f"{v:.3f}" for v in errors[name])])
    head = ["memory", *(f"mse / R, {w}" for w in WINDOWS), *(f"error of a, {w}" for w in WINDOWS)]
    return Section(
        "Beyond the paper: a jump in a",
        [
            f"Order 2 with input, a jumps at sample {JUMP} from ({numbers(BEFORE, 1)}) to ({numbers(AFTER, 1)}), "
            f"{records} records."
        ],
        [Table("Prediction and parameters before, at and after the jump", head, rows)],
        [],
        [_walk(errors), *_until_jump(memories, y, u, errors, scaled)],
    )


def jumping_records(records):
    """Return y, u and a (T, 2) of plants whose a jumps at sample 500."""
    rng = np.random.default_rng(75)
    a = np.where(np.arange(T)[:, None] < JUMP, BEFORE, AFTER)
    u, v = rng.standard_normal((2, records, T))
    y, _ = canonical(a[:, None], np.zeros((records, T, 2)), np.sqrt(R) * v, b=np.array([0.5, 1.0]), u=u)
    return y, u, a


def _walk(errors):
    never, walk = errors["never"][2], errors["walk, Q_π = 1e-4"][2]
    return Verdict(
        "a random walk follows a jump that constant parameters do not",
        f"error of a after the jump {walk:.3f} against {never:.3f}",
        "at most a fifth; between the jumps it pays three times the error",
        bool(walk < never / 5),
        SOURCE,
    )


def _until_jump(memories, y, u, errors, scaled):
    """The detector's row: how soon it alarms, how often it should not have, how well a is known afterwards."""
    name = "until a jump (VarianceCUSUM), P_rr += I"
    est = dw.Joint(2, 1, noise=dw.models.EquationError(R), memory=memories[name], P0=100.0)
    alarms = np.array([(est.scan(y[i], u[i]).status & JUMPED) != 0 for i in range(len(y))])
    false, found = int(alarms[:, :JUMP].sum()), alarms[:, JUMP:]
    delay = np.where(found.any(axis=1), found.argmax(axis=1), T)
    after = errors[name][2]
    return [
        Verdict(
            "until a jump: delay, missed, false alarms, error of a (560–1000)",
            f"median delay {np.median(delay):.0f}, {int((~found.any(axis=1)).sum())} missed, {false} false in "
            f"{alarms[:, :JUMP].size} samples, {numbers([after])}",
            f"median delay ≤ 10, error ≤ {scaled.wide(0.03):.3f} (earlier study: a walk alone .044)",
            bool(np.median(delay) <= 10 and after <= scaled.wide(0.03)),
            SOURCE,
        ),
    ]
