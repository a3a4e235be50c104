"""The DC motor of Tian (2009) as several test files observe it, and the golden cases of his paper."""

import json
import math
from pathlib import Path

import numpy as np

import driftwise as dw

GOLDEN = {c["name"]: c for c in json.loads((Path(__file__).parent / "golden" / "tian.json").read_text())["cases"]}
MOTOR = dw.Plant([[0, 1, 0], [0, 0, 0.2], [0, -10, -10]], [0, 0, 10], [1, 0, 0])
INTO = [0, 0, 5]
CONSTANT, COSINE = dw.models.Polynomial(INTO, np.inf), dw.models.Sinusoid(50.0, INTO, np.inf)
SIGMA = 0.015 / math.sqrt(3)
