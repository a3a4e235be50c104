"""A whole table: `scan` for what every sample showed, `scan_states` for where each series ends."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...engine.errors import InputError
from .columns import KEY, SECONDS, Order, order_of, quoted, read, samples, shown, shown_columns, time_again
from .many import Many
from .parcel import COUNTS, digest, pack, unpack

STATE = "state"
GATHER = 1 << 16  # rows taken at a time: small against what Spark holds, large against the cost of a call


def scan(df, estimator, *, by: str, output, input=(), time: str, keep="innovations", every: int = 1, state=None):
    """Return what every sample of a table showed: a DataFrame of key, time, prediction, innovation, std, status.

    The numbers are those of `Fleet.scan` on the same samples in order of time, bit for bit, however the table is
    partitioned and in whatever order its rows stand.

    Parameters
    ----------
    df : DataFrame of Spark
    estimator : the settings of each series, in the units of its data
    by : column whose values name the series; rows without one are left out
    output, input : columns, one name or several, in the order of the estimator's outputs and inputs
    time : column of times or numbers that order the samples of a series
    keep : "innovations", "means" or "std"
        Adds ``parameters`` and ``parameters_std``, arrays in the order of ``estimator.names``.
    every : int
        Show each so-manieth sample of a series only; all are taken.
    state : DataFrame, optional
        From `scan_states`: series go on from there, others begin afresh.

    Raises
    ------
    InputError
        Where columns or settings do not fit. An executor with another driftwise fails the job and says so.

    Notes
    -----
    Two samples of one series at one time are a duplicate: the one with the smaller output is taken, measured before
    missing. Samples not after the last one of ``state`` are late. Neither is shown: `scan_states` counts them.

    A series is one worker's: ten large ones keep ten cores busy and no more. Memory does not grow with the length of
    a series. Bad at: small tables, for which starting takes longer than one machine needs for everything.
    """
    order = order_of(df, estimator, by, output, input, time, keep, every)
    sorted_rows = _sorted(df, order, state)
    kind = df.schema[order.by].dataType.simpleString()
    columns = [(KEY, kind), (SECONDS, "double"), *shown_columns(order)]
    found = sorted_rows.mapInArrow(_estimating(order), ", ".join(f"{quoted(name)} {kind}" for name, kind in columns))
    rest = [quoted(name) for name, _ in columns[2:]]
    return found.select(_named(KEY, order.by), time_again(df, order.time).alias(order.time), *rest)


def scan_states(df, estimator, *, by: str, output, input=(), time: str, state=None):
    """Return where each series ends: a DataFrame of key, time, counts, ``parameters``, and ``state`` (binary).

    ``samples`` counts those taken, ``measured`` those with an output, ``late``, ``duplicate`` and ``timeless`` those
    not taken, ``bad`` those with a cell that is no number. Parameters are as in `scan`. Hand the table to ``scan`` or
    ``scan_states`` to go on with samples to come, or to `fleet_of` to go on without Spark.
    """
    order = order_of(df, estimator, by, output, input, time, "innovations", 1)
    kind = df.schema[order.by].dataType.simpleString()
    columns = [(KEY, kind), (SECONDS, "double"), *((name, "long") for name in COUNTS)]
    columns += [("parameters", "array<double>"), (STATE, "binary")]
    schema = ", ".join(f"{name} {kind}" for name, kind in columns)
    found = _sorted(df, order, state).mapInArrow(_ending(order), schema)
    rest = [name for name, _ in columns[2:]]
    return found.select(_named(KEY, order.by), time_again(df, order.time).alias(order.time), *rest)


def fleet_of(states, estimator, *, by: str):
    """Return a `Fleet` on this machine that goes on where ``states`` end.

    Parameters
    ----------
    states : DataFrame from `scan_states`, or the same as a pyarrow Table
    estimator : the one they were made by
    by : the column of keys
    """
    from ..fleet import Fleet

    table = states.select(quoted(by), STATE).toArrow() if hasattr(states, "toArrow") else states
    keys, settings = table[by].to_pylist(), digest(estimator)
    fleet = Fleet(estimator, keys)
    for i, blob in enumerate(table[STATE].to_pylist()):
        fleet._rows[i] = unpack(settings, blob).row
    return fleet


def _named(column, name):
    from pyspark.sql import functions as F

    return F.col(column).alias(name)


def _sorted(df, order: Order, state):
    """Return the samples, each series on one worker, in order of time; where it goes on from stands first."""
    from pyspark.sql import functions as F

    rows = samples(df, order)
    values = rows.columns[2:]
    by = [F.col(KEY), F.col(SECONDS).asc_nulls_last(), *(F.col(name).asc_nulls_last() for name in values)]
    if state is None:
        return rows.repartition(F.col(KEY)).sortWithinPartitions(*by)
    if not {order.by, STATE} <= set(state.columns):
        raise InputError(f"state must have the columns {order.by!r} and 'state' of scan_states, got {state.columns}")
    kind = rows.schema[KEY].dataType
    begun = state.select(F.col(quoted(order.by)).cast(kind).alias(KEY), F.col(STATE))
    both = rows.unionByName(begun, allowMissingColumns=True)
    return both.repartition(F.col(KEY)).sortWithinPartitions(by[0], F.col(STATE).asc_nulls_last(), *by[1:])


def gathered(batches):
    """Yield tables of about `GATHER` rows."""
    import pyarrow as pa

    held: list[Any] = []
    for batch in batches:
        held.append(batch)
        if sum(map(len, held)) >= GATHER:
            yield pa.Table.from_batches(held).combine_chunks()
            held = []
    if held:
        yield pa.Table.from_batches(held).combine_chunks()


def _taken(order: Order, many: Many, batches):
    """Yield (names, samples shown, columns of each) of each stretch of the table."""
    settings = digest(many.estimator)
    for table in gathered(batches):
        if not len(table):
            continue
        codes = table[KEY].combine_chunks().dictionary_encode()
        names = codes.dictionary.to_pylist()
        at = many.rows_of(names)[codes.indices.to_numpy(zero_copy_only=False)]
        columns = [table[name] for name in table.column_names if name not in (KEY, STATE)]
        found = read(order, columns, at)
        if STATE in table.column_names:
            blobs = table[STATE].combine_chunks()
            begun = blobs.is_valid().to_numpy(zero_copy_only=False)
            for i in np.flatnonzero(begun):
                many.put(at[i], unpack(settings, blobs[i].as_py()))
            found = found.part(~begun)
        yield many.take(found)


def _keys(many: Many, at, kind):
    """Return the Arrow array of the keys of rows."""
    import pyarrow as pa

    first, place = np.unique(at, return_inverse=True)
    keys = many.fleet.keys
    return pa.array([keys[i] for i in first], kind).take(pa.array(place))


def _estimating(order: Order):
    """Return what a worker does to a partition for `scan`."""

    def work(batches):
        import pyarrow as pa

        many = Many(order.shipped, order.keep, order.every)
        first = next(batches, None)
        if first is None:
            return
        kind = first.schema.field(KEY).type
        names = [KEY, SECONDS, *(name for name, _ in shown_columns(order))]
        for taken, outs in _taken(order, many, _chain(first, batches)):
            columns = [_keys(many, taken.at, kind), pa.array(taken.seconds), *shown(order, many, outs)]
            yield pa.RecordBatch.from_arrays(columns, names)

    return work


def _ending(order: Order):
    """Return what a worker does to a partition for `scan_states`."""

    def work(batches):
        import pyarrow as pa

        many = Many(order.shipped)
        first = next(batches, None)
        if first is None:
            return
        kind = first.schema.field(KEY).type
        for _ in _taken(order, many, _chain(first, batches)):
            pass
        settings, states = digest(many.estimator), many.fleet.states
        for begin in range(0, len(many.fleet), GATHER):
            rows = range(begin, min(begin + GATHER, len(many.fleet)))
            last = many.last[rows.start : rows.stop]
            columns = [
                _keys(many, np.array(rows), kind),
                pa.array(last, mask=np.isinf(last)),
                *(pa.array(many.counts[rows.start : rows.stop, i].astype(int)) for i in range(len(COUNTS))),
                pa.array(states["theta"][rows.start : rows.stop].tolist(), pa.list_(pa.float64())),
                pa.array([pack(settings, many.get(i)) for i in rows], pa.binary()),
            ]
            yield pa.RecordBatch.from_arrays(columns, [KEY, SECONDS, *COUNTS, "parameters", STATE])

    return work


def _chain(first, rest):
    yield first
    yield from rest
