"""Spark on tables: a cluster gives the numbers of one machine, bit for bit, whatever happens to rows and processes."""

import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from spark_tables import COLUMNS, assert_same, assert_same_states, expected, frame, in_order, plants, rows

import driftwise as dw
from driftwise.engine.errors import InputError
from driftwise.fleet.spark import parcel
from driftwise.fleet.spark.many import COUNTS, Many, Samples
from driftwise.fleet.spark.shipped import ship

# --- without Spark: what a worker does ---------------------------------------------------------------------


def test_a_series_as_bytes_comes_back_whole_or_is_refused():
    rng, est = np.random.default_rng(0), dw.AR(1)
    settings = parcel.digest(est)
    row = rng.standard_normal(9)
    row[3] = np.frombuffer(b"\x01\x02\x03\x04\x05\x06\xf8\x7f")[0]  # a NaN that carries something
    one = parcel.Parcel(row, -np.inf, np.arange(len(COUNTS)) * 1.0, rng.standard_normal((4, 3)))
    blob = parcel.pack(settings, one)
    for part, again in zip(one, parcel.unpack(settings, blob)):
        assert np.asarray(part).tobytes() == np.asarray(again).tobytes()
    none = parcel.unpack(settings, parcel.pack(settings, one._replace(waiting=np.empty((0, 3)))))
    assert none.waiting.size == 0
    for broken in (b"", blob[:-1], blob[:40] + b"?" + blob[41:], b"xyz" + blob[3:]):
        with pytest.raises(InputError, match="state"):
            parcel.unpack(settings, broken)
    with pytest.raises(InputError, match="other settings"):
        parcel.unpack(parcel.digest(dw.AR(1, memory=dw.ExponentialForgetting(0.9))), blob)
    with pytest.raises(InputError, match="update it"):
        parcel.unpack(settings, blob[:3] + bytes([parcel.VERSION + 1]) + blob[4:])


def test_samples_are_taken_once_in_order_of_time_however_they_are_cut():
    rng, shipped = np.random.default_rng(1), ship(dw.AR(1))
    seconds = np.sort(rng.integers(0, 40, (3, 60)) * 1.0)
    seconds[:, -2:] = np.nan
    ys = rng.standard_normal((3, 60))
    several = []
    for cuts in ([], [20], [7, 31, 33], range(1, 60)):
        many = Many(shipped)
        at, shown = many.rows_of(list("abc")), []
        for part in np.split(np.arange(60), cuts):
            one = [np.repeat(at, len(part)), seconds[:, part].ravel(), np.zeros(3 * len(part), bool)]
            taken, outs = many.take(Samples(*one, ys[:, part].reshape(-1, 1), np.empty((3 * len(part), 0))))
            shown.append(np.column_stack([taken.at, taken.seconds, outs]))
        several.append(np.concatenate(shown)[np.lexsort(np.concatenate(shown)[:, 1::-1].T)].tobytes())
        for i in range(3):
            times = seconds[i, :-2]
            first = [list(times).index(t) for t in sorted(set(times))]
            counts = dict(zip(COUNTS, many.counts[i]))
            assert (
                counts["samples"] == len(first) and counts["duplicate"] == 58 - len(first) and counts["timeless"] == 2
            )
            est = dw.AR(1)
            state = est.start()
            for y in ys[i, first]:
                state, _ = est.update(state, y)
            assert state.tobytes() == many.fleet.state("abc"[i]).tobytes()
    assert len(set(several)) == 1


# --- a table -----------------------------------------------------------------------------------------------


def test_a_table_in_any_order_gives_the_numbers_of_one_machine(spark):
    table, est = plants(), dw.AR(1)
    fleet, columns = expected(table, est)
    rng = np.random.default_rng(1)
    order = rng.permutation(len(table["y"]))
    df = frame(spark, rows(table, order))
    found = in_order(dw.fleet.spark.scan(df, est, **COLUMNS))
    assert found["asset"].to_pylist() == table["asset"].tolist() and found["t"].to_pylist() == table["t"].tolist()
    assert_same(found, columns)
    half = dw.fleet.spark.scan_states(df.where("t < 1030"), est, **COLUMNS)
    rest = in_order(dw.fleet.spark.scan_states(df.where("t >= 1020"), est, **COLUMNS, state=half), "asset")
    assert_same_states(fleet, dw.fleet.spark.fleet_of(rest, est, by="asset"))
    assert set(rest["samples"].to_pylist()) == {60} and set(rest["late"].to_pylist()) == {9}
    assert set(rest["duplicate"].to_pylist()) == {1}
    assert rest["parameters"].to_pylist() == [fleet.state(key)["theta"].tolist() for key in range(7)]
    for wrong, words in (
        (dict(by="aset"), "Did you mean 'asset'"),
        (dict(output=["y", "y"]), "has 1 output, got 2"),
        (dict(time="y", by="y"), "no name of a series"),
    ):
        with pytest.raises(InputError, match=words):
            dw.fleet.spark.scan(df, est, **COLUMNS | wrong)
    with pytest.raises(InputError, match="is a table, not a stream"):
        dw.fleet.spark.stream(df, est, **COLUMNS)


@pytest.mark.slow
@pytest.mark.parametrize("partitions", [1, 5])
def test_many_series_of_very_different_length(spark, partitions):
    """1000 series, the longest a hundred times the shortest, two inputs of which one is text."""
    rng = np.random.default_rng(2)
    lengths = np.linspace(5, 500, 1000).astype(int)
    keys = rng.permutation(np.repeat([f"pump {i}" for i in range(1000)], lengths))
    n = len(keys)
    u, t = rng.standard_normal(n), np.arange(n) / 8
    y = np.concatenate([[0.0], u[:-1]]) + 0.1 * rng.standard_normal(n)
    y[::17] = np.nan
    est = dw.ARX(1, 1)
    fleet = dw.Fleet(est)
    step = fleet.scan(keys, y, u)
    order = rng.permutation(n)
    text = np.array([repr(float(value)) for value in u])
    df = frame(spark, {"asset": keys[order], "t": t[order], "y": y[order], "u": text[order]}, partitions)
    names = dict(**COLUMNS, input="u")
    found = in_order(dw.fleet.spark.scan(df, est, **names), "t")
    assert_same(found, {"prediction": step.prediction, "innovation": step.innovation, "std": np.sqrt(step.variance)})
    states = dw.fleet.spark.scan_states(df, est, **names)
    assert_same_states(fleet, dw.fleet.spark.fleet_of(states, est, by="asset"))
    some = dw.fleet.spark.scan(df, est, **names, keep="std", every=50).toArrow()
    assert len(some) == np.sum(lengths // 50)
    one = some.filter(np.array(some["asset"].to_pylist()) == "pump 999").sort_by("t")
    trace = est.scan(y[keys == "pump 999"], u[keys == "pump 999"])
    assert one["parameters"].to_pylist() == trace.parameters[49::50].tolist()
    assert one["parameters_std"].to_pylist() == trace.parameters_std[49::50].tolist()


@pytest.mark.slow
def test_tables_change_their_shape(spark):
    """A column comes, another is whole numbers first, the order of columns changes; other types of time; bad cells."""
    from pyspark.sql import functions as F

    table, est = plants(), dw.AR(1)
    table["y"] = np.round(8 * table["y"])
    fleet, _ = expected(table, est)
    early = table["t"] < 1030
    first = frame(spark, rows(table, early)).withColumn("y", F.when(~F.isnan("y"), F.col("y").cast("int")))
    second = frame(spark, rows(table, ~early)).select(F.lit("new").alias("colour"), "y", "t", "asset")
    assert first.schema["y"].dataType.simpleString() == "int"
    both = first.unionByName(second, allowMissingColumns=True)
    fresh = dict(est=est, by="asset")
    assert_same_states(fleet, fleet_at_end(both, **fresh))
    begun = dw.fleet.spark.scan_states(first.withColumn("asset", F.col("asset").cast("int")), est, **COLUMNS)
    assert_same_states(fleet, fleet_at_end(second, **fresh, state=begun))
    for kind in ("timestamp", "timestamp_ntz", "int"):
        as_date = "timestamp_seconds(t)" if kind == "timestamp" else "cast(t as int)"
        if kind == "timestamp_ntz":
            as_date = "timestampadd(SECOND, cast(t as int), timestamp_ntz'1970-01-01')"
        other = both.withColumn("t", F.expr(as_date))
        assert other.schema["t"].dataType.simpleString() == kind
        found = dw.fleet.spark.scan(other, est, **COLUMNS)
        assert found.schema["t"].dataType == other.schema["t"].dataType
        assert found.where("asset = 3").agg(F.min("t")).first() == other.where("asset = 3").agg(F.min("t")).first()
        assert_same_states(fleet, fleet_at_end(other, **fresh))
    words = both.withColumn("y", F.when(F.isnan("y"), F.lit("n/a")).otherwise(F.col("y").cast("string")))
    spoiled = words.withColumn("y", F.when(F.col("t") == 1005, "oops").otherwise(F.col("y")))
    states = dw.fleet.spark.scan_states(spoiled, est, **COLUMNS)
    assert {row.bad for row in states.collect()} == {1}
    table["y"][table["t"] == 1005] = np.nan
    assert_same_states(expected(table, est)[0], dw.fleet.spark.fleet_of(states, est, by="asset"))


def fleet_at_end(df, est, by, **more):
    return dw.fleet.spark.fleet_of(dw.fleet.spark.scan_states(df, est, **COLUMNS, **more), est, by=by)


def test_other_versions_and_sources_are_told():
    from driftwise.fleet.spark import shipped

    est = dw.AR(1)
    sent = ship(est)
    assert shipped.unship(sent).spec.tolist() == est.spec.tolist()
    with pytest.raises(InputError, match="install one of them"):
        shipped.unship(sent._replace(version="0.0.1"))
    with pytest.raises(InputError, match="of different sources"):
        shipped.unship(sent._replace(fingerprint=1))


LOUD = """
from typing import NamedTuple

from driftwise.detect.watch import OWN, STATISTIC, watch


class Loud(NamedTuple):
    bound: float

    def state_size(self, parameters):
        return OWN


@watch.on(Loud)
def _(detector, marks, z, slope):
    marks[STATISTIC] = abs(z) / detector.bound
    return 1.0 if z >= detector.bound else -1.0 if -z >= detector.bound else 0.0
"""
POORLY_EQUIPPED = """
import sys, pyspark, driftwise as dw, driftwise.fleet.spark, loud
from spark_tables import *

names = ("DRIFTWISE_CACHE", "XDG_CACHE_HOME", "HOME")
nowhere = {f"spark.executorEnv.{name}": "/proc/nowhere" for name in names}
session = local_session(pyspark, **nowhere, **{"spark.executorEnv.PYTHONPATH": sys.argv[1]})
session.addArtifact(loud.__file__, pyfile=True)
table = plants()
restart = dw.RestartOnChange(loud.Loud(2.0), dw.memory.CovarianceInflation(0.01), 9)
own = dw.Joint(1, noise=dw.models.EquationError(0.5), memory=restart)
for est in (dw.AR(1), own):
    fleet, columns = expected(table, est)
    assert_same(in_order(dw.fleet.spark.scan(frame(session, table), est, **COLUMNS)), columns)
assert np.any(columns["status"] & int(dw.Status.JUMP))

def where(batches):
    import driftwise, pyarrow, tempfile
    list(batches)
    from driftwise.engine import objects
    driftwise.Fleet(driftwise.AR(1)).crew.loop(4)
    found = [driftwise.__file__, str(str(objects.folder()).startswith(tempfile.gettempdir()))]
    yield pyarrow.RecordBatch.from_arrays([pyarrow.array(found)], ["found"])

print(*(row.found for row in session.range(1).coalesce(1).mapInArrow(where, "found string").collect()))
session.stop()
"""


@pytest.mark.slow
def test_executors_that_can_cache_nothing_and_a_policy_of_ones_own(tmp_path, spark):
    """The package of the workers lies where nothing can be written, as their home does; they cache for the moment."""
    import subprocess

    package = Path(dw.__file__).parent
    copy = tmp_path / "other" / "driftwise"
    shutil.copytree(package, copy, ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "loud.py").write_text(LOUD)
    paths = [str(package.parent), str(Path(__file__).parent), str(tmp_path / "own")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    command = [sys.executable, "-c", POORLY_EQUIPPED, str(copy.parent)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    assert done.stdout.split() == [str(copy / "__init__.py"), "True"]


def test_a_policy_of_a_notebook_is_refused(monkeypatch):
    kind = type("Mine", (type(dw.AR(1).policies[2]),), {"__module__": "__main__"})
    est = dw.AR(1)
    monkeypatch.setattr(est, "policies", (*est.policies[:2], kind(*est.policies[2]), *est.policies[3:]))
    with pytest.raises(InputError, match="Mine is defined in __main__"):
        ship(est)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["parquet", "csv"])
def test_a_run_on_spark_writes_what_one_machine_writes(spark, tmp_path, kind):
    """Two files with keys in their folders or cells; late, duplicate and keyless rows, gaps, bad cells, silence."""
    import pyarrow as pa
    import pyarrow.csv
    import pyarrow.parquet as pq

    from driftwise.fleet.fleet_run import run_fleet
    from driftwise.fleet.job import FleetJob
    from driftwise.fleet.spark import run_on_spark

    table, rng = plants(length=300), np.random.default_rng(5)
    table["y"][(table["asset"] < 2) & (abs(table["t"] - 1150) < 80)] = np.nan  # silence is an event
    order = np.argsort(table["t"] + 3 * (rng.random(len(table["t"])) < 0.01), kind="stable")
    table = rows(table, order[rng.random(len(order)) > 0.03])
    words = [None if i % 97 == 0 else f"plant {key}" for i, key in enumerate(table["asset"])]
    cells = ["oops" if i % 101 == 0 else "" if np.isnan(y) else repr(float(y) + 50) for i, y in enumerate(table["y"])]
    whole = pa.table({"asset": words, "t": table["t"], "y": cells, "u": rng.standard_normal(len(words))})
    write = pq.write_table if kind == "parquet" else pyarrow.csv.write_csv
    for i in range(2):
        folder = tmp_path / "data" / f"line={i}"
        folder.mkdir(parents=True)
        half = len(words) // 2
        write(whole.slice(i * half, half), folder / f"part.{kind}")
    results = []
    for run, out in ((run_fleet, "here"), (run_on_spark, "there")):
        given = dict(by="asset", output="y", inputs=["u"], time="t", dt=1.0, every=7, batch=500)
        found = run(FleetJob(tmp_path / "data", estimator=dw.ARX(1, 1), out=tmp_path / out, **given))
        results.append(found)
    here, there = results
    assert here.rows == there.rows and here.events == there.events > 0
    assert here.keyless == there.keyless > 0
    assert_same_states(here.fleet, there.fleet)
    again = dw.Fleet.load(tmp_path / "there" / "fleet.parquet")
    assert_same_states(here.fleet, again)
    assert [again.estimator_of(key).spec.tolist() for key in here.fleet.keys] == [
        here.fleet.estimator_of(key).spec.tolist() for key in here.fleet.keys
    ]
    for name in ("estimates", "final.parquet", "events.parquet"):
        one, other = (pq.read_table(tmp_path / out / name) for out in ("here", "there"))
        by = [(column, "ascending") for column in ("key", "sample", "row", "kind") if column in one.column_names]
        assert len(one) and one.schema == other.schema
        for column in one.column_names:
            values, others = (found.sort_by(by)[column].combine_chunks() for found in (one, other))
            assert repr(values.to_pylist()) == repr(others.to_pylist()), (name, column)
    with pytest.raises(InputError, match="holds a run already"):
        run_on_spark(FleetJob(tmp_path / "data", estimator=dw.ARX(1, 1), out=tmp_path / "here", **given))
