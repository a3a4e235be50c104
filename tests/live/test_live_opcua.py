"""A subscription to an OPC-UA server, which comes back after it was gone."""

import asyncio
import socket

import pytest

from driftwise.live.sources.opcua import OpcuaSource

pytest.importorskip("asyncua")


class Inbox:
    def __init__(self):
        self.parcels, self.notes = [], {}

    def push(self, parcel):
        self.parcels.append(parcel)

    def note(self, source, words):
        self.notes[source] = words

    @property
    def values(self):
        return [chunk.fields["flow"][0] for parcel in self.parcels for chunk in parcel.chunks]


async def until(condition):
    for _ in range(3000):
        if condition():
            return
        await asyncio.sleep(0.01)
    raise AssertionError("it did not come to pass in time")


async def subscribed():
    from asyncua import Server

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        url = f"opc.tcp://127.0.0.1:{free.getsockname()[1]}/plant"
    server = Server()
    await server.init()
    server.set_endpoint(url)
    space = await server.register_namespace("plant")
    node = await server.nodes.objects.add_variable(f"ns={space};s=Flow", "Flow", 1.5)
    inbox = Inbox()
    source = OpcuaSource(url, {f"ns={space};s=Flow": "pump 7:flow"}, period=20)
    async with server:
        task = asyncio.create_task(source.run(inbox, None))
        try:
            await until(lambda: inbox.values == [1.5])
            await node.write_value(2.5)
            await until(lambda: inbox.values == [1.5, 2.5])
            assert inbox.notes[source.name] == ""
            chunk = inbox.parcels[-1].chunks[0]
            assert chunk.key == "pump 7" and chunk.time[0] > inbox.parcels[0].chunks[0].time[0] > 1e9
        finally:
            task.cancel()
            await asyncio.wait([task])


def test_nodes_are_fields_of_series():
    asyncio.run(asyncio.wait_for(subscribed(), 60))
