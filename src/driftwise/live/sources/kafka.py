"""Topics of Apache Kafka; not tried against a broker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...engine.errors import InputError
from ..decode import Shape, chunks
from .base import Inbox, Parcel


@dataclass(frozen=True)
class KafkaSource:
    """Topics of Kafka, from where the last commit was: offsets are kept with the states. Untested against a broker."""

    servers: str
    topic: str
    key_field: str = "key"
    time_field: str = "time"
    time_unit: str = "s"

    @property
    def name(self) -> str:
        return f"kafka {self.servers} {self.topic}"

    def plan(self) -> str:
        return f"read {self.topic} at {self.servers}, from the offsets of the last commit"

    async def run(self, inbox: Inbox, place: Any) -> None:
        try:
            from aiokafka import AIOKafkaConsumer, TopicPartition
        except ImportError:
            raise InputError("Kafka needs aiokafka: pip install 'driftwise[kafka]'") from None
        offsets: dict[str, int] = dict(place or {})
        consumer = AIOKafkaConsumer(
            bootstrap_servers=self.servers, enable_auto_commit=False, auto_offset_reset="earliest"
        )
        shape = Shape(self.key_field, self.time_field, self.time_unit)
        await consumer.start()
        try:
            parts = [TopicPartition(self.topic, n) for n in sorted(consumer.partitions_for_topic(self.topic) or {0})]
            consumer.assign(parts)
            for part in parts:
                if str(part.partition) in offsets:
                    consumer.seek(part, offsets[str(part.partition)])
            async for message in consumer:
                offsets[str(message.partition)] = message.offset + 1
                key = message.key.decode("utf-8", "replace") if message.key else self.topic
                size = len(message.value or b"")
                refused: tuple[str, ...] = ()
                try:
                    found = chunks(message.value or b"", key, shape)
                except InputError as error:
                    found, refused = [], (f"{key}: {error}",)
                await inbox.put(Parcel(found, None, (self.name, dict(offsets)), refused, size))
        finally:
            await consumer.stop()
