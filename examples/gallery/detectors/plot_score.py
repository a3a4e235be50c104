"""
Which parameter jumped, and which way? ScoreCUSUM
=================================================

A regressor with mean zero: when its coefficient jumps, the mean of the innovations does not move. **The answer**: the
parameter, the direction, the sample. **How sure**: one false alarm in ten thousand samples was allowed. **Others**: a
detector of the mean sees nothing here; one of the variance sees it late, and cannot name it.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, T = np.random.default_rng(1), 1000
slopes = rng.standard_normal((T, 2))
z = rng.standard_normal(T)
z[600:] -= 0.8 * slopes[600:, 1]
detectors = {
    "ScoreCUSUM": dw.detect.ScoreCUSUM("1 per 10_000"),
    "PageHinkley": dw.PageHinkley("1 per 10_000", jump=1.0),
    "VarianceCUSUM": dw.detect.VarianceCUSUM(false_alarms="1 per 10_000"),
}
for name, detector in detectors.items():
    print(f"{name}: {detector.scan(z, slopes) if name == 'ScoreCUSUM' else detector.scan(z)}")

fig, ax = plt.subplots(figsize=(8, 4))
for i, color in enumerate(("0.6", "C3")):
    ax.plot(np.cumsum(z * slopes[:, i]), color=color, label=f"sum of score of parameter {i}")
found = detectors["ScoreCUSUM"].scan(z, slopes)
ax.axvline(found.samples[0], color="k", lw=1, label=f"alarm: parameter {found.which[0]} down, dated {found.changes[0]}")
ax.axvline(600, color="k", ls="--", lw=1, label="truth")
ax.set(xlabel="sample", title="The score of a parameter drifts from the sample on at which it jumped")
ax.legend()
