"""Samples that come: each series in order of event time, its state in Spark's state store."""

from __future__ import annotations

import functools
import math
from typing import Any, NamedTuple

import numpy as np

from ...engine.errors import InputError
from .batch import STATE
from .columns import KEY, SECONDS, Order, order_of, quoted, read, samples, shown, shown_columns, time_again
from .many import DUPLICATE, LATE, TIMELESS, Many, Samples
from .parcel import Parcel, digest, pack, unpack

COUNTED = {"late": LATE, "duplicate": DUPLICATE, "timeless": TIMELESS}
ROCKS = "org.apache.spark.sql.execution.streaming.state.RocksDBStateStoreProvider"
PROVIDER = "spark.sql.streaming.stateStore.providerClass"
CLOCK = "clock"


def stream(
    df,
    estimator,
    *,
    by: str,
    output,
    input=(),
    time: str,
    watermark: str = "10 minutes",
    keep: str = "innovations",
    every: int = 1,
    state=None,
):
    """Return what samples show as they come: a streaming DataFrame of key, time, prediction, innovation, std, status.

    A sample waits until the watermark has passed its time, and is then taken in order of time within its series: the
    numbers are those of one machine on the sorted table, bit for bit. Started again from its checkpoint, a query goes
    on where it was: nothing lost, nothing twice (with a sink that keeps the same promise, such as files).

    Parameters
    ----------
    df : streaming DataFrame
    estimator, by, output, input, keep, every : as for `scan`
    time : column of timestamps, or of seconds since 1970
    watermark : how long to wait for samples that come late, such as "10 minutes"
    state : DataFrame, optional
        From `scan_states`: where series go on from. Read when the query first starts; needs the RocksDB state store.

    Returns
    -------
    DataFrame
        As from `scan`, and ``late``, ``duplicate`` and ``timeless``: how many samples of the series were not taken, so
        far, because a later one, or one of the same time, had been, or they had no time. A sample behind the watermark
        that is still after the last one taken of its series is taken.

    Raises
    ------
    InputError
        Where columns or settings do not fit.

    Notes
    -----
    Where the session has the RocksDB state store (``spark.sql.streaming.stateStore.providerClass``) the operator is
    ``transformWithState``, otherwise ``applyInPandasWithState``; a checkpoint belongs to one of them.

    Bad at: answers within milliseconds (a sample waits for the watermark, and Spark for its next batch), and many
    samples in the time of one watermark, which all wait in the state store.
    """
    order = order_of(df, estimator, by, output, input, time, keep, every)
    if not df.isStreaming:
        raise InputError("df is a table, not a stream: use driftwise.fleet.spark.scan, or read it by spark.readStream")
    kind = df.schema[order.by].dataType.simpleString()
    columns = [(KEY, kind), (SECONDS, "double"), *shown_columns(order), *((name, "long") for name in COUNTED)]
    schema = ", ".join(f"{name} {kind}" for name, kind in columns)
    rows = samples(df, order)
    session: Any = df.sparkSession
    if session.conf.get(PROVIDER, "") == ROCKS:
        found = _with_state(rows, order, schema, watermark, state)
    elif state is None:
        found = _with_group_state(rows, order, schema, watermark)
    else:
        raise InputError(f"state needs the RocksDB state store: spark.conf.set({PROVIDER!r}, {ROCKS!r}) before")
    rest = [_full(name) if kind == "double" else quoted(name) for name, kind in columns[2:]]
    found = found.selectExpr(quoted(KEY), SECONDS, *rest).withColumn(SECONDS, time_again(df, order.time))
    return found.withColumnsRenamed({KEY: order.by, SECONDS: order.time})


def _full(name):
    """Return the expression of a column of numbers: pandas makes NULL of NaN, and here it becomes NaN again."""
    return f"coalesce({quoted(name)}, double('NaN')) as {quoted(name)}"


# --- one series at a time, whoever calls ------------------------------------------------------------------


class Followed(NamedTuple):
    """What came of new samples of one series."""

    blob: bytes  # its new state
    frame: Any  # what the samples taken showed, a pandas frame
    wake: int | None  # watermark, ms, at which more can be taken
    was: int | None  # what `wake` was before


@functools.lru_cache(4)
def _bench(order: Order):
    """Return a fleet with room for one series, how a series begins, and the digest: once for each process."""
    many = Many(order.shipped, order.keep, order.every)
    many.rows_of([KEY])
    width = 2 + len(order.outputs) + len(order.inputs)
    return many, many.get(0, np.empty((0, width))), digest(many.estimator)


def follow(order: Order, key, blob, frames, watermark: int) -> Followed:
    """Take those samples of a series, new and waiting, that lie before the watermark (ms), in order of time."""
    many, fresh, settings = _bench(order)
    parcel = fresh if blob is None else unpack(settings, blob)
    waiting = np.concatenate([parcel.waiting.reshape(-1, fresh.waiting.shape[1]), *(_rows(order, f) for f in frames)])
    waiting = waiting[np.lexsort([*waiting[:, :1:-1].T, waiting[:, 0]])]  # by time, then values; NaN comes last
    held = waiting[:, 0] >= watermark / 1000
    now, p = waiting[~held], len(order.outputs)
    many.put(0, parcel)
    at = np.zeros(len(now), np.int64)
    values = (np.ascontiguousarray(part) for part in (now[:, 2 : 2 + p], now[:, 2 + p :]))
    taken, outs = many.take(Samples(at, now[:, 0].copy(), now[:, 1] > 0, *values))
    after = many.get(0, waiting[held])
    return Followed(pack(settings, after), _frame(order, many, key, taken, outs), _wake(after), _wake(parcel))


def _rows(order, frame):
    """Return the samples of a pandas frame as rows of numbers: time, bad, y, u."""
    import pyarrow as pa

    columns = [pa.array(frame[name], from_pandas=True) for name in frame.columns if name not in (KEY, CLOCK)]
    found = read(order, columns, None)
    return np.column_stack([found.seconds, found.bad, found.ys, found.us])


def _wake(parcel: Parcel) -> int | None:
    """Return the watermark, in ms, that lies after the first of the samples that wait (sorted)."""
    return math.floor(parcel.waiting[0, 0] * 1000) + 1 if len(parcel.waiting) else None


def _frame(order, many, key, taken, outs):
    import pandas as pd

    columns = {KEY: [key] * len(outs), SECONDS: taken.seconds}
    for (name, _), values in zip(shown_columns(order), shown(order, many, outs)):
        columns[name] = values.to_numpy(zero_copy_only=False)
    counts = {name: np.full(len(outs), many.counts[0, at], np.int64) for name, at in COUNTED.items()}
    return pd.DataFrame(columns | counts)


# --- Spark's two operators ---------------------------------------------------------------------------------


def _clocked(rows, watermark, chosen):
    """Return the rows with a watermark on a column beside: on ``seconds`` Spark would drop late rows unseen."""
    from pyspark.sql import functions as F

    clock = F.when(chosen, F.timestamp_micros(F.round(F.col(SECONDS) * 1e6).cast("long")))
    return rows.withColumn(CLOCK, clock).withWatermark(CLOCK, watermark)


def _with_state(rows, order, schema, watermark, state):
    """Return what `transformWithState` gives; its pandas form takes whole columns, and is in Spark 4.0 too."""
    from pyspark.sql import functions as F
    from pyspark.sql.streaming import StatefulProcessor

    class Series(StatefulProcessor):
        """The state of a series, its timer, and nothing else."""

        def init(self, handle):
            self.handle, self.value = handle, handle.getValueState("series", "state binary")

        def handleInputRows(self, key, rows, timerValues):
            return self._follow(key[0], rows, timerValues)

        def handleExpiredTimer(self, key, timerValues, expiredTimerInfo):
            return self._follow(key[0], (), timerValues)

        def handleInitialState(self, key, initialState, timerValues):
            self.value.update((initialState[STATE].iloc[0],))

        def _follow(self, key, frames, timers):
            found = follow(order, key, _first(self.value.get()), frames, timers.getCurrentWatermarkInMs())
            self.value.update((found.blob,))
            if found.wake != found.was:
                if found.was is not None:
                    self.handle.deleteTimer(found.was)
                if found.wake is not None:
                    self.handle.registerTimer(found.wake)
            yield found.frame

        def close(self):
            pass

    begun = None
    if state is not None:
        kind = rows.schema[KEY].dataType
        begun = state.select(F.col(quoted(order.by)).cast(kind).alias(KEY), F.col(STATE)).groupBy(KEY)
    grouped = _clocked(rows, watermark, F.lit(True)).drop(CLOCK).groupBy(KEY)
    return grouped.transformWithStateInPandas(Series(), schema, "Append", "EventTime", begun)


def _with_group_state(rows, order, schema, watermark):
    """Return what `applyInPandasWithState` gives, for other state stores.

    It wants the watermark's column, and drops rows by it: so one copy of each row has the time, moves the watermark and
    ends there, and the other has none and is taken.
    """
    from pyspark.sql import functions as F
    from pyspark.sql.streaming.state import GroupStateTimeout

    def work(key, frames, group):
        now = group.getCurrentWatermarkMs()
        found = follow(order, key[0], _first(group.getOption), () if group.hasTimedOut else frames, now)
        group.update((found.blob,))
        if found.wake is not None:
            group.setTimeoutTimestamp(max(found.wake, now + 1))
        yield found.frame

    twice = rows.withColumn("is_clock", F.explode(F.array(F.lit(True), F.lit(False))))
    clocked = _clocked(twice, watermark, F.col("is_clock")).where(F.col(CLOCK).isNull()).drop("is_clock")
    return clocked.groupBy(KEY).applyInPandasWithState(
        work, schema, "state binary", "append", GroupStateTimeout.EventTimeTimeout
    )


def _first(found):
    return None if found is None else found[0]
