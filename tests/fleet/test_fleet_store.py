"""A fleet on disk: every bit comes back, what is not whole is refused, what is old is read."""

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import driftwise as dw
from driftwise.detect.watch import OWN
from driftwise.engine import atomic
from driftwise.engine.dispatch import watch
from driftwise.fleet import checkpoint_file, store
from driftwise.fleet.counters import CLOCK
from driftwise.fleet.run import FleetRun
from driftwise.tables.dataset import open_dataset

SAVED = Path(__file__).parents[1] / "saved"
RUN = str(SAVED / "run-2.parquet")  # by the second version of the format: stopped, one series held back
OLD = str(SAVED / "fleet-1.parquet")  # written by the first
KEYS = ["pump 1", 1, "1", 2.5, float("inf"), False, "", "Füllstand\n\0", 10**30]


def bits(array):
    return np.ascontiguousarray(array).view(np.uint64)


def some(series=5, samples=40, seed=0):
    """A fleet that has seen something, one series in other units."""
    fleet = dw.Fleet(dw.AR(1), KEYS[:series])
    fleet.add(["loud"], dw.AR(1, y_scale=64.0))
    at = np.random.default_rng(seed).integers(0, series + 1, samples * series)
    fleet.advance(at, np.random.default_rng(seed).standard_normal((len(at), 1)), np.empty((len(at), 0)))
    return fleet


def test_every_bit_of_a_fleet_comes_back(tmp_path):
    fleet, path = some(len(KEYS)), tmp_path / "fleet.parquet"
    bits(fleet._rows)[2, 3] = 0x7FF8DEAD00000001  # a NaN with a message
    bits(fleet._rows)[3, 3] = 1 << 63  # minus zero
    fleet.save(path)
    back = dw.Fleet.load(path, threads=1)
    assert back.keys == fleet.keys
    assert list(map(type, back.keys)) == list(map(type, fleet.keys))
    assert (bits(back._rows) == bits(fleet._rows[: len(fleet)])).all()
    assert [back.estimator_of(k).options for k in back.keys] == [fleet.estimator_of(k).options for k in fleet.keys]
    y = np.random.default_rng(1).standard_normal(len(fleet))
    assert (bits(back.update_batch(None, y).prediction) == bits(fleet.update_batch(None, y).prediction)).all()
    back.add(["new"])
    back.drop(["pump 1"])
    back.save(path)
    assert dw.Fleet.load(path).keys == back.keys


def test_whoever_has_no_driftwise_reads_keys_and_states(tmp_path):
    some().save(tmp_path / "fleet.parquet")
    table = pq.read_table(tmp_path / "fleet.parquet")
    assert table["key"].to_pylist()[0] == "pump 1"
    assert np.array(table["state"].to_pylist()).tobytes() == some()._rows[:6].tobytes()


def test_arrays_of_any_shape_are_kept_with_a_fleet(tmp_path, monkeypatch):
    monkeypatch.setattr(checkpoint_file, "SLICE", 300)
    fleet, path = some(), tmp_path / "fleet.parquet"
    arrays = {
        "table": np.arange(12.0).reshape(6, 2), "flags": np.arange(7) % 2 == 0, "none": np.empty((0, 3)),
        "cube": np.arange(30, dtype=np.int32).reshape(2, 3, 5), "one": np.array(3.5), "empty": np.zeros((6, 0)),
        "wide": np.arange(12.0).reshape(2, 6).T, "long": np.arange(1000), "few": np.arange(3),
    }  # fmt: skip
    store.write(fleet, path, arrays, {"rows": 7})
    kept = store.read(path)
    assert kept.facts == {"rows": 7} and list(kept.arrays) == list(arrays)
    for name, array in arrays.items():
        found = kept.arrays[name]
        assert (found.dtype, found.shape) == (array.dtype, array.shape) and np.array_equal(found, array), name
    assert pq.ParquetFile(path).num_row_groups > 2


def test_a_fleet_of_the_first_version_is_read_and_kept_as_the_newest(tmp_path):
    table, fleet = pq.read_table(OLD), dw.Fleet.load(OLD)
    assert fleet.keys == ["pump 1", 2, "2", "loud"] and fleet.estimator_of("loud").y_scale == 64.0
    assert np.array(table["state"].to_pylist()).tobytes() == fleet._rows.tobytes()
    assert float(fleet.state(2)["samples"]) == 55 and store.read(OLD).arrays == {}
    fleet.save(tmp_path / "new.parquet")
    header, *_ = checkpoint_file.read(tmp_path / "new.parquet", store.SCHEMA)
    assert header["schema"] == store.SCHEMA == 4
    with pytest.raises(dw.InputError, match="written with schema 4, this version reads up to 1: update driftwise"):
        checkpoint_file.read(tmp_path / "new.parquet", 1)


class Nowhere:
    """Takes what is to be written."""

    def take(self, found): ...
    def happened(self, at, seen): ...


def test_a_run_of_the_second_version_is_gone_on_with():
    y, _ = dw.simulate([-0.8], [0.0], samples=60, noise_std=1.0, seed=1)
    here = np.ones((60, 2), bool)
    here[:50, 1] = False  # the second begins later
    table = {
        "who": np.tile(["a", "b"], 60)[here.ravel()], "t": np.repeat(np.arange(60) * 10.0, 2)[here.ravel()],
        "y": np.stack([5 + y, 3 - 2 * y], axis=1)[here],
    }  # fmt: skip
    dataset = open_dataset(table, by="who", output="y", time="t")
    runs = [FleetRun(dw.Fleet(dw.AR(1)), Nowhere(), every=0, first=8) for _ in range(2)]
    kept = store.read(RUN)
    runs[1] = FleetRun(dw.Fleet._of(kept), Nowhere(), every=0, first=8)
    runs[1].restore(kept)
    assert runs[1].rows == 64 and len(runs[1].intake.snapshot()["held_at"]) == 7
    for run in runs:
        run.go(dataset, 64, lambda: None)
    assert np.array_equal(bits(runs[0].fleet.states), bits(runs[1].fleet.states))
    now, then = (run.tally.table[:, : -len(CLOCK)] for run in runs)
    assert np.array_equal(bits(now), bits(then)) and runs[1].tally["step"].tolist() == [10.0, 10.0]


def test_what_is_not_whole_is_refused(tmp_path):
    some().save(tmp_path / "fleet.parquet")
    whole, path = (tmp_path / "fleet.parquet").read_bytes(), tmp_path / "other.parquet"
    fleet, rng, refused = dw.Fleet.load(tmp_path / "fleet.parquet"), np.random.default_rng(0), 0
    for size in [*range(12), *rng.integers(12, len(whole), 60)]:
        path.write_bytes(whole[:size])
        with pytest.raises(dw.InputError, match=r"cannot be read|no file that Fleet\.save wrote, or it was damaged"):
            dw.Fleet.load(path)
    for at in rng.integers(0, len(whole), 300):
        flipped = bytearray(whole)
        flipped[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        try:
            back = dw.Fleet.load(path)
        except dw.InputError:
            refused += 1
        else:  # of what Parquet writes twice, or for others
            assert back.keys == fleet.keys and (bits(back._rows) == bits(fleet._rows)).all()
    assert refused > 150


def test_a_change_with_a_right_page_checksum_is_found_by_ours(tmp_path):
    some().save(tmp_path / "fleet.parquet")
    table = pq.read_table(tmp_path / "fleet.parquet")
    for name, column in ("group", pa.array([0] * 6)), ("key", pa.array([*"abcdef"])):
        i = table.schema.get_field_index(name)
        pq.write_table(table.set_column(i, table.schema.field(i), column), tmp_path / "altered.parquet")
        with pytest.raises(dw.InputError, match="its checksum differs"):
            dw.Fleet.load(tmp_path / "altered.parquet")


def test_files_and_keys_that_do_not_fit_are_refused_with_a_reason(tmp_path):
    path = tmp_path / "fleet.parquet"
    with pytest.raises(dw.InputError, match="no such file"):
        dw.Fleet.load(path)
    pq.write_table(pa.table({"asset": [1]}), path)
    with pytest.raises(dw.InputError, match=r"not one that .* wrote"):
        dw.Fleet.load(path)
    path.write_text("asset,flow\n")
    with pytest.raises(dw.InputError, match=r"no file that Fleet\.save wrote"):
        dw.Fleet.load(path)
    with pytest.raises(dw.InputError, match=r"text or numbers, got \(1, 2\) of tuple"):
        dw.Fleet(dw.AR(1), [(1, 2)]).save(path)
    assert path.read_text() == "asset,flow\n"
    with pytest.raises(dw.InputError, match=r"there is no folder .*; make it first"):
        some().save(tmp_path / "nowhere" / "fleet.parquet")
    header = {
        "schema": 2,
        "fields": [["theta", 1]],
        "estimators": [store.settings(dw.AR(1))],
        "facts": {},
        "arrays": [],
    }
    checkpoint_file.write(
        path, header, {"key": ["a"], "kind": ["text"]}, {"group": np.zeros(1, int), "state": np.zeros((1, 1))}
    )
    with pytest.raises(dw.InputError, match="laid out otherwise"):
        dw.Fleet.load(path)


class Mine(NamedTuple):
    """A detector of somebody's own."""

    threshold: float

    def state_size(self, parameters):
        return OWN


@watch.on(Mine)
def _(detector, marks, z, slope):
    return float(abs(z) > detector.threshold)


def test_policies_of_ones_own_are_given_again(tmp_path):
    est = dw.AR(1, memory=dw.RestartOnChange(Mine(3.0)))
    fleet = dw.Fleet(est, ["a"])
    fleet.add(["b"], dw.AR(1, memory=dw.RestartOnChange(Mine(3.0)), y_scale=4.0))
    fleet.save(tmp_path / "fleet.parquet")
    for given in None, dw.Joint(1):
        with pytest.raises(dw.InputError, match=r"a policy of your own.*Fleet.load\(path, AR"):
            dw.Fleet.load(tmp_path / "fleet.parquet", given)
    back = dw.Fleet.load(tmp_path / "fleet.parquet", est)
    assert [back.estimator_of(key).y_scale for key in "ab"] == [1.0, 4.0]
    assert isinstance(back.estimator_of("b").options["memory"].detector, Mine)


@pytest.mark.parametrize("step", ["fsync", "replace", "open"])
def test_a_machine_that_fails_while_saving_leaves_the_old_file_or_the_new_one(tmp_path, monkeypatch, step):
    path, old, new = tmp_path / "fleet.parquet", some(2), some(4)
    old.save(path)
    calls, real = [], getattr(os, step)
    monkeypatch.setattr(atomic.os, step, lambda *a, **k: (calls.append(a), real(*a, **k))[1])
    new.save(path)
    for failing in range(len(calls)):
        monkeypatch.setattr(atomic.os, step, real)
        old.save(path)
        count = iter(range(100))

        def fails(*args, failing=failing, count=count, **options):
            if next(count) == failing:
                raise OSError("the disk is gone")
            return real(*args, **options)

        monkeypatch.setattr(atomic.os, step, fails)
        with pytest.raises(OSError, match="the disk is gone"):
            new.save(path)
        is_renamed = step != "replace" and failing == 1  # only the folder was not yet safe
        assert dw.Fleet.load(path).keys == (new if is_renamed else old).keys
        assert os.listdir(tmp_path) == ["fleet.parquet"]
    assert len(calls) == (1 if step == "replace" else 2)


def test_saving_and_loading_take_the_memory_of_the_states_and_a_slice(tmp_path):
    import tracemalloc

    fleet = dw.Fleet(dw.Joint(3), range(40_000))
    size = fleet._rows[: len(fleet)].nbytes
    assert size > 10e6
    tracemalloc.start()
    arrow = pa.total_allocated_bytes()
    fleet.save(tmp_path / "fleet.parquet")
    saving = tracemalloc.get_traced_memory()[1]
    tracemalloc.reset_peak()
    back = dw.Fleet.load(tmp_path / "fleet.parquet")
    loading = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    words = 300 * len(fleet)  # of Python's own, for keys as text
    assert saving < words and loading < 1.2 * size + words
    assert pa.total_allocated_bytes() - arrow < 2 * checkpoint_file.SLICE and len(back) == len(fleet)
