"""After a jump: which parameter no longer fits, told from the samples that follow."""

from __future__ import annotations

import numpy as np

from ..detect.score_statistic import ScoreTest, score_test
from ..engine.errors import InputError
from ..estimators.arx.forecast import STEP
from ..memory.constant import Constant


def what_changed(trace, sample: int, samples: int) -> ScoreTest:
    """Return how well the parameters from before ``sample`` fit the samples from there on: `Trace.what_changed`.

    The estimator runs on with its parameters held; its innovations move with each of them by minus their slope.
    """
    est = trace.estimator
    if not est.tells_what_changed:
        raise InputError("what_changed() is for ARX, Regression, ARMAX and their kin with method 'ls', 'rpem' or 'plr'")
    before = trace.state_before(sample)
    held = est.replace(memory=Constant(), gate=None)
    y, u = trace.y[sample : sample + samples], trace.u[sample : sample + samples] if trace.u.shape[1] else None

    def innovations(theta):
        state = held.start()
        for name in state.dtype.names or ():
            if state[name].shape == before[name].shape:
                state[name] = before[name]
        state["theta"], state["D"] = theta, 0.0
        return held.scan(y, u, state=state, keep="innovations").innovation

    theta = est.mean(before)
    steps = np.diag(STEP * np.sqrt(est._theta_units()))
    slopes = [(innovations(theta - h) - innovations(theta + h)) / (2 * h.sum()) for h in steps]
    variance = est.sigma2(before) * est.policies[1].R
    return score_test(np.stack(slopes, axis=1), innovations(theta), variance, trace.names)
