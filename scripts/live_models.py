"""How often `driftwise live` chooses a model again: where the plant became another one, and where it did not.

`python scripts/live_models.py [SEED [PLANTS]]`: of so many drawn plants of each kind, how often a model was asked for
again, stayed, or gave place to another, and the error of the last predictions, beside that of models that never change.
Kinds: plants that stay, whose gain jumps, whose noise becomes four times as loud, whose noise has outliers, and those
that become another plant (a resonance, or a longer memory).
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter

import numpy as np

from driftwise.cli.live import estimator_of
from driftwise.live.config import parse
from driftwise.live.core import Core
from driftwise.live.decode import Chunk
from driftwise.live.sources.base import Parcel
from driftwise.live.store.sqlite import SqliteStore

SAMPLES, CHANGE, CHUNK = 12_000, 3_000, 250
WORDS = "chosen again", "the model stays", "takes the place of"
KINDS = "stays", "gain", "louder", "outliers", "resonance", "longer"


def plant(kind: str, rng) -> tuple[np.ndarray, np.ndarray]:
    """Return outputs and inputs (SAMPLES,) of a drawn plant of a kind."""
    a, b = rng.uniform(0.5, 0.9), rng.uniform(0.5, 2.0)
    turned = rng.random(SAMPLES) < 0.05
    u = np.maximum.accumulate(np.where(turned, np.arange(SAMPLES), 0))
    u = rng.standard_normal(SAMPLES)[u]
    e = rng.uniform(0.05, 0.5) * rng.standard_normal(SAMPLES)
    if kind == "outliers":
        e *= np.where(rng.random(SAMPLES) < 0.02, 15.0, 1.0)
    radius, angle = rng.uniform(0.93, 0.98), rng.uniform(0.3, 1.0)
    far = rng.integers(3, 6)
    y = np.zeros(SAMPLES)
    for t in range(6, SAMPLES):
        is_after = t >= CHANGE
        if kind == "resonance" and is_after:
            y[t] = 2 * radius * np.cos(angle) * y[t - 1] - radius**2 * y[t - 2] + b * u[t - 1] + e[t]
        elif kind == "longer" and is_after:
            y[t] = 0.5 * y[t - 1] + 0.4 * y[t - far] + b * u[t - 1] + e[t]
        else:
            gain = 1.6 * b if kind == "gain" and is_after else b
            y[t] = a * y[t - 1] + gain * u[t - 1] + e[t] * (4.0 if kind == "louder" and is_after else 1.0)
    return y, u


def run(records: list[tuple[np.ndarray, np.ndarray]], is_fixed: bool) -> tuple[float, Counter[str]]:
    """Return the error of the last 3000 predictions of plants, and what was told of their models."""
    told: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        config = parse(f'[model]\ninputs = ["u"]\n[store]\npath = "{folder}"\n')
        core = Core(config, SqliteStore(folder), estimator_of)
        for first in range(0, SAMPLES, CHUNK):
            at = range(first, first + CHUNK)
            chunks = [
                Chunk(f"p{i}", [float(t) for t in at], {"value": y[at].tolist(), "u": u[at].tolist()})
                for i, (y, u) in enumerate(records)
            ]
            events = core.take([Parcel(chunks)], 1e9 + first)
            while (series := core.choosing.asking()) is not None:
                choice = core.choosing.choose(series)
                if is_fixed and series.group is not None:
                    choice = choice._replace(score=-np.inf)
                events += core.chosen(series, choice)
            told.update(next(word for word in WORDS if word in one.sentence) for one in events if one.kind == "model")
            core.commit()
        rows = np.concatenate([rows for _, rows in core.history.recent])
        core.store.close()
    last = rows[rows[:, 1] >= SAMPLES - 3000]
    return float(np.sqrt(np.mean((last[:, 2] - last[:, 3]) ** 2))), told


def main(seed: int, plants: int) -> None:
    """Print a table."""
    rng = np.random.default_rng(seed)
    print(f"{'of ' + str(plants):<12} {'asked':>6} {'stays':>6} {'another':>8} {'error':>8} {'of the first model':>19}")
    for kind in KINDS:
        records = [plant(kind, rng) for _ in range(plants)]
        (error, told), (before, _) = run(records, False), run(records, True)
        print(f"{kind:<12} {' '.join(f'{told[word]:>6}' for word in WORDS[:2])} {told[WORDS[2]]:>8} "
              f"{error:>8.4g} {before:>19.4g}", flush=True)  # fmt: skip


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:3]]
    main(*(numbers + [0, 10][len(numbers) :]))
