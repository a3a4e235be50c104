"""`identify`: a table, a frame or columns in; the model, its changes and its trust out, nothing to be said."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..tables.autoread import gathered
from .directions import read_settled
from .events import events_of
from .identification import Finder
from .identifier import joined
from .seasons import checked
from .table_together import together_of


def identify(
    data,
    output: str | None = None,
    input=None,
    time: str | None = None,
    dt: float | None = None,
    season=None,
):
    """Return what a record says about the plant behind it: model, changes, forecast, verdicts; nothing to tune.

    Parameters
    ----------
    data : file name, data frame, or mapping from column name to array
        A CSV (any dialect) or Parquet file, a frame of pandas, Polars or pyarrow, or columns.
    output, input, time : str, optional
        Columns, where they are known: the clock may be numbers or instants (several inputs: a list; none: ()). What is
        left out is recognised by name and behaviour, and said.
    dt : float, optional
        Seconds between rows, where no column says so.
    season : int, or several, optional
        Samples of a season that the output may have: 12 of months, (24, 168) of hours. If omitted, day, week and year
        as the clock suggests them; () for none.

    Returns
    -------
    Identification
        ``print`` it for the answer in words. Where the columns can be read in two ways, ``is_ambiguous``:
        ``alternatives`` has both, and the answer is that of the likelier one.

    Raises
    ------
    InputError
        No such file or column, nothing to identify.

    Notes
    -----
    Candidates (AR, ARX, SeasonalARX, ARMA, ARMAX, OE, Joint; orders and delays) predict every sample from those before;
    the one with the fewest parameters among the most likely is taken (prequential evidence, Dawid 1984) and followed
    with `AutoMemory`, which tells drift, jumps and outliers. The forecast is made from all candidates (`ModelAverage`).

    Bad at: several outputs (one is taken), nonlinear plants, delays beyond a quarter of the settling time and forty
    samples, inputs that follow the output in closed loop without excitation of their own: ``found.validate()`` names
    what it sees of these.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=600, noise_std=0.3, seed=1)
    >>> found = dw.identify({"heater": u, "temperature": y})
    >>> found.chosen.name, found.table.output
    ('ARX(2,2,1)', 'temperature')
    """
    seasons = checked(season)
    table, stretches = read_settled(data, output, input, time, dt=dt)
    finder = Finder(table, stretches.origin, seasons, events_of(stretches.table.head, table))
    forecasts: list[Any] = []
    traces: list[Any] = []
    for piece in gathered(stretches):
        forecast, trace = finder.add(*piece)
        forecasts.append(forecast)
        traces.append(trace)
    columns = [np.concatenate([getattr(trace, name) for trace in traces]) for name in ("time", "y", "u", "table")]
    stamps, y, u, outs = columns
    whole = type(traces[0])(finder.estimator, y, u, outs, "std", traces[-1].state, time=stamps)
    whole.begun = traces[0].begun
    common = together_of(stretches.table.head, table)
    return finder.found(whole, joined(forecasts, stamps), stretches.losses(), stretches.clock.breaks, common)
