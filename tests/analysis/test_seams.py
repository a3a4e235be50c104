"""Recordings one below the other: what changes from one to the next is no change of a plant."""

import numpy as np

import driftwise as dw


def lots(count, hours=300, seed=4):
    """Return a table of lots of cars one below the other, each as full and as restless as it is."""
    rng = np.random.default_rng(seed)
    names, stamps, cars = [], [], []
    for k in range(count):
        noise = (5.0, 40.0)[k % 2] * rng.standard_normal(hours)
        for t in range(1, hours):
            noise[t] += 0.9 * noise[t - 1]
        names += [f"lot {k:02d}"] * hours
        stamps.append(np.datetime64("2024-05-01T00:00") + np.arange(hours) * np.timedelta64(1, "h"))
        cars.append(500 + 300 * (k % 3) + noise)
    return {"lot": names, "time": np.concatenate(stamps), "cars": np.concatenate(cars)}


def test_what_changes_from_one_recording_to_the_next_is_not_told():
    found = dw.identify(lots(6))
    assert "'lot' names 6 recordings" in " ".join(found.notes)
    assert not found.changes and found.alarms == 0 and found.last is None
    del (table := lots(6))["lot"]  # without names it is one plant whose clock was put back
    assert dw.identify(table).changes


def test_a_recording_that_begins_when_the_last_one_ended_has_a_name_of_its_own():
    """Of thirty recordings the clock starts again at twenty-eight: one begins later than the one before ended."""
    table = lots(8, hours=60)
    table["time"][240:300] = table["time"][239] + np.arange(1, 61) * np.timedelta64(1, "h")
    found = dw.identify(table, output="cars")
    assert "'lot' names 8 recordings" in " ".join(found.notes)
