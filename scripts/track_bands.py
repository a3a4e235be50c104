"""Print the tables of docs/tracking.md on motion: do the bands of velocity, course and turn rate hold what they say?

Simulated flights, where the truth is known, and two recordings with a truth of their own: boats with a satellite
receiver, and a departing aircraft that tells its velocity.

Run: python scripts/track_bands.py (one minute; DRIFTWISE_DATA names the folder of recordings).
"""

import json

import numpy as np
from driftwise_studies.papers import recordings
from driftwise_studies.score import records, tracks

import driftwise as dw

KNOT = 1852 / 3600
FIRST, CHANGE = 20, 5  # plots to start with; plots within which a change of motion can hardly be known
SAID = ("velocity", "speed", "course", "turn rate", "acceleration")
FLIGHTS = {  # speed m/s, noise m, period s, and per manoeuvre (turn rate deg/s, acceleration m/s^2, seconds)
    f"aircraft, {noise} m, {period} s": (200.0, noise, period, [(1, 0, 180), (2, 0, 90), (3, 0, 60), (0, 1.5, 60)])
    for period in (1.0, 4.0, 12.0)
    for noise in (10.0, 50.0, 150.0)
} | {
    "helicopter, 10 m, 1 s": (50.0, 10.0, 1.0, [(3, 0, 60), (0, 1.0, 30)]),
    "glider, 10 m, 4 s": (30.0, 10.0, 4.0, [(3, 0, 120), (15, 0, 240), (0, 0.5, 30)]),
    "uav, 1 m, 1 s": (15.0, 1.0, 1.0, [(5, 0, 36), (20, 0, 36), (0, 1.0, 10)]),
    "boat, 2 m, 1.68 s": (4.0, 2.0, 1.68, [(3, 0, 60), (6, 0, 30), (0, 0.1, 30)]),
}


def flight(time, speed, turn, gain, begins, lasts):
    """Return position, velocity, acceleration (T, 2) and turn rate (T,): straight, a manoeuvre, straight."""
    fine = np.linspace(0, time[-1], int(np.ceil(time[-1] / 0.01)) + 1)
    on = (fine >= begins) & (fine < begins + lasts)
    s = np.clip(fine - begins, 0, lasts)
    fast, course = speed + gain * s, np.radians(30 + turn * s)
    v = fast[:, None] * np.stack([np.sin(course), np.cos(course)], axis=1)
    omega = np.radians(turn) * on
    a = (gain * on / fast)[:, None] * v + omega[:, None] * np.stack([v[:, 1], -v[:, 0]], axis=1)
    x = np.concatenate([np.zeros((1, 2)), np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(fine)[:, None], axis=0)])
    at = np.searchsorted(fine, time - 1e-9)
    return x[at], v[at], a[at], omega[at]


def held(trace, v, a=None, omega=None, extra=0.0):
    """Return by name which plots hold the truth in the 95 % band, a column each; ``extra`` sd of the truth, m/s."""
    z, speed = 1.96, np.hypot(*v.T)
    course = (trace.course - np.degrees(np.arctan2(*v.T)) + 180) % 360 - 180
    found = {
        "velocity": (abs(trace.velocity - v) <= z * np.hypot(trace.velocity_sd, extra)).mean(axis=1),
        "speed": abs(trace.speed - speed) <= z * np.hypot(trace.speed_sd, extra),
        "course": abs(course) <= z * np.hypot(trace.course_sd, np.degrees(extra / speed)),
    }
    if omega is not None:
        found["turn rate"] = abs(trace.turn_rate - omega) <= z * trace.turn_rate_sd
        found["acceleration"] = (abs(trace.acceleration - a) <= z * trace.acceleration_sd).mean(axis=1)
    return {name: column.astype(float) for name, column in found.items()}


def simulated(repeats=20):
    """Print the shares in the bands per phase of a flight, and when each manoeuvre was told."""
    print(f"\n| shares in the 95 % band | phase | {' | '.join(SAID)} |\n|---|---|{'---|' * len(SAID)}")
    told = ["| manoeuvre | told | delay, scans | sd of v, m/s | sd of the turn rate, deg/s |", "|---|---|---|---|---|"]
    for name, (speed, noise, period, manoeuvres) in FLIGHTS.items():
        est, phases = dw.TrackEstimator(name.split(",")[0]), {}
        for turn, gain, lasts in manoeuvres:
            time = period * np.arange(80 + int(lasts / period))
            rng, delays, sharp = np.random.default_rng([len(time), int(10 * noise)]), [], []
            for _ in range(repeats):
                begins = period * (50 + rng.random())
                x, v, a, omega = flight(time, speed, turn, gain, begins, lasts)
                trace = est.scan(time, x + noise * rng.standard_normal(x.shape))
                shares = np.stack(list(held(trace, v, a, omega).values()))
                ends, change = begins + lasts, CHANGE * period
                changing = ((time >= begins) & (time < begins + change)) | ((time >= ends) & (time < ends + change))
                during = (time >= begins) & (time < ends)
                used = np.arange(len(time)) >= FIRST
                for phase, rows in (
                    ("straight", ~changing & ~during), ("change", changing), ("manoeuvre", during & ~changing),
                    ("all", used),
                ):  # fmt: skip
                    phases.setdefault(phase, []).append(shares[:, rows & used])
                onsets = np.flatnonzero(trace.onset & (time >= begins) & (time <= ends + 2 * period))
                delays.append(np.ceil((time[onsets[0]] - begins) / period) if onsets.size else np.inf)
                sharp.append([np.median(trace.velocity_sd[during]), np.degrees(np.median(trace.turn_rate_sd[during]))])
            what = f"{turn} deg/s" if turn else f"{gain} m/s2"
            v_sd, turn_sd = np.mean(sharp, axis=0)
            told += [
                f"| {name}, {what}, {lasts} s | {np.isfinite(delays).mean():.2f} | {np.median(delays):.0f} "
                f"| {v_sd:.3g} | {turn_sd:.2g} |"
            ]
        for phase, parts in phases.items():
            means = np.concatenate(parts, axis=1).mean(axis=1)
            print(f"| {name} | {phase} | {' | '.join(f'{share:.3f}' for share in means)} |")
    print("", *told, sep="\n")


def straight(plots=1000, repeats=10):
    """Print onsets that nothing caused, and the shares in the bands, of straight flights."""
    print("\n| straight | onsets per 1000 plots | " + " | ".join(SAID) + " |\n|---|" + "---|" * (len(SAID) + 1))
    for name, (speed, noise, period, _) in FLIGHTS.items():
        est, onsets, parts = dw.TrackEstimator(name.split(",")[0]), 0, []
        rng = np.random.default_rng(plots)
        time = period * np.arange(plots)
        for _ in range(repeats):
            v = np.tile(speed * np.array([np.sin(0.5), np.cos(0.5)]), (plots, 1))
            trace = est.scan(time, v * time[:, None] + noise * rng.standard_normal(v.shape))
            onsets += trace.onset.sum()
            shares = held(trace, v, np.zeros_like(v), np.zeros(plots))
            parts.append(np.stack([shares[k][FIRST:] for k in SAID]))
        cells = [f"{share:.3f}" for share in np.concatenate(parts, axis=1).mean(axis=1)]
        print(f"| {name} | {1000 * onsets / (plots * repeats):.2f} | {' | '.join(cells)} |")


# --- recordings --------------------------------------------------------------------------------------------


def gnss(where):
    """Return per boat the times, and positions East and North, of its satellite receiver."""
    found = {}
    for path in sorted((where / "autoferry").glob("*_groundTruth.json")):
        rows = {}
        for targets in json.loads(path.read_text()):
            for target in targets if isinstance(targets, list) else [targets]:
                rows.setdefault(target["targetID"], []).append((target["time"], *target["position"][1::-1]))
        for boat, table in rows.items():
            table = np.array(sorted(set(table)))
            found[f"{path.name.split('_')[0]}, boat {boat}"] = tracks.moving(table[:, 0], table[:, 1:])
    return found


def smoothed(time, position, at, half=3.0):
    """Return the velocity of parabolas fitted to the positions within ``half`` seconds."""
    v = np.full((len(at), 2), np.nan)
    for k, t in enumerate(at):
        near = abs(time - t) <= half
        if near.sum() >= 6:
            v[k] = np.polyfit(time[near] - t, position[near], 2)[1]
    return v


def reported(where):
    """Return times and velocities East and North that the departing aircraft reports, on the grid of its first plot."""
    rows, first, last = [], None, None
    for path in sorted((where / "modes_raw").glob("*.jsonl")):
        for line in path.read_text().splitlines():
            row = json.loads(line)
            if row["df"] != "17":
                continue
            if row.get("bds") == "05" and row.get("latitude") is not None:
                last = (row["latitude"], row["longitude"])
                first = first or last
            if row.get("bds") == "09" and row.get("groundspeed") is not None and first:
                turned = np.radians(row["track"] - (last[1] - first[1]) * np.sin(np.radians(first[0])))
                v = KNOT * row["groundspeed"]
                rows.append((row["timestamp"], v * np.sin(turned), v * np.cos(turned)))
    table = np.array(rows)
    return table[:, 0], table[:, 1:]


def recorded():
    """Print the shares of recorded tracks."""
    where = records.folder().parent / "tracking"
    if not where.is_dir():
        raise SystemExit("there are no recordings: set DRIFTWISE_DATA to the folder of recordings")
    print("\n| recorded | plots | velocity | speed | course | median error, m/s | median sd, m/s | rms z |")
    print("|---|---|---|---|---|---|---|---|")

    def row(name, kinds):
        z = np.concatenate([k[1] for k in kinds])
        shares = [np.mean(np.concatenate([k[0][what] for k in kinds])) for what in SAID[:3]]
        error, sd = (np.median(np.concatenate([k[i] for k in kinds])) for i in (2, 3))
        told = " | ".join(f"{s:.3f}" for s in shares)
        print(f"| {name} | {len(z)} | {told} | {error:.2f} | {sd:.2f} | {np.sqrt(np.mean(z**2)):.2f} |")

    truth, boats = gnss(where), []
    for name, time, plots in recordings.boats(where):
        v = smoothed(*truth[name], time)
        boats.append(judged(dw.TrackEstimator("boat").scan(time - time[0], plots), v, 0.0))
        row(name, boats[-1:])
    row("all boats", boats)
    clock, said = reported(where)
    for every in (None, 4.0, 12.0):
        for name, time, plots in tracks.frames(every)(where):
            v = np.stack([np.interp(time, clock, column) for column in said.T], axis=1)
            near = np.min(abs(time[:, None] - clock), axis=1) < 2.0
            v[~near] = np.nan
            extra = KNOT / np.sqrt(12)  # it tells whole knots
            row(f"{name}, {every or 0.5:g} s", [judged(dw.TrackEstimator().scan(time - time[0], plots), v, extra)])


def judged(trace, v, extra):
    """Return the shares, the errors in deviations, the errors and the deviations, where there is a truth."""
    used = np.isfinite(v).all(axis=1) & (np.arange(len(v)) >= FIRST)
    shares = {name: column[used] for name, column in held(trace, v, extra=extra).items()}
    e, sd = (trace.velocity - v)[used], np.hypot(trace.velocity_sd, extra)[used]
    return shares, e / sd, abs(e), sd


def main():
    simulated()
    straight()
    recorded()


if __name__ == "__main__":
    main()
