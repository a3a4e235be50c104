"""Detectors and how alarms are counted, for tests."""

import numpy as np

from driftwise.engine import compile
from driftwise.engine.dispatch import flatten


def run_length(detector, alarms, seed=0, make=None, block=50_000):
    """Samples over alarms, as every alarm starts afresh; the relative standard error is alarms^-1/2."""
    rng, found, samples, state = np.random.default_rng(seed), 0, 0, None
    while found < alarms:
        z, slopes = make(rng, block) if make else (rng.standard_normal(block), None)
        outs = np.empty((1, block, 1))
        slopes = np.zeros((1, block, 0)) if slopes is None else slopes[None]
        state = np.zeros((1, detector.state_size(slopes.shape[2]))) if state is None else state
        compile.watcher(type(detector))(state, z[None], slopes, outs, flatten((detector,)))
        found, samples = found + np.count_nonzero(outs), samples + block
    return samples / found
