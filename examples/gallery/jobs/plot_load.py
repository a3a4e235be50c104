"""
Load forecast with weather and holidays
=======================================

The hourly load of a town: hours of the day, temperature, holidays, and habits that drift. **The answer**: the next
day, hour by hour. **How sure**: the band from what each coefficient is known by; its coverage is printed. **Others**:
the same hour of the day before, which every forecaster should beat, and does not beat on holidays.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwise as dw

rng, days = np.random.default_rng(5), 240
hour = np.arange(24 * days)
day, angle = hour // 24, 2 * np.pi * hour / 24
temperature = (
    8
    + 10 * np.sin(2 * np.pi * hour / (24 * 365))
    + 4 * np.sin(angle - 2)
    + np.repeat(3 * rng.standard_normal(days), 24)
)
is_free = np.isin(day % 7, (5, 6)) | np.isin(day, (30, 31, 100, 170, 171, 234))
heating = np.maximum(15 - temperature, 0)
habit = 60 + 0.03 * day
noise = np.zeros(len(hour))
for k in range(1, len(hour)):
    noise[k] = 0.7 * noise[k - 1] + 0.8 * rng.standard_normal()
load = habit + 12 * np.sin(angle - 1.5) + 5 * np.sin(2 * angle) + 0.9 * heating - 9 * is_free + noise

waves = {f"{name}{n}": f(n * angle) for n in (1, 2) for name, f in (("sin", np.sin), ("cos", np.cos))}
columns = {**waves, "heating": heating, "holiday": is_free.astype(float)}
phi = np.stack(list(columns.values()), axis=1)
disturbance = dw.models.Disturbance(0.7)
est = dw.Regression(list(columns), offset=True, memory=dw.AutoMemory(), disturbance=disturbance).scaled_to(load, phi)

# %%
# At midnight of each day the next 24 hours are unknown: NaN in y, what the calendar and the weather service say in phi.

state = est.scan(load[: 24 * 60], phi[: 24 * 60]).state
forecast, band = [], []
for d in range(60, days):
    part = slice(24 * d, 24 * d + 24)
    ahead = est.scan(np.full(24, np.nan), phi[part], state=state)
    forecast.append(ahead.prediction)
    band.append(ahead.band(0.95))
    state = est.scan(load[part], phi[part], state=state).state
forecast, band = np.concatenate(forecast), np.concatenate(band)
truth, before = load[24 * 60 :], load[24 * 59 : -24]
for name, error in {"driftwise": forecast - truth, "the day before": before - truth}.items():
    print(f"{name}: mean absolute error {np.mean(np.abs(error)):.2f} MW")
print(f"{100 * np.mean(np.abs(forecast - truth) < band):.0f} % of the hours in their 95 % band")
fig, ax = plt.subplots(figsize=(8, 4))
last = slice(-24 * 9, None)
x = hour[24 * 60 :][last] / 24
ax.fill_between(x, (forecast - band)[last], (forecast + band)[last], alpha=0.25, lw=0, label="95 %")
ax.plot(x, forecast[last], label="forecast at midnight")
ax.plot(x, truth[last], "k", lw=0.8, label="load")
ax.plot(x, before[last], ":", color="C1", lw=1, label="the day before")
ax.set(xlabel="day", ylabel="MW", title="Nine days, each forecast at its midnight; day 234 is a holiday")
ax.legend(fontsize=8, ncols=2)
