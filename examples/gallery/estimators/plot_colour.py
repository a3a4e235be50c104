"""
The colour of the noise decides: ARX, ARMAX, OE, BJ, instruments
================================================================

White noise on the sensor alone, and a plant of one pole. Least squares is biased there, however long the record.
**The answer** is the pole by each member of the family; **how sure**: two standard errors, of which ARX's are wrong,
and the run says so (its innovations are not white). **Others**: a plain recursive least squares from any library
gives the first row.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

y, u = dw.simulate([-0.8], [1.0], samples=4000, noise_std=1.0, noise="output", seed=1)
estimators = {
    "ARX, least squares": dw.ARX(1, 1),
    "ARX, instruments": dw.ARX(1, 1, method="iv"),
    "ARMAX": dw.ARMAX(1, 1, 1),
    "OE": dw.OE(1, 1),
    "BJ": dw.BJ(1, 1, 1, 1),
}
fig, ax = plt.subplots(figsize=(8, 3.5), layout="constrained")
for row, (name, est) in enumerate(estimators.items()):
    trace = est.scan(y, u)
    at = next(i for i, each in enumerate(trace.names) if each in ("a1", "f1"))
    pole, std = -trace.parameters[-1, at], trace.parameters_std[-1, at]
    is_white = all(verdict.is_fine for verdict in trace.diagnose() if verdict.name == "whiteness")
    print(f"{name:20s} pole {pole:.3f} ± {std:.3f}, innovations white: {is_white}")
    ax.errorbar(pole, -row, xerr=2 * std, fmt="o", color="C0" if is_white else "C3", capsize=3)
ax.axvline(0.8, color="k", ls="--", lw=1)
ax.set_yticks(-np.arange(len(estimators)), list(estimators))
ax.set(xlabel="pole, two standard errors; the truth is 0.8", title="Red: the run itself says that its model is wrong")
