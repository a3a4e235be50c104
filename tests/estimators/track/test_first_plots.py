"""The first plots of a track: what goes straight is told sooner than what may go anywhere."""

import numpy as np

import driftwise as dw


def flights(seed, n=60, plots=15, scan=12.0, deviation=60.0):
    """Yield times, plots and the path of aircraft that go straight on."""
    rng = np.random.default_rng(seed)
    t = scan * np.arange(plots)
    for _ in range(n):
        way, speed = rng.uniform(0, 2 * np.pi), rng.uniform(80, 250)
        path = speed * t[:, None] * np.array([np.sin(way), np.cos(way)])
        yield t, path + deviation * rng.standard_normal(path.shape), path


def test_the_third_plot_of_straight_flight_is_forecast_near_the_line_of_two():
    off = []
    for t, y, path in flights(5):
        trace = dw.TrackEstimator("aircraft").scan(t, y)
        off.append(np.linalg.norm(trace.prediction[2] - path[2]) / np.linalg.norm(2 * y[1] - y[0] - path[2]))
    assert np.median(off) < 2.0  # 2.7 where those that forget a velocity begin beside constant velocity
