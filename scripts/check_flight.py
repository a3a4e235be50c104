"""Print what plain least squares finds in the shipped flight, turn by turn: python scripts/check_flight.py

track(t+1) = -a1 track(t) + b1 roll(t) + offset, where all three cells are filled: the table of docs/data.md.
"""

import numpy as np

import driftwise as dw

TURNS = [(180, 318), (330, 448), (610, 708), (1830, 1998), (2380, 2440)]


def least_squares(x, y):
    """Return coefficients, their standard deviations and that of the residual."""
    theta, _, _, _ = np.linalg.lstsq(x, y, rcond=None)
    rest = y - x @ theta
    variance = rest @ rest / (len(y) - x.shape[1])
    return theta, np.sqrt(variance * np.diag(np.linalg.inv(x.T @ x))), np.sqrt(variance)


flight = dw.sample_data("flight")
time, track, roll, speed = (flight[k] for k in ("time_s", "track_deg", "roll_deg", "ground_speed_mps"))
print("window, s    rows   a1                 b1               2 g / V, roll-weighted   residual, deg")
for low, high in TURNS:
    k = np.flatnonzero((time >= low) & (time < high))
    k = k[np.isfinite(track[k]) & np.isfinite(track[k + 1]) & np.isfinite(roll[k])]
    x = np.c_[-track[k] + track[k].mean(), roll[k], np.ones(len(k))]
    theta, std, residual = least_squares(x, track[k + 1] - track[k].mean())
    weight = (roll[k] - np.median(roll[k])) ** 2 * np.isfinite(speed[k])
    physics = np.sum(weight * 2 * 9.80665 / np.where(np.isfinite(speed[k]), speed[k], 1)) / weight.sum()
    print(
        f"{low:4d}-{high:4d}    {len(k):4d}   {theta[0]:.4f} +- {std[0]:.4f}   {theta[1]:.3f} +- {std[1]:.3f}"
        f"   {physics:.3f}                    {residual:.2f}"
    )
k = np.flatnonzero(np.isfinite(flight["altitude_m"][:-1] + flight["altitude_m"][1:] + flight["vertical_rate_mps"][:-1]))
h = flight["altitude_m"]
theta, std, residual = least_squares(np.c_[h[k], flight["vertical_rate_mps"][k]], h[k + 1])
print(f"altitude: {theta[0]:.5f} +- {std[0]:.5f}, {theta[1]:.3f} +- {std[1]:.3f}; {len(k)} of {len(h) - 1} steps")
