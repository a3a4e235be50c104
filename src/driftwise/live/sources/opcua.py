"""Subscriptions to an OPC-UA server."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import Any

from ...engine.errors import InputError
from ..decode import Chunk, number
from .base import Inbox, Parcel

AGAIN = 2.0  # s until a server that is gone is asked again


@dataclass(frozen=True)
class OpcuaSource:
    """Nodes of an OPC-UA server: each is a series, or a field of one.

    Attributes
    ----------
    url : opc.tcp://HOST:PORT/..
    nodes : {"ns=2;s=Pump7.Flow" = "pump 7"}: the key, or "KEY:FIELD"
    period : ms between two looks of the server
    """

    url: str
    nodes: dict[str, str]
    period: int = 100

    def __post_init__(self):
        if not self.url.startswith("opc.tcp://"):
            raise InputError(f"url is opc.tcp://HOST:PORT, got {self.url!r}")
        if not self.nodes:
            raise InputError("nodes names what to subscribe to, got none")

    @property
    def name(self) -> str:
        return self.url

    def plan(self) -> str:
        return f"subscribe to {len(self.nodes)} nodes of {self.url}"

    async def run(self, inbox: Inbox, place: Any) -> None:
        try:
            from asyncua import Client, ua
        except ImportError:
            raise InputError("OPC-UA needs asyncua: pip install 'driftwise[opcua]'") from None
        while True:
            try:
                async with Client(self.url) as client:
                    watch = await client.create_subscription(self.period, _Handler(inbox, self.nodes))
                    await watch.subscribe_data_change([client.get_node(node) for node in self.nodes])
                    inbox.note(self.name, "")
                    while True:
                        await asyncio.sleep(1.0)
                        await client.check_connection()
            except (OSError, ConnectionError, TimeoutError, ua.UaError) as error:
                inbox.note(self.name, f"gone ({error or type(error).__name__}); trying again")
                await asyncio.sleep(AGAIN)


class _Handler:
    """Takes what a subscription tells."""

    def __init__(self, inbox: Inbox, nodes: dict[str, str]):
        self.inbox, self.nodes = inbox, nodes

    def datachange_notification(self, node: Any, value: Any, data: Any) -> None:
        key, _, field = self.nodes[node.nodeid.to_string()].partition(":")
        told = data.monitored_item.Value
        when = told.SourceTimestamp or told.ServerTimestamp
        is_good = told.StatusCode is None or told.StatusCode.is_good()
        try:
            read = number(value if is_good else None, field or "value")
        except InputError as error:
            self.inbox.push(Parcel([], refused=(f"{key}: {error}",)))
            return
        time = when.timestamp() if when and when.tzinfo else _utc(when)
        self.inbox.push(Parcel([Chunk(key, [time], {field or "value": [read]})]))


def _utc(when: Any) -> float:
    """Return an instant of a clock that says no zone, which is UTC by the standard; NaN for none."""
    from datetime import UTC

    return when.replace(tzinfo=UTC).timestamp() if when else float("nan")
