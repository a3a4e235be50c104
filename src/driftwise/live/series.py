"""A series of a service: whose it is, how its messages are read, and where it stands on the way to a model."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field

import numpy as np

from ..engine.errors import InputError
from .config import SeriesConfig
from .decode import Chunk
from .join import Row, Waiting, join


@dataclass
class Series:
    """One key; `Roster` says what its number, slot, group and code are. It has a group once it has a model."""

    number: int
    key: str
    config: SeriesConfig
    slot: int
    group: int | None = None
    code: int = -1
    waiting: Waiting = field(default_factory=Waiting)
    samples: list[tuple[float, ...]] = field(default_factory=list)  # to choose a model by: time, output, inputs
    kept: int = 0  # of them, in the store
    held: tuple[float, ...] = ()  # inputs of the last row since the start
    is_asked: bool = False  # whether its model is being chosen
    is_plain: bool = field(init=False)  # nothing is waited for: a message with an output is a row

    def __post_init__(self):
        self.is_plain = not self.config.inputs and not self.config.lag

    @property
    def can_choose(self) -> bool:
        """Whether there are samples enough to choose a model, and nobody is at it."""
        return not self.is_asked and len(self.samples) >= self.config.identify

    @property
    def width(self) -> int:
        """How many numbers a sample has."""
        return 2 + len(self.config.inputs)

    def rows(self, chunk: Chunk) -> list[Row]:
        """Return the rows that can go on when a chunk has come."""
        config, fields = self.config, chunk.fields
        output = fields.get(config.output)
        if output is not None and (config.scale != 1.0 or config.offset != 0.0):
            output = [config.scale * value + config.offset for value in output]
        if self.is_plain and output is not None:
            return [Row(time, value, ()) for time, value in zip(chunk.time, output)]
        inputs = [fields.get(name) for name in config.inputs]
        if output is None and all(one is None for one in inputs):
            raise InputError(
                f"a message about {self.key} has neither the output {config.output!r} nor an input; it has "
                f"{', '.join(fields)}"
            )
        return join(self.waiting, config.clock, chunk.time, output, inputs)

    def waits(self) -> str:
        """Return what waits to be joined, as JSON."""
        return json.dumps(self.waiting.as_json())

    def more(self) -> bytes:
        """Return the samples that are not kept yet, and count them as kept."""
        rows = np.array(self.samples[self.kept :], float).reshape(-1, self.width)
        self.kept = len(self.samples)
        return np.column_stack([np.full(len(rows), self.width), rows]).tobytes()

    def restore(self, samples: bytes, waiting: str | None) -> None:
        """Go on from what was kept."""
        numbers = np.frombuffer(samples)
        if len(numbers) and numbers[0] == self.width:  # else it has other inputs now, and begins afresh
            rows = numbers.reshape(-1, 1 + self.width)[:, 1:]
            self.samples, self.kept = [tuple(row) for row in rows.tolist()], len(rows)
        if waiting:
            found = Waiting.of(json.loads(waiting))
            self.waiting = found if len(found.known) in (0, len(self.config.inputs)) else Waiting()


def arrays(samples: list[tuple[float, ...]]) -> tuple[np.ndarray, np.ndarray]:
    """Return outputs (T,) and inputs (T, k) of samples."""
    table = np.array(samples, float)
    return table[:, 1], table[:, 2:]


def keys_of(chunk: Chunk, config: SeriesConfig) -> list[Chunk]:
    """Return a chunk as its series see it: one whose fields are not named in the configuration is a series a field."""
    if config.output in chunk.fields or any(name in chunk.fields for name in config.inputs) or not chunk.fields:
        return [chunk]
    if config.inputs:
        return [chunk]
    if len(chunk.fields) == 1:
        return [chunk._replace(fields={config.output: next(iter(chunk.fields.values()))})]
    return [
        Chunk(f"{chunk.key}/{name}", list(chunk.time), {config.output: values})
        for name, values in chunk.fields.items()
        if not all(map(math.isnan, values))
    ]
