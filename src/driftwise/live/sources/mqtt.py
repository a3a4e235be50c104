"""MQTT 5: messages are acknowledged after they are committed, so that none is lost whatever is killed."""

from __future__ import annotations

import asyncio
import dataclasses
import os
import re
import socket
from dataclasses import dataclass
from typing import Any
from urllib.parse import unquote, urlsplit

from ...engine.errors import InputError
from ..decode import PER_SECOND, Shape, chunks
from .base import Inbox, Parcel

UNDER_WAY = 5000  # messages that the broker hands over without an acknowledgement
KEPT = 7 * 86_400  # s that the broker keeps the session while nobody is there
LEVEL = re.compile(r"\{(\d+|topic)\}")


@dataclass(frozen=True)
class MqttSource:
    """Topics of a broker, wildcards allowed.

    Attributes
    ----------
    url : mqtt://HOST[:PORT], mqtts:// with TLS; a user may stand in it, a password may not
    topics : to subscribe to
    key : of a message that names none: "{topic}", or levels of it, from 0: "{1}/{2}"
    field : of a message that is a plain number: "value", or a level: "{3}"
    key_field, time_field, time_unit : as for files
    client : name of the session, under which the broker keeps what comes meanwhile
    qos : 1: nothing is lost; 0: quicker
    user_env, password_env, password_file : where the credentials are
    ca_file : certificates that vouch for the broker, where those of the system do not
    """

    url: str
    topics: tuple[str, ...]
    key: str = "{topic}"
    field: str = "value"
    key_field: str = "key"
    time_field: str = "time"
    time_unit: str = "s"
    client: str = dataclasses.field(default_factory=lambda: f"driftwise-{socket.gethostname()}")
    qos: int = 1
    user_env: str = "DRIFTWISE_MQTT_USER"
    password_env: str = "DRIFTWISE_MQTT_PASSWORD"
    password_file: str = ""
    ca_file: str = ""

    def __post_init__(self):
        parts = urlsplit(self.url)
        if parts.scheme not in ("mqtt", "mqtts") or not parts.hostname:
            raise InputError(f"url is mqtt://HOST[:PORT] or mqtts://HOST, got {self.shown!r}")
        if parts.password:
            raise InputError("url holds a password: put it into a file (password_file) or into the environment")
        if not self.topics:
            raise InputError("topics lists what to subscribe to, got none")
        if self.qos not in (0, 1):
            raise InputError(f"qos is 0 or 1, got {self.qos}")
        if self.time_unit not in PER_SECOND:
            raise InputError(f"time_unit is one of {', '.join(PER_SECOND)}, got {self.time_unit!r}")

    @property
    def shown(self) -> str:
        """The address without what is secret."""
        return re.sub(r"//[^@/]*@", "//", self.url)

    @property
    def name(self) -> str:
        return f"{self.shown} {' '.join(self.topics)}"

    def plan(self) -> str:
        return f"subscribe to {', '.join(self.topics)} at {self.shown} as {self.client}, QoS {self.qos}"

    async def run(self, inbox: Inbox, place: Any) -> None:
        client = self._client(inbox)
        parts = urlsplit(self.url)
        try:
            client.connect_async(
                parts.hostname, parts.port or (8883 if parts.scheme == "mqtts" else 1883), clean_start=False,
                properties=_session(),
            )  # fmt: skip
            inbox.note(self.name, "connecting")
            client.loop_start()
            await asyncio.Event().wait()
        finally:
            client.disconnect()
            await asyncio.to_thread(client.loop_stop)

    def _client(self, inbox: Inbox) -> Any:
        """Return a client that hands over what comes."""
        paho = needed()
        client = paho.Client(
            paho.CallbackAPIVersion.VERSION2, client_id=self.client, protocol=paho.MQTTv5, manual_ack=self.qos > 0
        )
        client.reconnect_delay_set(1, 30)
        introduced(client, self)
        shape = Shape(self.key_field, self.time_field, self.time_unit)

        def connected(client, userdata, flags, reason, properties):
            if reason.is_failure:
                inbox.note(self.name, f"refused by the broker: {reason}")
                return
            inbox.note(self.name, "")
            client.subscribe([(topic, self.qos) for topic in self.topics])

        def gone(client, userdata, flags, reason, properties):
            inbox.note(self.name, f"the broker is gone ({reason}); trying again")

        def came(client, userdata, message):
            done = (lambda mid=message.mid: client.ack(mid, 1)) if message.qos else None
            inbox.push(self.parcel(message.topic, message.payload, shape, done))

        client.on_connect, client.on_disconnect, client.on_message = connected, gone, came
        return client

    def parcel(self, topic: str, payload: bytes, shape: Shape, done=None) -> Parcel:
        """Return what a message brings."""
        try:
            found = chunks(payload, _filled(self.key, topic), shape)
        except InputError as error:
            return Parcel([], done, None, (f"{topic}: {error}",), len(payload))
        if self.field != "value":
            name = _filled(self.field, topic)
            found = [
                chunk._replace(fields={name if field == "value" else field: v for field, v in chunk.fields.items()})
                for chunk in found
            ]
        return Parcel(found, done, None, (), len(payload))


def _filled(pattern: str, topic: str) -> str:
    """Return a pattern with the levels of a topic in their places."""
    if pattern == "{topic}":
        return topic
    levels = topic.split("/")

    def one(found: re.Match) -> str:
        if found[1] == "topic":
            return topic
        at = int(found[1])
        return levels[at] if at < len(levels) else ""

    return LEVEL.sub(one, pattern)


def _session() -> Any:
    """Return the wishes for a connection: the session is kept, so many messages at a time."""
    from paho.mqtt.packettypes import PacketTypes
    from paho.mqtt.properties import Properties

    wishes = Properties(PacketTypes.CONNECT)
    wishes.SessionExpiryInterval = KEPT
    wishes.ReceiveMaximum = UNDER_WAY
    return wishes


def introduced(client: Any, settings: Any) -> None:
    """Give a client its credentials, and TLS for an address mqtts://."""
    parts = urlsplit(settings.url)
    user, password = _credentials(settings, parts)
    if user:
        client.username_pw_set(user, password)
    if parts.scheme == "mqtts":
        try:
            client.tls_set(settings.ca_file or None)
        except OSError as error:
            raise InputError(f"ca_file {settings.ca_file} cannot be read: {error}") from None


def _credentials(settings: Any, parts: Any) -> tuple[str | None, str | None]:
    """Return user and password from the address, a file and the environment."""
    user = unquote(parts.username) if parts.username else os.environ.get(settings.user_env)
    if settings.password_file:
        try:
            with open(settings.password_file, encoding="utf-8") as file:
                return user, file.read().strip()
        except OSError as error:
            raise InputError(f"password_file {settings.password_file} cannot be read: {error.strerror}") from None
    return user, os.environ.get(settings.password_env)


def needed() -> Any:
    """Return paho-mqtt."""
    try:
        from paho.mqtt import client
    except ImportError:
        raise InputError("MQTT needs paho-mqtt: pip install 'driftwise[live]'") from None
    return client
