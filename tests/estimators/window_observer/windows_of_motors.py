"""Windows of a motor, for tests."""

import numpy as np
from paper_motor import CONSTANT, COSINE, MOTOR, SIGMA

import driftwise as dw

INF, FS = np.inf, 1e-3
SILENT = MOTOR._replace(B=None)  # what the input does is taken off the samples: 24 sin t is no straight line
SOFT = (CONSTANT._replace(prior_std=2.0), COSINE._replace(prior_std=2.0))


def observed(window, disturbances, plant=SILENT, **options):
    return dw.WindowObserver(plant, window, disturbances=disturbances, noise_std=SIGMA, dt=FS, **options)
