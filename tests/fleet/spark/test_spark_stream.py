"""A stream through Spark: in disorder, killed and started again, the numbers of one machine, bit for bit."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest
from spark_tables import PROVIDER, ROCKS, assert_same, expected, in_order, plants, rows

import driftwise as dw
from driftwise.fleet.spark import parcel
from driftwise.fleet.spark.many import COUNTS
from driftwise.fleet.spark.shipped import ship


def arrivals(folder: Path, table, files=6, seed=0):
    """Write the samples as files, up to 20 s out of order; then late ones and duplicates; then the end of time."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    (folder / "in").mkdir(parents=True)
    order = np.argsort(table["t"] + np.random.default_rng(seed).uniform(0, 20, len(table["t"])), kind="stable")
    parts = [rows(table, chosen) for chosen in np.array_split(order, files)]
    last = table["t"].max()
    parts.append({"asset": np.array([0, 0, 1, 2]), "t": np.array([1000.0, 999.5, 1001.0, last]), "y": np.full(4, 99.0)})
    keys = np.unique(table["asset"])
    parts.append({"asset": keys, "t": np.full(len(keys), 9000.0), "y": np.full(len(keys), np.nan)})
    for i, part in enumerate(parts):
        micros = pa.array((part["t"] * 1e6).astype(np.int64), pa.timestamp("us", "UTC"))
        name = folder / "in" / f"{i}.parquet"
        pq.write_table(pa.table({"y": part["y"], "t": micros, "asset": part["asset"], "new": micros}), name)
        os.utime(name, (1e9 + i, 1e9 + i))  # taken in this order


def seconds(found):
    import pyarrow as pa

    return found["t"].cast(pa.timestamp("us", "UTC")).cast("int64").to_numpy() / 1e6


@pytest.mark.parametrize("seed", range(3))
def test_a_followed_series_is_the_sorted_one_whatever_comes_when(seed):
    """Each stretch of samples comes shuffled, the watermark lags behind the shuffling: nothing is late."""
    pandas = pytest.importorskip("pandas")
    from driftwise.fleet.spark.columns import Order
    from driftwise.fleet.spark.streaming import follow

    rng, est = np.random.default_rng(seed), dw.AR(1)
    order = Order(ship(est), "asset", "t", ("y",), (), 1, "innovations", 1)
    y, t = rng.standard_normal(80), np.cumsum(rng.integers(1, 5, 80)) / 1024
    y[::9] = np.nan
    arrival = np.argsort(t + rng.uniform(0, 0.02, 80))
    blob, frames, wake = None, [], None
    for part in np.array_split(arrival, 9):
        batch = pandas.DataFrame({"key": "a", "seconds": t[part], "0": y[part]})
        mark = int(1000 * (t[part].max() - 0.025))
        found = follow(order, "a", blob, [batch.iloc[:3], batch.iloc[3:]], max(mark, 0))
        assert found.was == wake and (found.wake is None or found.wake > mark)
        blob, wake = found.blob, found.wake
        frames.append(found.frame)
    found = follow(order, "a", blob, (), 10**9)
    assert found.wake is None
    late = pandas.DataFrame({"key": "a", "seconds": [t[3], t[-1], np.nan], "0": 5.0})
    end = follow(order, "a", found.blob, [late], 10**9)
    counts = parcel.unpack(parcel.digest(est), end.blob).counts
    assert not len(end.frame) and dict(zip(COUNTS, counts)) == dict(
        samples=80, measured=np.isfinite(y).sum(), late=1, duplicate=1, bad=0, timeless=1
    )
    shown = pandas.concat([*frames, found.frame])
    trace = est.scan(y)
    assert shown.seconds.tolist() == t.tolist()
    for name in ("prediction", "innovation"):
        assert shown[name].to_numpy().tobytes() == getattr(trace, name).tobytes()
    assert parcel.unpack(parcel.digest(est), end.blob).row.tobytes() == trace.state.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("store", ["rocks", "other"])
def test_a_stream_in_disorder_gives_the_numbers_of_one_machine(spark, store, tmp_path):
    from spark_child import start

    table, est = plants(), dw.AR(1)
    arrivals(tmp_path, table)
    spark.conf.set(PROVIDER, ROCKS) if store == "rocks" else spark.conf.unset(PROVIDER)
    start(spark, tmp_path, "files").awaitTermination()
    found = in_order(spark.read.parquet(str(tmp_path / "out")))
    _, columns = expected(table, est)
    assert seconds(found).tolist() == table["t"].tolist()
    assert_same(found, columns)
    last = found.filter(seconds(found) == table["t"].max()).to_pylist()
    counts = {row["asset"]: (row["late"], row["duplicate"], row["timeless"]) for row in last}
    assert counts == dict.fromkeys(range(7), (0, 0, 0)) | {0: (2, 0, 0), 1: (1, 0, 0), 2: (0, 1, 0)}


@pytest.mark.slow
@pytest.mark.parametrize("store, sink, kills", [("rocks", "files", 4), ("other", "batches", 2)])
def test_killed_and_started_again_nothing_is_lost_or_doubled(spark, store, sink, kills, tmp_path):
    """SIGKILL for the whole group of processes, at any moment."""
    import signal
    import subprocess
    import time

    import pyarrow.dataset as ds

    table, est = plants(length=120), dw.AR(1)
    arrivals(tmp_path, table, files=10)
    rng = np.random.default_rng(3)
    command = [sys.executable, str(Path(__file__).with_name("spark_child.py")), str(tmp_path), store, sink]
    paths = [str(Path(dw.__file__).parent.parent), str(Path(__file__).parents[2])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    killed = 0
    for round in range(kills + 1):
        child = subprocess.Popen(command, env=environment, start_new_session=True, stdout=-1, stderr=-3, text=True)
        try:
            assert child.stdout.readline() == "started\n"
            if round < kills:
                time.sleep(rng.uniform(3, 15))
                killed += child.poll() is None
            else:
                assert child.wait(300) == 0
        finally:
            if child.poll() is None:
                os.killpg(child.pid, signal.SIGKILL)
            child.wait()
            child.stdout.close()
    assert killed  # or it was too quick, and this shows nothing
    out = tmp_path / "out"
    if sink == "files":
        found = in_order(spark.read.parquet(str(out)))
    else:
        found = (
            ds.dataset(out, exclude_invalid_files=True).to_table().sort_by([("t", "ascending"), ("asset", "ascending")])
        )
    assert seconds(found).tolist() == table["t"].tolist()
    assert_same(found, expected(table, est)[1])


@pytest.mark.slow
def test_the_page_runs(spark, tmp_path):
    """The code of docs/spark.md, in a folder of its own."""
    import re

    (tmp_path / "landing").mkdir()
    page = Path(__file__).parents[3] / "docs" / "spark.md"
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(), re.S)
    assert len(blocks) == 2
    scope: dict = {}
    for block in blocks:
        for name in ("landing", "checkpoint", "estimates"):
            block = block.replace(f'"{name}"', repr(str(tmp_path / name)))
        exec(compile(block, str(page), "exec"), scope)
    scope["query"].processAllAvailable()
    scope["query"].stop()
    assert (tmp_path / "checkpoint" / "metadata").exists()
