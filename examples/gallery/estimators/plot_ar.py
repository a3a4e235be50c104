"""
A series without inputs: AR, ARMA, and the Nile
===============================================

The yearly flow of the Nile at Aswan, 1871 to 1970. **The answer**: the level fell around 1899, when the first dam was
begun. **How sure**: one false alarm in a thousand years was allowed. **Others**: an AR model with a constant and no
memory makes the fall part of its noise, and its level wrong for all years.
"""

import matplotlib.pyplot as plt

import driftwise as dw

nile = dw.sample_data("nile")
year, flow = nile["year"], nile["flow"]
watching = dw.RestartOnChange(dw.detect.SelfStarting("1 per 1000", warm=15), settle=10)
trace = dw.AR(0, offset=True, memory=watching).scaled_to(flow).scan(flow)
constant = dw.AR(0, offset=True).scaled_to(flow).scan(flow)
for jump in trace.jumps():
    print(int(year[jump.sample]), jump.text)

level, std = trace.parameters[:, -1], trace.parameters_std[:, -1]
fig, ax = plt.subplots(figsize=(8, 3.8))
ax.plot(year, flow, ".-", color="0.6", lw=0.7, label="flow")
ax.fill_between(year, level - 2 * std, level + 2 * std, alpha=0.25, lw=0)
ax.plot(year, level, label="level, restarted at the alarm")
ax.plot(year, constant.parameters[:, -1], "C1--", lw=1, label="level, constant")
ax.set(xlabel="year", ylabel="1e8 m³ a year", ylim=(400, 1450), title="The Nile fell around 1899")
ax.legend(ncols=3)

# %%
# Is there more than a level? AR(1) and ARMA(1, 1) compete with it on the years after the fall.

after = flow[year >= 1900]
models = {"level": dw.AR(0, offset=True), "AR(1)": dw.AR(1, offset=True), "ARMA(1,1)": dw.ARMA(1, 1, offset=True)}
print(dw.compare(after, None, models))
