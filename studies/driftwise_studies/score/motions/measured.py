"""A tracker on a scene: what it said beside the truth."""

from __future__ import annotations

import os
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np

from driftwise.engine.status import Status
from driftwise.models.quantities import NORMAL_95
from driftwise.tracking.plots import Plots
from driftwise.tracking.tracker import Tracker

from .drawing import draw
from .scene import Scene
from .simulation import Path, Seen, simulate

FIRST = 3  # plots of a track that are not scored: its speed and noise are learnt
FEW = 3  # plots without which a mean is looked at, too
LONG = 30  # plots of a track that is judged alone
LOST = 10.0, 5  # deviations of the error of the position, and plots in a row: it has diverged
TELLABLE = 6.0  # deviations that a manoeuvre leads away, at least ..
PLOTS = 4  # .. and plots in it
AFTER = 3.0  # scans after a manoeuvre in which it may still be told
WARY = 20.0  # scans after a manoeuvre that are not quiet
SHARP = 6.0  # .. and the factor between the gentlest of a class and what is none


class Followed(NamedTuple):
    """One track beside its truth."""

    scene: Scene
    plots: int
    nis: float  # mean over its plots that are not wild
    most_nis: float  # the same without the three largest
    quiet_nis: float  # the same without those in a manoeuvre and just after
    normal: float  # mean squared normal score of its plots that are not wild: where they lie in their forecasts
    plot_share: float  # of its plots that are not wild, in their 95 % band
    position: tuple[float, float]  # share of coordinates in the 95 % band, plots
    velocity: tuple[float, float]
    turning: tuple[float, float]  # the velocity's within manoeuvres
    density: float  # mean log density of plots that are not wild, in units of the deviation
    error: float  # rms error of the position over the deviation of a plot
    speed_error: float  # rms error of the velocity, m/s
    diverged: int
    worst: float  # largest error of the position, deviations
    quiet: int  # plots that are far from any manoeuvre
    false: int  # onsets among them
    delays: tuple[float, ...]  # s, of the manoeuvres that could be told; infinite where none was
    scan: float


class Found(NamedTuple):
    """One scene."""

    scene: Scene
    tracks: tuple[Followed, ...]
    pieces: tuple[int, ...]  # of each object: how many confirmed tracks have plots of it
    mixed: int  # tracks with plots of several objects
    wild: int  # plots that are
    refused: int  # plots set aside or marked
    plots: int


def play(seed: int, numbers: Iterable[int], processes: int | None = 1, stated: bool = False) -> list[Found]:
    """Return what was found in each scene, the variances ``stated`` or not; on all cores if ``processes`` is None."""
    scenes, processes = [draw(seed, number) for number in numbers], processes or os.cpu_count() or 1
    if processes == 1:
        return [one(scene, stated) for scene in scenes]
    with ProcessPoolExecutor(processes, mp_context=get_context("forkserver")) as pool:
        return list(pool.map(one, scenes, [stated] * len(scenes), chunksize=4))


def one(scene: Scene, stated: bool = False) -> Found:
    """Track one scene, told the class and nothing else; ``stated``: the true variance of each plot as well."""
    seen = simulate(scene, stated)
    tracker = Tracker(scene.kind.told, single=scene.single)
    tracker.feed(seen.plots)
    tracker.finish()
    tracks, counts = tracker.tracks, tracker.counts
    index = [belong(track, seen.plots) for track in tracks]
    refused = counts["outliers"] + counts["clock"]
    refused += sum(int(np.sum((t.trace.status & int(Status.OUTLIER)) > 0)) for t in tracks)
    owners = [np.unique(seen.object[i]) for i in index]
    pieces = [sum(k in who for who in owners) for k in range(scene.objects)]
    followed = [follow(scene, t, seen, i) for t, i in zip(tracks, index) if len(t) > FIRST + 1]
    mixed = sum(len(who) > 1 for who in owners)
    return Found(scene, tuple(followed), tuple(pieces), mixed, int(seen.wild.sum()), refused, len(seen.plots))


def belong(track, plots: Plots) -> np.ndarray:
    """Return which of the plots of a scene a track has."""
    where = {(t, *p): k for k, (t, p) in enumerate(zip(plots.time.tolist(), plots.position.tolist()))}
    return np.array([where[t, *p] for t, p in zip(track.plots.time.tolist(), track.plots.position.tolist())])


def follow(scene: Scene, track, seen: Seen, index: np.ndarray) -> Followed:
    """Hold one track against the truth."""
    trace, late = track.trace, slice(FIRST, None)
    tame = ~seen.wild[index][late]
    nis = trace.nis[late][tame]
    owner = int(np.bincount(seen.object[index]).argmax())
    path, scan = seen.paths[owner], track.period or scene.sensors[0].scan
    off, off_v = trace.position - seen.truth[index], trace.velocity - seen.velocity[index]
    sd = np.maximum(trace.position_sd, 1e-12)
    far = np.max(np.abs(off) / sd, axis=1)[late]
    in_manoeuvre = within(track.plots.time, path.manoeuvres)[late]
    near = within(track.plots.time, [(begin, end + AFTER * scan) for begin, end in path.manoeuvres])[late]
    unit = 2 * np.log(scene.sensors[0].deviation)
    outside = np.minimum(trace._column("lower"), trace._column("upper"))[late][tame]
    held_v = np.abs(off_v[late]) <= NORMAL_95 * trace.velocity_sd[late]
    held_p = np.abs(off[late]) <= NORMAL_95 * sd[late]
    quiet, false, delays = onsets(scene, track.plots.time, trace.onset, path, scan)
    return Followed(
        scene, len(track), average(nis), average(np.sort(nis)[:-FEW]), average(nis[~near[tame]]),
        average(trace.normal_score[late][tame] ** 2),
        average(outside >= 0.025), share(held_p), share(held_v), share(held_v[in_manoeuvre]),
        average(trace.log_score[late][tame].sum(axis=1) + unit), rms(off[late]) / scene.sensors[0].deviation,
        rms(off_v[late]), runs(far > LOST[0], LOST[1]), float(np.max(far, initial=0.0)), quiet, false, delays, scan,
    )  # fmt: skip


def onsets(scene: Scene, time, onset, path: Path, scan: float) -> tuple[int, int, tuple[float, ...]]:
    """Return how many plots are quiet, the onsets among them, and the delay of each manoeuvre that could be told."""
    deviation = max(s.deviation for s in scene.sensors) + scene.lattice
    told, busy, delays = time[onset], np.zeros(len(time), bool), []
    for (begin, end), size in zip(path.manoeuvres, path.sizes):
        busy |= (time >= begin) & (time <= end + WARY * scan)
        inside = np.sum((time >= begin) & (time <= end))
        if size < TELLABLE * deviation or inside < PLOTS or begin < time[min(FIRST + 3, len(time) - 1)]:
            continue
        hits = told[(told >= begin) & (told <= end + AFTER * scan)]
        delays.append(float(hits[0] - begin) if len(hits) else np.inf)
    busy[:FIRST] = True
    return int(np.sum(~busy)), int(np.sum(onset & ~busy)), tuple(delays)


def within(time, spans) -> np.ndarray:
    """Return which times lie in one of the spans."""
    inside = np.zeros(len(time), bool)
    for begin, end in spans:
        inside |= (time >= begin) & (time <= end)
    return inside


def runs(hits: np.ndarray, least: int) -> int:
    """Return how many runs of at least so many hits there are."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], hits.astype(int), [0]])))
    return int(np.sum(edges[1::2] - edges[::2] >= least))


def share(held: np.ndarray) -> tuple[float, float]:
    """Return the share that is held and of how many."""
    return (float(np.mean(held)), float(held.size)) if held.size else (np.nan, 0.0)


def average(values) -> float:
    """Return the mean of what is finite."""
    values = np.asarray(values, float)
    values = values[np.isfinite(values)]
    return float(values.mean()) if values.size else np.nan


def rms(error) -> float:
    """Return the root of the mean square length."""
    return float(np.sqrt(np.mean(np.sum(error**2, axis=1)))) if len(error) else np.nan
