"""Range and azimuth on the earth, and their errors: against arithmetic of many digits and simulation."""

import mpmath
import numpy as np
import pytest

from driftwise.tracking.frames import MAJOR, SQUARE, east_north, ecef
from driftwise.tracking.polar import COUNTS, MEAN, axes, geodetic, ground_range, linear_covariance, place, unbiased


def test_ground_range_is_the_triangle_of_earth_radar_and_object():
    """Law of cosines with 40 digits; the textbook form in floats would lose metres near the radar."""
    with mpmath.workdps(40):
        for slant, h, site in [(5e3, 3e3, 500.0), (20e3, 10e3, 0.0), (400e3, 12e3, 2500.0), (1e3, 0.0, 0.0)]:
            a, b = mpmath.mpf(MEAN) + site, mpmath.mpf(MEAN) + h
            exact = mpmath.mpf(MEAN) * mpmath.acos((a**2 + b**2 - mpmath.mpf(slant) ** 2) / (2 * a * b))
            assert abs(ground_range(slant, h, site) - exact) < 1e-7
    near = ground_range(2e3, 1e3)
    assert near == pytest.approx(np.sqrt(2e3**2 - 1e3**2), rel=2e-4)  # flat
    assert ground_range(1e3, 2e3) == 0.0  # nearer than it is high: overhead


def test_geodetic_undoes_ecef_with_many_digits():
    with mpmath.workdps(30):
        for phi, lam, h in [(0.3, 2.0, 9000.0), (-1.5, -3.0, -400.0), (np.pi / 2, 0.0, 12e3), (0.0, 0.0, 4e5)]:
            N = mpmath.mpf(MAJOR) / mpmath.sqrt(1 - mpmath.mpf(SQUARE) * mpmath.sin(phi) ** 2)
            x = (N + h) * mpmath.cos(phi) * mpmath.cos(lam), (N + h) * mpmath.cos(phi) * mpmath.sin(lam)
            point = [float(v) for v in (*x, (N * (1 - mpmath.mpf(SQUARE)) + h) * mpmath.sin(phi))]
            got = geodetic(point)
            assert abs(got[0] - phi) < 1e-13 and abs(got[2] - h) < 1e-6
            assert abs(phi) > 1.57 or abs(got[1] - lam) < 1e-13


def test_place_undoes_a_line_of_sight():
    """Objects all around radars, from 3 to 470 km: where they were put is where they are found."""
    rng = np.random.default_rng(5)
    for latitude, longitude, height in [(46.2, 15.1, 800.0), (-78.0, -179.9, 30.0), (0.0, 90.0, 3000.0)]:
        phi, lam = np.radians((latitude, longitude))
        far = rng.uniform(0.0003, 0.07, 200)
        bearing = rng.uniform(0, 2 * np.pi, 200)
        lat, lon = phi + far * np.cos(bearing), lam + far * np.sin(bearing) / np.cos(phi)
        altitude = rng.uniform(0, 15e3, 200)
        line = ecef(lat, lon, altitude) - ecef(phi, lam, height)
        east, north, _ = axes(phi, lam)
        slant, azimuth = np.linalg.norm(line, axis=1), np.arctan2(line @ east, line @ north)
        found = np.degrees(place(slant, azimuth, altitude, phi, lam, height)).T
        miss = east_north(*found.T, (latitude, longitude)) - east_north(*np.degrees((lat, lon)), (latitude, longitude))
        assert np.abs(miss).max() < 1e-3  # m
    # without the earth's curvature an object 370 km away and 10 km high would be 600 m out, at its slant range 700 m
    found = np.degrees(place(370e3, 0.0, 10e3, *np.radians((46.0, 15.0))))
    y = east_north(found[:1], found[1:], (46.0, 15.0))[0, 1]
    assert 370e3 - 1200 < y < 370e3 - 300


def test_a_radar_right_below_an_aircraft():
    latitude, longitude = place(np.array([9e3, 10e3]), 1.0, 10e3, *np.radians((46.0, 15.0)))
    assert np.degrees(latitude) == pytest.approx([46.0, 46.0], abs=1e-3) and np.isfinite(longitude).all()


def test_covariance_lies_along_the_line_of_sight():
    R = linear_covariance(np.array([100e3, 100e3]), np.radians([0.0, 90.0]), 50.0, 0.002)
    assert R[0] == pytest.approx(np.diag([200.0**2, 50.0**2]), abs=1e-6) and R[1] == pytest.approx(
        np.diag([50.0**2, 200.0**2]), abs=1e-6
    )
    R = linear_covariance(100e3, np.radians(45.0), 50.0, 0.002)
    assert R[0, 1] == pytest.approx((50.0**2 - 200.0**2) / 2)


@pytest.mark.parametrize("azimuth_sd, counts", [(0.12, True), (0.002, False)])
def test_the_unbiased_conversion_is_unbiased_and_counts_where_its_criterion_says(azimuth_sd, counts):
    """Wide beam far away: criterion 14.4; narrow beam: 0.004. Half a million measurements of one object."""
    rng = np.random.default_rng(1)
    rho, theta, sd, n = 100e3, 0.6, 100.0, 500_000
    assert (rho * azimuth_sd**2 / sd > COUNTS) is counts
    measured = rho + sd * rng.normal(size=n), theta + azimuth_sd * rng.normal(size=n)
    truth = rho * np.array([np.sin(theta), np.cos(theta)])
    plain = np.stack([measured[0] * np.sin(measured[1]), measured[0] * np.cos(measured[1])], axis=1) - truth
    position, R = unbiased(*measured, sd, azimuth_sd)
    error = position - truth
    standard = error.std(axis=0) / np.sqrt(n)
    assert (np.abs(error.mean(axis=0)) < 4 * standard).all()
    biased = np.abs(plain.mean(axis=0)) / (plain.std(axis=0) / np.sqrt(n))
    assert bool(biased.max() > 20) is counts
    # the covariance promised, averaged over measurements, is that of the errors
    assert R.mean(axis=0) == pytest.approx(np.cov(error.T), rel=5 * azimuth_sd**2 + 0.01, abs=1e-2 * np.abs(R).mean())
    linear = linear_covariance(*measured, sd, azimuth_sd)
    nis = [np.einsum("ti,tij,tj->t", e, np.linalg.inv(c), e).mean() / 2 for e, c in ((error, R), (plain, linear))]
    assert nis[0] == pytest.approx(1, abs=0.1)
    assert bool(nis[1] > 1.3) is counts
