"""A run of a fleet into a folder: what it writes, and that stopping it anywhere changes nothing."""

import gc
import os
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from draws import slow

import driftwise as dw
from driftwise.fleet.events import MOST, RUNS, FleetEvents
from driftwise.fleet.fleet_run import former_run, run_fleet
from driftwise.fleet.job import FleetJob

SCRIPT = Path(__file__).parents[2] / "scripts" / "fleet_kill.py"
ROWS, SERIES = 3000, 6


def data(seed=0):
    """Series of unequal length, mixed, with missing values, one of them silent for long."""
    rng = np.random.default_rng(seed)
    key = (SERIES * rng.random(ROWS) ** 2).astype(int)
    u = rng.standard_normal(ROWS)
    y = 20.0 + key + u + 0.1 * rng.standard_normal(ROWS)
    y[rng.random(ROWS) < 0.03] = np.nan
    y[1000:1500][key[1000:1500] == 0] = np.nan
    return {"asset": np.array([f"pump {k}" for k in key]), "time": np.arange(ROWS) * 1.0, "flow": y, "speed": u}


@pytest.fixture
def path(tmp_path):
    pq.write_table(pa.table(data()), tmp_path / "data.parquet")
    return tmp_path / "data.parquet"


def run(path, out, **more):
    options = dict(every=7, batch=250, batches=2, threads=1, time="time", inputs=["speed"]) | more
    columns = dict(by="asset", output="flow")
    return run_fleet(FleetJob(path, estimator=dw.ARX(1, 1), out=out, **columns, **options))


def contents(out):
    return {str(p.relative_to(out)): p.read_bytes() for p in Path(out).rglob("*") if p.is_file()}


def test_what_is_written_is_what_each_series_says_on_its_own(path, tmp_path):
    found, table = run(path, tmp_path / "out"), data()
    estimates = pq.read_table(tmp_path / "out" / "estimates").to_pydict()
    final = pq.read_table(tmp_path / "out" / "final.parquet").to_pydict()
    assert (found.rows, found.began, found.is_finished, found.keyless) == (ROWS, 0, True, 0)
    assert final["key"] == found.fleet.keys == list(dict.fromkeys(table["asset"]))
    for i, key in enumerate(final["key"]):
        mine = np.flatnonzero(table["asset"] == key)
        mine = mine[np.isfinite(table["flow"][mine]).argmax() :]
        y, u = table["flow"][mine], table["speed"][mine]
        held = np.flatnonzero(np.isfinite(y))[31] + 1  # 32 of them measured
        level = np.cumsum(np.nan_to_num(y[:held]))[-1] / np.isfinite(y[:held]).sum()
        shift = np.cumsum(u[:held])[-1] / held
        est = dw.ARX(1, 1).scaled_to((y - level)[:held], (u - shift)[:held])
        trace = est.scan(y - level, u - shift)
        told, rows = slice(6, None, 7), [k for k, name in enumerate(estimates["key"]) if name == key]
        expected = {
            "sample": np.arange(1, len(y) + 1), "row": mine, "time": table["time"][mine], "y": y - level + level,
            "prediction": trace.prediction + level, "innovation": trace.innovation, "std": np.sqrt(trace.variance),
            "status": trace.status, "a1": trace.parameters[:, 0], "b1_std": trace.parameters_std[:, 1],
        }  # fmt: skip
        for name, values in expected.items():
            assert np.array_equal([estimates[name][k] for k in rows], values[told], equal_nan=True), name
        summary = trace.summary()
        assert found.fleet.state(key) == trace.state
        assert final["b1"][i] == trace.parameters[-1, 1] and final["level"][i] == level
        np.testing.assert_allclose(final["b1_std"][i], trace.parameters_std[-1, 1], rtol=1e-12)
        np.testing.assert_allclose(final["noise_std"][i], summary.noise_std, rtol=1e-12)
        assert final["samples"][i] == len(y) and final["missing"][i] == np.isnan(y).sum()
        assert 0.7 < final["nis"][i] < 1.3 and final["error"][i] < final["error_of_last"][i]


def test_estimates_do_not_depend_on_batches_or_threads(path, tmp_path):
    def rows(out):
        table = pq.read_table(out / "estimates").sort_by([("key", "ascending"), ("sample", "ascending")])
        return table, pq.read_table(out / "final.parquet")

    run(path, tmp_path / "one", every=1)
    run(path, tmp_path / "two", every=1, batch=997, batches=None, seconds=0.0, threads=2)
    for one, two in zip(rows(tmp_path / "one"), rows(tmp_path / "two")):
        for name in one.column_names:
            assert one.num_rows and np.array_equal(one[name], two[name], equal_nan=one[name].type != pa.string())
    assert one.num_rows == len(set(data()["asset"]))


class Dead(BaseException):
    """What happens to a process that is killed: nothing can be done about it."""


@pytest.mark.parametrize("step", ["fsync", "replace", "unlink", "rename", "rmdir"])
def test_a_run_that_dies_at_any_step_is_gone_on_with_bit_for_bit(path, tmp_path, monkeypatch, step):
    run(path, tmp_path / "alone", batch=500)
    gc.collect()  # a temporary folder that another test left would unlink, and swallow, the first death
    expected, real, out = contents(tmp_path / "alone"), getattr(os, step), tmp_path / "out"
    for deaths in range(100):  # each attempt dies one step later than the one before
        left = deaths

        def dies(*args, **options):
            nonlocal left
            if isinstance(args[0], int) or tmp_path in Path(args[0]).parents:  # not what a compiler clears away beside
                left -= 1
                if left == -1:
                    raise Dead
            return real(*args, **options)

        monkeypatch.setattr(os, step, dies)
        try:
            run(path, out, batch=500, resume=True)
        except Dead:
            continue
        finally:
            monkeypatch.setattr(os, step, real)
        break
    assert contents(out) == expected
    assert deaths >= {"fsync": 6, "replace": 5}.get(step, 1)


@pytest.mark.parametrize("kills", [3, slow(50)])
def test_killed_runs_leave_the_same_files(kills, tmp_path):
    rows = 6000 if kills == 3 else 100_000
    command = [sys.executable, SCRIPT, "--kills", str(kills), "--rows", str(rows), "--series", "50"]
    done = subprocess.run(command, env=os.environ | {"TMPDIR": str(tmp_path)}, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"\n{kills} kills: " in done.stdout and "runs left the very same files" in done.stdout


def flip(part):
    """Turn one bit of a file around."""
    content = bytearray(part.read_bytes())
    content[len(content) // 2] ^= 1
    part.write_bytes(content)


@pytest.mark.parametrize("is_finished", [False, True])
@pytest.mark.parametrize("damage", [flip, os.unlink])
def test_a_damaged_part_is_noticed_on_resume(path, tmp_path, is_finished, damage):
    out = tmp_path / "out"

    class Stop(Exception):
        pass

    def stop(progress):
        if progress.rows == 1250 and not is_finished:
            raise Stop

    with pytest.raises(Stop) if not is_finished else nullcontext():
        run(path, out, progress=stop)
    written = [file.relative_to(out).as_posix() for file in sorted(out.rglob("*.parquet"))]
    kept = former_run(out).rows  # what came after the last checkpoint is written again anyway
    names = [name for name in written if name != "fleet.parquet" and f"part-{kept:015d}" not in name]
    assert any(name.startswith("estimates/part-") for name in names)
    for name in names:
        content = (out / name).read_bytes()
        damage(out / name)
        if name != "final.parquet" or damage is flip:  # made again where it is gone
            with pytest.raises(dw.InputError, match=rf"{name} is not as the run wrote it: .*replace=True"):
                run(path, out, resume=True)
        (out / name).write_bytes(content)
    assert run(path, out, resume=True).is_finished


def test_another_order_is_not_gone_on_with(path, tmp_path, monkeypatch):
    class Stop(Exception):
        pass

    def stop(progress):
        if progress.rows == 1250:
            raise Stop

    out = tmp_path / "out"
    with pytest.raises(Stop):
        run(path, out, progress=stop)
    assert former_run(out).rows == 1000 and not former_run(out).is_finished
    with pytest.raises(dw.InputError, match=r"holds a run already.*resume=True.*replace=True"):
        run(path, out)
    with pytest.raises(dw.InputError, match=r"inputs must be 1 for ARX\(.*\), got 0"):
        run(path, out, inputs=[])
    with pytest.raises(dw.InputError, match="replace=True deletes it: give one of them"):
        run(path, out, resume=True, replace=True)
    with pytest.raises(dw.InputError, match="first was 32, is 16; every was 7, is 8"):
        run(path, out, resume=True, every=8, first=16)
    with pytest.raises(dw.InputError, match="data is another"):
        run(data(), out, resume=True)
    (out / "notes.txt").write_text("mine")

    def full(number):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(dw.InputError, match=r"stopped by the system at row 1500 .*Is the disk full\? .*resume=True"):
        run(path, out, resume=True)
    monkeypatch.undo()
    found = run(path, out, resume=True, threads=2, batches=None)
    assert (found.began, found.rows, found.is_finished) == (1000, ROWS, True)
    before = contents(out)
    run(path, tmp_path / "alone")  # with checkpoints, and parts cut, elsewhere
    for name in "final.parquet", "events.parquet", "fleet.parquet":
        assert before[name] == (tmp_path / "alone" / name).read_bytes()
    one, other = (pq.read_table(folder / "estimates") for folder in (out, tmp_path / "alone"))
    assert one.num_rows and all(np.array_equal(one[c], other[c], equal_nan=c != "key") for c in one.column_names)
    again = run(path, out, resume=True)
    assert (again.began, again.rows, again.events) == (ROWS, ROWS, found.events) and contents(out) == before
    assert np.array_equal(again.tally.table, found.tally.table, equal_nan=True)
    run(path, out, replace=True, every=ROWS)
    assert sorted(p.name for p in out.iterdir()) == [
        "SHA256SUMS", "events.parquet", "final.parquet", "fleet.parquet", "notes.txt"
    ]  # fmt: skip
    with pytest.raises(dw.InputError, match="there is no run in"):
        former_run(tmp_path)


def test_results_neither_among_the_data_nor_of_two_at_once(path, tmp_path):
    with pytest.raises(dw.InputError, match="the results would lie among the data"):
        run(path.parent, path.parent / "out")

    def other(progress):
        with pytest.raises(dw.InputError, match="another process is running in"):
            run(path, tmp_path / "out", resume=True)

    run(path, tmp_path / "out", progress=other, batch=2000)


@pytest.mark.parametrize("key", [int, str])
def test_a_table_without_a_clock_and_with_rows_of_nobody(key, tmp_path):
    table = data()
    names = [key(name[5:]) if k % 50 else None for k, name in enumerate(table["asset"])]
    columns = pa.table({"asset": names, "flow": table["flow"], "speed": table["speed"]})
    found = run(columns, tmp_path, time=None, first=0, center=False, every=ROWS)
    final = pq.read_table(tmp_path / "final.parquet")
    assert found.keyless == ROWS / 50 and final["key"].to_pylist() == found.fleet.keys
    assert set(map(type, found.fleet.keys)) == {key} and not (tmp_path / "estimates").exists()
    key = found.fleet.keys[0]
    mine = np.array([name == key for name in names])
    assert found.fleet.state(key) == dw.ARX(1, 1).scan(table["flow"][mine], table["speed"][mine]).state


def test_keys_in_two_ways_are_refused(tmp_path):
    for i, key in enumerate((7, "7a")):
        pq.write_table(
            pa.table({"asset": [key] * 40, "flow": np.arange(40.0), "speed": np.ones(40)}), tmp_path / f"{i}.pq"
        )
    with pytest.raises(dw.InputError, match="text or whole numbers, not both: there are 7 and '7a'"):
        run([tmp_path / "0.pq", tmp_path / "1.pq"], tmp_path / "out", time=None)


def slowly(status, at):
    """Events as one would find them by hand: (sample of the stretch, kind)."""
    found, length, told = [], {}, {}
    for k, (row, bits) in enumerate(zip(at, status)):
        seen = ["JUMP"] if bits & dw.Status.JUMP else []
        for name, (mask, least) in RUNS.items():
            length[row, name] = length.get((row, name), 0) + 1 if bits & mask else 0
            seen += [name] if length[row, name] == least else []
        for name in seen:
            told[row] = told.get(row, 0) + 1
            found += [(k, name)] if told[row] <= MOST else []
    return found


def test_events_are_the_same_however_samples_are_cut():
    class Taken:
        def __init__(self, at, source):
            self.at, self.source, self.time = at, source, source * 0.5

    rng, samples = np.random.default_rng(0), 4000
    fleet = dw.Fleet(dw.AR(1), range(5))
    at = np.sort(rng.integers(0, 5, samples))
    status = sum(int(bit) * (rng.random(samples) < share) for bit, share in [
        (dw.Status.JUMP, 0.3), (dw.Status.NOISE, 0.1), (dw.Status.LOST, 0.01), (dw.Status.OUTLIER, 0.5),
        (dw.Status.REJECTED, 0.3), (dw.Status.MISSING_OUTPUT, 0.99)])  # fmt: skip
    at[at == 3] = 2  # 1600 samples of one series: more events than are told
    outs = np.zeros((samples, 9))
    outs[:, 3] = status
    expected = slowly(status, at)
    assert {name for _, name in expected} == {"JUMP", *RUNS}
    for cuts in [], [1, 2, 2000], np.sort(rng.integers(0, samples, 40)):
        events, found = FleetEvents(fleet), []
        for part in np.split(np.arange(samples), cuts):
            rows, seen = events.take(Taken(at[part], part), outs[part], part + 1)
            assert np.array_equal(rows, at[seen.row]) and np.array_equal(seen.sample, seen.row + 1)
            found += zip(seen.row.tolist(), seen.kind)
        assert sorted(found) == sorted(expected) and events.reported == len(expected)
