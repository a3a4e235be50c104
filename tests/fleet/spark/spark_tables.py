"""Tables for Spark, the numbers of one machine for them, and a Spark to try them on."""

import os
import shutil
import sys
from pathlib import Path

import numpy as np

import driftwise as dw

JAVA = shutil.which("java") or os.environ.get("JAVA_HOME")
ROCKS = "org.apache.spark.sql.execution.streaming.state.RocksDBStateStoreProvider"
PROVIDER = "spark.sql.streaming.stateStore.providerClass"
COLUMNS = dict(by="asset", output="y", time="t")


def local_session(pyspark, **more):
    os.environ["PYSPARK_PYTHON"] = sys.executable
    os.environ["PYTHONPATH"] = os.pathsep.join([str(Path(dw.__file__).parent.parent), os.environ.get("PYTHONPATH", "")])
    settings = {
        "spark.ui.enabled": "false", "spark.sql.shuffle.partitions": "2", "spark.driver.memory": "1g",
        "spark.driver.extraJavaOptions": "-XX:TieredStopAtLevel=1 -XX:+UseSerialGC",  # short jobs: half of the time
        "spark.ui.showConsoleProgress": "false", "spark.sql.session.timeZone": "America/New_York", **more,
    }  # fmt: skip
    builder = pyspark.sql.SparkSession.builder.master("local[2]")
    for name, value in settings.items():
        builder = builder.config(name, value)
    session = builder.getOrCreate()
    session.sparkContext.setLogLevel("OFF")
    return session


def plants(series=7, length=60, seed=0):
    """A long table of AR(1) series in order of time, with missing outputs."""
    rng = np.random.default_rng(seed)
    y = rng.standard_normal((length, series))
    for t in range(1, length):
        y[t] += 0.9 * y[t - 1]
    y[:-1][rng.random((length - 1, series)) < 0.05] = np.nan
    t = np.repeat(np.arange(length), series) + 1000.0
    return {"asset": np.tile(np.arange(series), length), "t": t, "y": y.ravel()}


def frame(spark, table, partitions=3):
    import pyarrow as pa

    return spark.createDataFrame(pa.table(table)).repartition(partitions)


def rows(table, chosen):
    return {name: values[chosen] for name, values in table.items()}


def expected(table, estimator):
    """What one machine says, in order of time and key."""
    fleet = dw.Fleet(estimator)
    step = fleet.scan(table["asset"], table["y"])
    return fleet, {
        "prediction": step.prediction,
        "innovation": step.innovation,
        "std": np.sqrt(step.variance),
        "status": step.status.astype(np.int32),
    }


def in_order(found, *by):
    return found.toArrow().sort_by([(name, "ascending") for name in by or ("t", "asset")])


def assert_same(found, columns):
    for name, values in columns.items():
        assert found[name].to_numpy().tobytes() == np.ascontiguousarray(values).tobytes(), name


def assert_same_states(fleet, other):
    assert sorted(fleet.keys) == sorted(other.keys)
    for key in fleet.keys:
        assert fleet.state(key).tobytes() == other.state(key).tobytes()
