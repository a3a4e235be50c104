"""Which estimator a series gets: as its words say, or as its first samples say."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .config import ModelConfig

Made = tuple[str, Callable[[], Any]]  # words for a model, and what makes its estimator


class Models:
    """Reads words of models, and chooses one where they are "auto"; ``estimator_of`` is how the command line does."""

    def __init__(self, estimator_of: Callable[[ModelConfig], Any]):
        self.estimator_of = estimator_of

    def named(self, config: ModelConfig) -> Made:
        """Return the model that is named."""
        jumps = f", jumps {config.jumps}" if config.jumps else ""
        return f"{config.model} with {config.memory} memory{jumps}", lambda: self.estimator_of(config)

    def chosen(self, config: ModelConfig, y: np.ndarray, u: np.ndarray) -> Made:
        """Return the model that samples choose: the simplest of those that predict them best (`Identifier`)."""
        from ..analysis.identifier import Identifier

        identifier = Identifier(u.shape[1], config.dt or 1.0)
        identifier.add(y, u if u.shape[1] else None)
        candidate = identifier.chosen.candidate
        return f"{candidate.name}, chosen by {len(y)} samples", lambda: candidate.best
