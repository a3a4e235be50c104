"""
The best forecast, and not one model: ModelAverage
==================================================

Which order, which memory? Nobody knows, and it changes on the way. **The answer**: one forecast from all, as good as
the best of them at every time. **How sure**: the density is honest about its tails; NIS near one says so. **Others**:
choosing a model on the first half is wrong in the second.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

a = [[-1.5, 0.7]] * 1000 + [[-1.2, 0.5]] * 1000
y, u = dw.simulate(a, [1.0, 0.5], samples=2000, noise_std=0.3, seed=1)
members = {
    "ARX(1,1)": dw.ARX(1, 1),
    "ARX(2,2)": dw.ARX(2, 2),
    "ARX(2,2), forgetting": dw.ARX(2, 2, memory=dw.ExponentialForgetting(0.98)),
}
average = dw.ModelAverage(list(members.values()), names=list(members)).scaled_to(y, u)
trace = average.scan(y, u)

fig, ax = plt.subplots(figsize=(8, 3.8))
for name, est in {**members, "average": None}.items():
    each = trace if est is None else est.scaled_to(y, u).scan(y, u)
    lost = np.cumsum(np.nan_to_num(each.innovation[50:]) ** 2)
    print(f"{name}: RMS of the innovations {np.sqrt(lost[-1] / len(lost)):.3f}")
    if est is not None:
        ax.plot(np.arange(50, 2000), lost, label=name)
    else:
        ax.plot(np.arange(50, 2000), lost, "k", lw=2, label="average of all")
ax.set(xlabel="sample", ylabel="squared errors so far", title="The plant changes at 1000", ylim=(0, 1000))
ax.legend()
print(f"NIS of the average {trace.nis(100):.2f}; leader at the end: {trace.leader}")
