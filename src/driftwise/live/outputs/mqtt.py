"""Events and estimates to topics of an MQTT broker, with what Home Assistant needs to find them."""

from __future__ import annotations

import asyncio
import json
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

from ...engine.errors import InputError
from ..board import EventView
from ..sources.mqtt import introduced, needed
from .base import Estimate, message

WORDS = re.compile(r"[^\w-]+")  # what no identifier of Home Assistant may hold


@dataclass(frozen=True)
class MqttOutput:
    """Publishes ``PREFIX/events/KEY`` (QoS 1) and ``PREFIX/estimates/KEY`` (QoS 0, the last one retained).

    ``discovery``: the prefix under which Home Assistant looks, "homeassistant"; "" leaves it alone.
    """

    url: str
    prefix: str = "driftwise"
    events: bool = True
    estimates: bool = False
    discovery: str = ""
    user_env: str = "DRIFTWISE_MQTT_USER"
    password_env: str = "DRIFTWISE_MQTT_PASSWORD"
    password_file: str = ""
    ca_file: str = ""

    def __post_init__(self):
        parts = urlsplit(self.url)
        if parts.scheme not in ("mqtt", "mqtts") or not parts.hostname or parts.password:
            raise InputError("url is mqtt://HOST[:PORT] or mqtts://HOST, without a password")

    @property
    def name(self) -> str:
        parts = urlsplit(self.url)
        return f"{parts.scheme}://{parts.hostname}/{self.prefix}"

    def plan(self) -> str:
        what = " and ".join(word for word, on in (("events", self.events), ("estimates", self.estimates)) if on)
        return f"publish {what or 'nothing'} under {self.name}"

    async def run(self, queue: Any, note: Callable[[str, str], None], delivered: Callable[[str, int], None]) -> None:
        client, announced = self._client(note), set[str]()
        try:
            while True:
                items = await queue.get()
                last = 0
                for item in items:
                    if isinstance(item, EventView):
                        sent = client.publish(f"{self.prefix}/events/{item.key}", json.dumps(message(item)), qos=1)
                        last = item.number
                    elif client.is_connected():
                        self._announce(client, item.key, announced)
                        client.publish(f"{self.prefix}/estimates/{item.key}", _estimate(item), retain=True)
                if last:
                    while not sent.is_published():
                        await asyncio.sleep(0.002)
                    delivered(self.name, last)
        finally:
            client.disconnect()
            await asyncio.to_thread(client.loop_stop)

    def _client(self, note: Callable[[str, str], None]) -> Any:
        paho, parts = needed(), urlsplit(self.url)
        client = paho.Client(paho.CallbackAPIVersion.VERSION2, protocol=paho.MQTTv5)
        introduced(client, self)
        client.reconnect_delay_set(1, 30)
        client.on_connect = lambda c, u, f, reason, p: note(self.name, str(reason) if reason.is_failure else "")
        client.on_disconnect = lambda c, u, f, reason, p: note(self.name, f"the broker is gone ({reason})")
        client.connect_async(parts.hostname, parts.port or (8883 if parts.scheme == "mqtts" else 1883))
        client.loop_start()
        return client

    def _announce(self, client: Any, key: str, announced: set[str]) -> None:
        """Tell Home Assistant of a series, once."""
        if not self.discovery or key in announced:
            return
        announced.add(key)
        word = WORDS.sub("_", key)
        sensor = {
            "name": key, "unique_id": f"driftwise_{word}", "state_topic": f"{self.prefix}/estimates/{key}",
            "value_template": "{{ value_json.output }}", "json_attributes_topic": f"{self.prefix}/events/{key}",
        }  # fmt: skip
        client.publish(f"{self.discovery}/sensor/driftwise_{word}/config", json.dumps(sensor), qos=1, retain=True)


def _estimate(item: Estimate) -> str:
    """Return an estimate as JSON, what is not there as null."""
    return json.dumps({k: None if isinstance(v, float) and math.isnan(v) else v for k, v in item._asdict().items()})
