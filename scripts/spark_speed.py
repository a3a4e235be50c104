"""What Spark costs beside one machine: CPU seconds of all its processes for the same samples (docs/spark.md).

    python scripts/spark_speed.py [MILLIONS]

Wall time on a shared machine says little, so CPU time is counted: of the JVM and of all Python workers.
"""

import os
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from pyspark.sql import SparkSession

import driftwise as dw
import driftwise.fleet.spark

NAMES = dict(by="asset", output="y", time="t")
ROCKS = "org.apache.spark.sql.execution.streaming.state.RocksDBStateStoreProvider"
TICK = os.sysconf("SC_CLK_TCK")


SEEN: dict[int, float] = {}  # CPU seconds of each process below this one, those that have ended included


def watch() -> None:
    """Note what all processes below this one have spent, for as long as it lives."""
    while True:
        note()
        time.sleep(0.2)


def note() -> None:
    parents, times = {}, {}
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                fields = (folder / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            pid = int(folder.name)
            parents[pid], times[pid] = int(fields[1]), sum(map(int, fields[11:13])) / TICK
    family: set[int] = set()
    more = {os.getpid()}
    while more != family:
        family = more
        more = {pid for pid, parent in parents.items() if parent in family} | family
    SEEN.update({pid: times[pid] for pid in family if pid in times})


def spent() -> float:
    """Return the CPU seconds of this process and of all below it."""
    note()
    return sum(SEEN.values())


def timed(work) -> tuple[float, float]:
    """Return CPU and wall seconds."""
    cpu, wall = spent(), time.perf_counter()
    work()
    return spent() - cpu, time.perf_counter() - wall


def session() -> SparkSession:
    os.environ["PYSPARK_PYTHON"] = sys.executable
    builder = SparkSession.builder.master("local[2]").config("spark.ui.enabled", "false")
    builder = builder.config("spark.ui.showConsoleProgress", "false").config("spark.driver.memory", "4g")
    spark = (
        builder.config("spark.sql.shuffle.partitions", "4")
        .config("spark.sql.streaming.stateStore.providerClass", ROCKS)
        .getOrCreate()
    )
    spark.sparkContext.setLogLevel("OFF")
    return spark


def table(series: int, rows: int, path: Path) -> None:
    """Write a table of so many rows, the samples of all series in turn."""
    rng, length = np.random.default_rng(1), rows // series
    asset, t = np.tile(np.arange(series), length), np.repeat(np.arange(float(length)), series)
    pq.write_table(pa.table({"asset": asset, "t": t, "y": rng.standard_normal(len(t))}), path, row_group_size=1 << 18)


def one_machine(path, est) -> None:
    found = pq.read_table(path)
    fleet = dw.Fleet(est)
    fleet.scan(found["asset"].to_numpy(), found["y"].to_numpy())


def by_group(df, est):
    """Return the same by `applyInArrow`, a call for each series: what `scan` does not do, and why."""

    def work(table):
        found = table.sort_by("t")
        fleet = dw.Fleet(est, ["one"], threads=1)
        outs = fleet.advance(
            np.zeros(len(found), np.int64), found["y"].to_numpy().reshape(-1, 1), np.empty((len(found), 0))
        )
        return pa.table({"asset": found["asset"], "prediction": outs[:, 0]})

    return df.groupBy("asset").applyInArrow(work, "asset long, prediction double")


def nowhere(df) -> None:
    df.write.format("noop").mode("overwrite").save()


def main(millions: float) -> None:
    threading.Thread(target=watch, daemon=True).start()
    est, rows = dw.AR(1), int(1e6 * millions)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "table.parquet"
        holder: list = []
        cpu, wall = timed(lambda: holder.append(session()))
        spark = holder[0]
        print(f"start of Spark: {cpu:.1f} s CPU, {wall:.1f} s wall")
        warm = Path(folder) / "warm.parquet"
        table(100, 10_000, warm)
        cpu, wall = timed(lambda: nowhere(dw.fleet.spark.scan(spark.read.parquet(str(warm)), est, **NAMES)))
        print(f"first job (workers start, code is compiled or read): {cpu:.1f} s CPU, {wall:.1f} s wall")
        one_machine(warm, est)
        print(f"\n{millions:g} million samples, CPU seconds per million | one machine | scan | applyInArrow by series")
        for series in (100, 10_000, 100_000):
            table(series, rows, path)
            df = spark.read.parquet(str(path))
            found = [
                timed(lambda: one_machine(path, est))[0],
                timed(lambda: nowhere(dw.fleet.spark.scan(df, est, **NAMES)))[0],
                timed(lambda: nowhere(by_group(df, est)))[0],
            ]
            print(f"{series:>8} series | " + " | ".join(f"{cpu / millions:.2f}" for cpu in found), flush=True)
        follow(spark, est, Path(folder))
        spark.stop()


def follow(spark, est, folder: Path) -> None:
    """Print what a stretch of a stream costs: 1000 series, one file at a time."""
    from pyspark.sql import functions as F

    (folder / "in").mkdir()
    rng, series, length = np.random.default_rng(1), 1000, 100
    for i in range(4):
        asset, t = np.tile(np.arange(series), length), np.repeat(np.arange(i * length, (i + 1) * length), series)
        columns = {"asset": asset, "t": t, "y": rng.standard_normal(len(t))}
        pq.write_table(pa.table(columns), folder / "in" / f"{i}.parquet")
    df = (
        spark.readStream.schema("asset long, t long, y double")
        .option("maxFilesPerTrigger", 1)
        .parquet(str(folder / "in"))
    )
    found = dw.fleet.spark.stream(df.withColumn("t", F.timestamp_seconds("t")), est, **NAMES, watermark="10 seconds")
    write = found.writeStream.format("noop").option("checkpointLocation", str(folder / "state"))
    holder: list = []
    cpu, _ = timed(lambda: (holder.append(write.trigger(availableNow=True).start()), holder[0].awaitTermination()))
    batches = [p["durationMs"]["triggerExecution"] / 1e3 for p in holder[0].recentProgress if p["numInputRows"]]
    print(
        f"\nstream, {series} series, {length} samples of each in a file: {cpu / 4:.1f} s CPU a file; "
        f"wall time of each {', '.join(f'{seconds:.1f}' for seconds in batches)} s"
    )


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 2.0)
