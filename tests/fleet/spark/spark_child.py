"""A query in a process of its own, to be killed: `python spark_child.py FOLDER STORE SINK`."""

import sys
from pathlib import Path

import pyspark
from spark_tables import COLUMNS, PROVIDER, ROCKS, local_session

import driftwise as dw
import driftwise.fleet.spark

SCHEMA = "asset long, t timestamp, y double"


def start(spark, folder: Path, sink: str):
    """Follow the files of a folder, one after the other, to its end."""
    df = spark.readStream.schema(SCHEMA).option("maxFilesPerTrigger", 1).parquet(str(folder / "in"))
    found = dw.fleet.spark.stream(df, dw.AR(1), **COLUMNS, watermark="25 seconds")
    write = found.writeStream.option("checkpointLocation", str(folder / "checkpoint")).trigger(availableNow=True)
    if sink == "files":
        return write.format("parquet").start(str(folder / "out"))

    def put(batch, number):
        """Write a batch under its number: once more gives the same."""
        batch.write.mode("overwrite").parquet(str(folder / "out" / f"batch={number}"))

    return write.foreachBatch(put).start()


if __name__ == "__main__":
    folder, store, sink = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
    session = local_session(pyspark, **({PROVIDER: ROCKS} if store == "rocks" else {}))
    query = start(session, folder, sink)
    print("started", flush=True)
    query.awaitTermination()
    session.stop()
