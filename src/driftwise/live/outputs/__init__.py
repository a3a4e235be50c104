"""Where events and estimates go, by the ``kind`` of an [[out]]."""

from .log import LogOutput
from .mqtt import MqttOutput
from .webhook import WebhookOutput

OUTPUTS: dict[str, type] = {"log": LogOutput, "mqtt": MqttOutput, "webhook": WebhookOutput}
