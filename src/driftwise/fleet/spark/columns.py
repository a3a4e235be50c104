"""Which columns of a DataFrame are meant, and what becomes of them: the door of this package."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...engine import validation
from ...engine.errors import InputError
from ...results.trace import KEEP
from ...tables.cells import numbers
from ...tables.source import resolve
from .many import Many, Samples
from .shipped import Shipped, ship

KEY, SECONDS = "key", "seconds"


class Order(NamedTuple):
    """What to do: which columns of what, by which estimator, and how much of it to show."""

    shipped: Shipped
    by: str
    time: str
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: int  # how many the estimator has
    keep: str
    every: int


def needed() -> None:
    """Refuse where there is no Spark, with the remedy."""
    try:
        import pyspark  # noqa: F401
    except ImportError:
        raise ImportError(
            "driftwise.fleet.spark needs Apache Spark: pip install driftwise[spark], and Java 17"
        ) from None


def order_of(df, estimator, by, output, input, time, keep, every) -> Order:
    """Return the order of a call.

    Raises
    ------
    InputError
        Where a column is missing, not of its kind, or their number is not that of the estimator.
    """
    needed()
    if not hasattr(df, "mapInArrow"):
        raise InputError(
            f"df must be a DataFrame of Spark, got {type(df).__name__}: spark.createDataFrame makes one of it"
        )
    names = [resolve(df.columns, name, "output") for name in _listed(output)]
    inputs = [resolve(df.columns, name, "input") for name in _listed(input)]
    shipped = ship(estimator)
    p, k = estimator.outputs or 1, estimator.model.inputs
    for role, found, wanted in (("output", names, p), ("input", inputs, k)):
        if len(found) != wanted:
            raise InputError(
                f"the estimator has {wanted} {role}{'s' * (wanted != 1)}, got {len(found)} columns: {found}"
            )
    validation.one_of("keep", keep, KEEP[:3])
    if keep != "innovations" and p > 1:
        raise InputError('several outputs are shown with keep="innovations" only; scan_states has the parameters')
    by, time = _key(df, resolve(df.columns, by, "key (by=)")), resolve(df.columns, time, "time")
    every = validation.count("every", every, least=1)
    return Order(shipped, by, time, tuple(names), tuple(inputs), len(estimator.names), keep, every)


def _key(df, name: str) -> str:
    from pyspark.sql import types as T

    kind = df.schema[name].dataType
    if not isinstance(kind, T.IntegralType | T.StringType | T.BooleanType | T.DateType):
        raise InputError(
            f"{name!r} is {kind.simpleString()}, no name of a series: cast it, df[{name!r}].cast('string')"
        )
    return name


def _listed(names) -> list:
    return [names] if isinstance(names, str) else list(names)


def samples(df, order: Order):
    """Return the DataFrame of key, seconds and raw values, the only columns that travel; rows without a key stay."""
    from pyspark.sql import functions as F

    values = [*order.outputs, *order.inputs]
    columns = [F.col(quoted(name)).alias(str(i)) for i, name in enumerate(values)]
    key = F.col(quoted(order.by))
    return df.where(key.isNotNull()).select(key.alias(KEY), seconds(df, order.time).alias(SECONDS), *columns)


def seconds(df, name):
    """Return times as seconds: timestamps since 1970 (UTC where they name no zone), numbers as they are."""
    from pyspark.sql import functions as F
    from pyspark.sql import types as T

    kind, column = df.schema[name].dataType, F.col(quoted(name))
    if isinstance(kind, T.NumericType):
        return column.cast("double")
    if isinstance(kind, T.TimestampNTZType):
        epoch = F.lit("1970-01-01").cast("timestamp_ntz")
        return F.timestamp_diff("MICROSECOND", epoch, column) / 1e6
    if isinstance(kind, T.TimestampType):
        return F.unix_micros(column) / 1e6
    if isinstance(kind, T.DateType):
        return F.unix_date(column) * 86400.0
    raise InputError(f"{name!r} is {kind.simpleString()}, no time: cast it, such as F.to_timestamp({name!r})")


def time_again(df, name):
    """Return the column of seconds as times of the type that ``df`` has in column ``name``."""
    from pyspark.sql import functions as F
    from pyspark.sql import types as T

    kind, column = df.schema[name].dataType, F.col(SECONDS)
    if isinstance(kind, T.NumericType):
        return column.cast(kind)
    if isinstance(kind, T.DateType):
        return F.date_from_unix_date((column / 86400).cast("int"))
    micros = F.round(column * 1e6).cast("long")
    if isinstance(kind, T.TimestampNTZType):
        return F.timestamp_add("MICROSECOND", micros, F.lit("1970-01-01").cast("timestamp_ntz"))
    return F.timestamp_micros(micros)


def quoted(name: str) -> str:
    return "`" + name.replace("`", "``") + "`"


def shown_columns(order: Order) -> list[tuple[str, str]]:
    """Return names and types of what a sample shows, after key and time."""
    if len(order.outputs) > 1:
        rest = [f"{what}_{name}" for what in ("prediction", "innovation", "std") for name in order.outputs]
        return [*((name, "double") for name in rest), *((f"status_{name}", "int") for name in order.outputs)]
    columns = [("prediction", "double"), ("innovation", "double"), ("std", "double"), ("status", "int")]
    kept = {"innovations": 0, "means": 1, "std": 2}[order.keep]
    return columns + [("parameters", "array<double>"), ("parameters_std", "array<double>")][:kept]


def shown(order: Order, many: Many, outs) -> list[Any]:
    """Return the Arrow arrays of `shown_columns`."""
    import pyarrow as pa

    p = len(order.outputs)
    columns = [pa.array(outs[:, i]) for i in range(2 * p)]
    columns += [pa.array(np.sqrt(outs[:, i])) for i in range(2 * p, 3 * p)]
    columns += [pa.array(outs[:, i].astype(np.int32)) for i in range(3 * p, 4 * p)]
    m = order.parameters
    for first in {"innovations": [], "means": [many.n], "std": [many.n, many.N + many.n]}[order.keep]:
        values = np.ascontiguousarray(outs[:, many.head + first : many.head + first + m])
        columns.append(
            pa.ListArray.from_arrays(np.arange(len(values) + 1, dtype=np.int32) * m, pa.array(values.ravel()))
        )
    return columns


def read(order: Order, columns, at) -> Samples:
    """Return the samples of Arrow arrays: seconds, then outputs and inputs."""
    seconds, *values = columns
    found = [numbers(column) for column in values]
    stacked = np.column_stack([value for value, _ in found])
    p = len(order.outputs)
    ys, us = np.ascontiguousarray(stacked[:, :p]), np.ascontiguousarray(stacked[:, p:])
    bad = np.any([flags for _, flags in found], axis=0)
    return Samples(at, seconds.to_numpy(zero_copy_only=False).astype(float), bad, ys, us)
