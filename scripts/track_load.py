"""What following many aircraft costs: CPU per plot, share of one core, bytes of a track.

    python scripts/track_load.py [--tracks 1000] [--scan 4] [--scans 60] [--nameless]

Aircraft fly straight and turn in a square of 400 km. Plots are fed a tenth of a second at a time, as a live
receiver would; the first ten scans, in which tracks begin, are not counted.
"""

import argparse
import time

import numpy as np

import driftwise as dw
from driftwise.tracking.plots import plots


def traffic(tracks, scan, scans, seed=1):
    """Return time, number and position of every plot, in order of time; one in twenty is missed."""
    rng = np.random.default_rng(seed)
    speed, course = rng.uniform(100, 250, tracks), rng.uniform(0, 2 * np.pi, tracks)
    turn = np.radians(rng.choice([-2.0, 0, 0, 0, 2.0], (scans // 10 + 1, tracks)))
    place, phase = rng.uniform(-200e3, 200e3, (tracks, 2)), rng.uniform(0, scan, tracks)
    rows = []
    for k in range(scans):
        course = course + turn[k // 10] * scan
        place = place + (speed * scan)[:, None] * np.stack([np.sin(course), np.cos(course)], axis=1)
        seen = rng.random(tracks) > 0.05
        plot = place + 60 * rng.standard_normal((tracks, 2))
        rows.append(np.column_stack([k * scan + phase, np.arange(tracks), plot])[seen])
    table = np.concatenate(rows)
    return table[np.argsort(table[:, 0], kind="stable")]


def main():
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    options.add_argument("--tracks", type=int, default=1000)
    options.add_argument("--scan", type=float, default=4.0)
    options.add_argument("--scans", type=int, default=60)
    options.add_argument("--nameless", action="store_true", help="no plot has an address")
    asked = options.parse_args()
    table = traffic(asked.tracks, asked.scan, asked.scans)
    keys = np.array([f"{int(n):06X}" for n in table[:, 1]], object) if not asked.nameless else None
    data = plots(table[:, 0], table[:, 2:], key=keys, sensor="radar", origin=(48.0, 11.0))
    tracker, edges = dw.tracking.Tracker(), np.arange(0, asked.scan * (asked.scans + 1), 0.1)
    ends = np.searchsorted(data.time, edges)
    warm = int(np.searchsorted(edges, 10 * asked.scan))
    for k in range(len(edges) - 1):
        if k == warm:
            begin, cpu = ends[k], time.process_time()
        tracker.feed(data[ends[k] : ends[k + 1]])
    cpu, counted = time.process_time() - cpu, len(data) - begin
    seconds = asked.scan * (asked.scans - 10)
    live = list(tracker.targets.live.values())
    row = live[0].table
    print(
        f"{len(live)} tracks, a plot every {asked.scan:g} s: {1e6 * cpu / counted:.0f} us of CPU for each plot, all in"
    )
    print(
        f"{100 * cpu / seconds:.2f} % of one core; {live[0].state.nbytes} bytes a state, {row[0].nbytes} bytes a plot"
    )
    print(f"{len(tracker.tracks)} tracks confirmed; {tracker.counts}")
    of = dict(zip(table[:, 0], table[:, 1]))
    mixed = sum(len({of[t] for t in track.plots.time}) > 1 for track in tracker.tracks)
    print(f"{mixed} tracks have plots of several aircraft")


if __name__ == "__main__":
    main()
