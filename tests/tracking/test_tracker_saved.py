"""A tracker that is saved goes on, whatever version wrote it."""

import json
from pathlib import Path

import numpy as np
import pytest
from driftwise_studies.score.motions import crowd
from flights import run, same, traffic
from rows_before import without_courses

from driftwise.engine.errors import InputError
from driftwise.estimators.track import bank
from driftwise.tracking.tracker import Tracker


@pytest.mark.parametrize("size", [1, 7])
@pytest.mark.parametrize("delay", [0.0, 9.0])
def test_a_stream_gives_the_tracks_of_the_record(size, delay, tmp_path):
    data = traffic()
    record = run(data, delay=delay)
    stream = Tracker(delay=delay)
    for first in range(0, len(data), size):
        stream.feed(data[first : first + size])
        if first == 70:  # a follower is stopped, and started again on another machine
            stream.save(tmp_path / "tracker.npz")
            stream = Tracker.load(tmp_path / "tracker.npz")
    stream.finish()
    same(record, stream)


def test_a_tracker_saved_before_plots_without_keys_were_weighed_goes_on():
    saved = Path(__file__).parents[1] / "saved" / "tracker-3.npz"  # after 71 plots of the traffic, with a delay of 9 s
    tracker, whole = Tracker.load(saved), run(traffic(), delay=9.0)
    tracker.feed(traffic()[71:])
    tracker.finish()
    assert [(t.key, t.status, t.plots.time.tolist()) for t in tracker.tracks] == [
        (t.key, t.status, t.plots.time.tolist()) for t in whole.tracks
    ]


def test_a_tracker_saved_before_errors_of_sensors_were_learnt_goes_on():
    saved = Path(__file__).parents[1] / "saved" / "tracker-4.npz"  # after 120 plots of this crowd
    scene = crowd.draw(0, 9)
    seen, tracker = crowd.simulate(scene).plots, Tracker.load(saved)
    before = {t.id: len(t) for t in tracker.tracks}
    assert len(before) == 2 and len(tracker.targets.existence.clutter.table) == 94
    tracker.feed(seen[120:400])
    after = {t.id: len(t) for t in tracker.tracks}
    assert all(after[id] > n for id, n in before.items()) and tracker.targets.existence.errors.seen


@pytest.mark.parametrize("name", ["states", "rows", "places"])
def test_a_tracker_whose_tables_are_of_another_width_is_refused_before_anything_reads_beyond_them(name, tmp_path):
    run(traffic()).save(tmp_path / "tracker.npz")
    arrays = dict(np.load(tmp_path / "tracker.npz"))
    for wrong in (
        arrays[name][:, :-1],
        arrays[name][:, :-2],
        arrays[name].astype(np.float32),
        arrays[name][:, :, None],
    ):
        np.savez(tmp_path / "wrong.npz", **(arrays | {name: wrong}))
        with pytest.raises(InputError, match=f"its {name} are .* this version keeps"):
            Tracker.load(tmp_path / "wrong.npz")


@pytest.mark.parametrize("schema, first", [(5, 0), (6, 1), (7, 4)])
def test_a_narrower_table_is_read_where_a_file_says_that_it_is_of_an_earlier_version(tmp_path, schema, first):
    run(traffic()).save(tmp_path / "tracker.npz")
    arrays = dict(np.load(tmp_path / "tracker.npz"))
    facts = json.loads(arrays["facts"].tobytes()) | {"schema": schema}
    later = [bank.PACE, bank.REFUSED, *(bank.of_coordinate(2, bank.ASIDE, c) for c in range(2))]
    former = np.delete(without_courses(arrays["states"], 2), later[first:], axis=1)
    said = np.frombuffer(json.dumps(facts).encode(), np.uint8)
    np.savez(tmp_path / "former.npz", **(arrays | {"facts": said, "states": former}))
    assert len(Tracker.load(tmp_path / "former.npz").tracks) == len(Tracker.load(tmp_path / "tracker.npz").tracks)
