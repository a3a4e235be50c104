"""What Prometheus scrapes: totals, and numbers of each series as far as there are not too many."""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from math import nan

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.exposition import choose_encoder
from prometheus_client.registry import Collector, CollectorRegistry

from driftwise.live.board import SeriesView

LABEL = 200  # characters of a key
KINDS = ("jump", "drift", "noise", "stuck", "lost", "outliers", "silent", "back", "model", "clock")
STATES = ("identifying", "warming up", "well", *KINDS)
NUMBERS = {
    "output": "Last output, in the unit of the data",
    "prediction": "Prediction of the last output before it came",
    "nis": "Mean squared surprise over its variance, 1 where error bars are true",
    "score": "Who needs a look: the larger, the sooner; 0 needs none",
    "time": "Seconds since 1970 of the last sample",
}


class Picture(Collector):
    """The metrics of one moment.

    Labels are bounded: states are a fixed list, and only the first `limit` series that ever came have numbers of their
    own, so that a million keys cannot fill the memory of the scraper; the others are counted in
    ``driftwise_series_unlisted``.
    """

    def __init__(self, views: list[SeriesView], health: Mapping, counters: Mapping[str, float], limit: int):
        self.views, self.health, self.counters, self.limit = views, health, counters, limit

    def collect(self) -> Iterable[Metric]:
        yield from self._totals()
        listed = self.views[: self.limit]
        for name, about in NUMBERS.items():
            family = GaugeMetricFamily(f"driftwise_series_{name}", about, labels=["series"])
            for view in listed:
                value = getattr(view, name)
                family.add_metric([_label(view.key)], nan if value is None else value)
            yield family
        alarm = GaugeMetricFamily(
            "driftwise_series_alarm", "1 while a series has an event that nobody acknowledged", labels=["series"]
        )
        for view in listed:
            alarm.add_metric([_label(view.key)], float(not view.acknowledged))
        yield alarm

    def _totals(self) -> Iterable[Metric]:
        for name, value in sorted(self.counters.items()):
            plain = re.sub(r"[^a-z0-9_]", "_", name.lower())
            yield CounterMetricFamily(f"driftwise_{plain}", f"Total of {name} since the start", value=value)
        found = Counter(view.status if view.status in STATES else "other" for view in self.views)
        family = GaugeMetricFamily("driftwise_series", "Series by state", labels=["state"])
        for state in (*STATES, "other"):
            family.add_metric([state], found[state])
        yield family
        waiting = sum(not view.acknowledged for view in self.views)
        yield GaugeMetricFamily("driftwise_alarms", "Series with an event that nobody acknowledged", value=waiting)
        unlisted = max(len(self.views) - self.limit, 0)
        yield GaugeMetricFamily("driftwise_series_unlisted", "Series without numbers of their own here", value=unlisted)
        for name in ("ready", "healthy"):
            about = f"1 while the service is {name}"
            yield GaugeMetricFamily(f"driftwise_{name}", about, value=float(bool(self.health.get(name))))


def _label(key: str) -> str:
    """Return a key that is not too long; what is cut off is told apart by a hash."""
    if len(key) <= LABEL:
        return key
    return f"{key[: LABEL - 9]}~{hashlib.sha256(key.encode(errors='replace')).hexdigest()[:8]}"


def exposition(picture: Picture, accept: str) -> tuple[bytes, str]:
    """Return text and media type in the format that the scraper asked for."""
    registry = CollectorRegistry(auto_describe=False)
    registry.register(picture)
    encoder, media = choose_encoder(accept)
    return encoder(registry), media
