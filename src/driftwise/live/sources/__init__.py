"""Where samples come from, by the ``kind`` of a [[source]]."""

from .files import FileSource, StdinSource
from .kafka import KafkaSource
from .mqtt import MqttSource
from .opcua import OpcuaSource
from .serial import SerialSource

SOURCES: dict[str, type] = {
    "file": FileSource,
    "kafka": KafkaSource,
    "mqtt": MqttSource,
    "opcua": OpcuaSource,
    "serial": SerialSource,
    "stdin": StdinSource,
}
