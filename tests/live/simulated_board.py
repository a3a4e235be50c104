"""A board of simulated pumps behind real estimators: each tick one sample of every series through a `Fleet`."""

import asyncio
import dataclasses
import time

import numpy as np

import driftwise as dw
from driftwise.engine.status import Status
from driftwise.fleet.fleet_snapshot import census
from driftwise.live.board import SPARKLINE, EventView, ParameterRow, ParameterView, Receipt, Row, SeriesView

A, B, NOISE = 0.8, 0.5, 0.05
KEPT = 600  # samples of a history


class Simulated:
    """A `Board`; `tick` takes one sample of each of some series, all of them if omitted."""

    def __init__(self, keys, seed=0, at=None, broken=()):
        self.keys, self.rng = list(keys), np.random.default_rng(seed)
        self.fleet = dw.Fleet(dw.ARX(1, 1, memory=dw.RestartOnChange()), self.keys)
        self.time = time.time() if at is None else at
        self.broken = set(broken)
        n = len(self.keys)
        self.y, self.u = np.zeros(n), np.zeros(n)
        self.rows = {key: [] for key in self.keys}
        self.past = {key: [] for key in self.keys}
        self.views = {key: SeriesView(key, key, "m3/h", model="arx:1,1") for key in self.keys}
        self.told, self.revision, self.revised = [], 0, {}
        self.posted, self.is_healthy = [], True

    def tick(self, keys=None, census_too=True):
        self.time += 1.0
        keys = self.keys if keys is None else keys
        index = {key: k for k, key in enumerate(self.keys)}
        at = np.array([index[key] for key in keys])
        gain = np.array([3 * B if key in self.broken else B for key in keys])
        self.y[at] = A * self.y[at] + gain * self.u[at] + NOISE * self.rng.normal(size=len(at))
        self.u[at] = np.where(self.rng.random(len(at)) < 0.1, self.rng.normal(size=len(at)), self.u[at])
        step = self.fleet.update_batch(keys, self.y[at], self.u[at])
        found = census(self.fleet) if census_too else None
        self.revision += 1
        for k, key in enumerate(keys):
            self._show(key, at[k], [np.asarray(column)[k] for column in step], found)

    def _show(self, key, at, step, found):
        prediction, _, variance, status = step
        y, std, old, rows = float(self.y[at]), float(np.sqrt(variance)), self.views[key], self.rows[key]
        rows.append(Row(self.time, y, float(prediction), std, int(status)))
        del rows[:-KEPT]
        if int(status) & Status.JUMP:
            self.happened(key, "jump", "b1 jumped: gain of the bearing moved")
            old = self.views[key]
        parameters = old.parameters
        if found is not None:
            columns = zip(found.names, found.theta[at], found.std[at])
            parameters = tuple(ParameterView(n, float(v), float(s)) for n, v, s in columns)
            self.past[key] += [ParameterRow(self.time, *one) for one in parameters]
        square = (y - prediction) ** 2 / variance if variance > 0 else 1.0
        ahead, level = [], y
        for h in range(5):
            level = A * level + B * float(self.u[at])
            half = 1.96 * NOISE * (1 + h) ** 0.5
            ahead.append((level, level - half, level + half))
        status = "warming up" if old.count < 20 else "well"
        self.views[key] = dataclasses.replace(
            old,
            count=old.count + 1,
            time=self.time,
            output=y,
            prediction=float(prediction),
            band=(float(prediction) - 1.96 * std, float(prediction) + 1.96 * std),
            ahead=tuple(ahead),
            parameters=parameters,
            status=status,
            nis=float(square) if old.nis is None else 0.95 * old.nis + 0.05 * float(square),
            sparkline=(*old.sparkline[1 - SPARKLINE :], y),
        )
        self.revised[key] = self.revision

    def happened(self, key, kind, sentence):
        """Tell an event of a series."""
        seen = EventView(len(self.told) + 1, key, self.time, kind, sentence, 1.3)
        self.told.append(seen)
        self._note(key)
        return seen

    def _note(self, key):
        mine = [seen for seen in self.told if seen.key == key]
        waiting = sum(not seen.acknowledged for seen in mine)
        old = self.views[key]
        status = mine[-1].kind if waiting else "well"
        self.views[key] = dataclasses.replace(
            old, last_event=mine[-1], acknowledged=not waiting, score=float(waiting), status=status
        )
        self.revision += 1
        self.revised[key] = self.revision

    def series(self):
        return [self.views[key] for key in self.keys]

    def view(self, key):
        return self.views[key]

    def history(self, key, start=None, end=None):
        rows = self.rows[key]
        return [row for row in rows if (start is None or row.time >= start) and (end is None or row.time <= end)]

    def parameters(self, key, start=None, end=None):
        rows = self.past[key]
        return [row for row in rows if (start is None or row.time >= start) and (end is None or row.time <= end)]

    def events(self, since=0, key=None, most=None, latest=False):
        found = [seen for seen in self.told if seen.number > since and key in (None, seen.key)]
        return found[-most:] if latest and most else found[:most]

    def acknowledge(self, number):
        if not 0 < number <= len(self.told):
            raise KeyError(number)
        self.told[number - 1] = seen = dataclasses.replace(self.told[number - 1], acknowledged=True)
        self._note(seen.key)
        return seen

    def changes(self, after):
        return self.revision, [key for key, revision in self.revised.items() if revision > after]

    async def changed(self, after):
        while self.revision <= after:
            await asyncio.sleep(0.01)
        return self.revision

    def health(self):
        return {"ready": True, "healthy": self.is_healthy, "sources": {}, "store": {}, "notes": []}

    def counters(self):
        return {"samples": float(sum(view.count for view in self.views.values())), "late": 0.0}

    async def put(self, samples):
        self.posted += samples
        return Receipt(len(samples), 0)
