"""Files through rotations, also unseen; lines of a serial port."""

import asyncio
import os
import pty

import pytest

from driftwise.live.decode import Shape
from driftwise.live.sources.files import FileSource
from driftwise.live.sources.mqtt import MqttSource
from driftwise.live.sources.serial import SerialSource


class Inbox:
    """Keeps what it is handed."""

    def __init__(self):
        self.parcels, self.notes = [], {}

    async def put(self, parcel):
        self.parcels.append(parcel)

    push = None

    def note(self, source, words):
        self.notes[source] = words

    @property
    def values(self):
        return [v for parcel in self.parcels for chunk in parcel.chunks for v in chunk.fields["value"]]

    @property
    def place(self):
        return self.parcels[-1].place[1]


async def until(condition):
    for _ in range(2000):
        if condition():
            return
        await asyncio.sleep(0.01)
    raise AssertionError("it did not come to pass in time")


async def followed(source, inbox, place, steps):
    task = asyncio.create_task(source.run(inbox, place))
    try:
        for act, condition in steps:
            act()
            await until(condition)
    finally:
        task.cancel()
        await asyncio.wait([task])


def test_a_file_is_rotated_seen_and_unseen(tmp_path):
    path = tmp_path / "a.csv"
    source, inbox = FileSource(path=str(path)), Inbox()

    def write(mode, text):
        return lambda: path.open(mode).write(text) and None

    def rotate():
        path.rename(tmp_path / "a.csv.1")
        write("w", "time,value\n3,30\n")()

    asyncio.run(followed(source, inbox, None, [
        (write("w", "time,value\n1,10\n"), lambda: inbox.values == [10.0]),
        (write("a", "2,20\n"), lambda: inbox.values == [10.0, 20.0]),
        (rotate, lambda: inbox.values == [10.0, 20.0, 30.0]),
    ]))  # fmt: skip
    place = inbox.place
    write("a", "4,40\n")()  # while nobody looks
    path.rename(tmp_path / "a.csv.2")
    write("w", "value,time\n50,5\n")()
    asyncio.run(followed(source, inbox, place, [(lambda: None, lambda: inbox.values[3:] == [40.0, 50.0])]))
    assert inbox.parcels[-1].chunks[0].time == [5.0]
    asyncio.run(followed(source, inbox, inbox.place, [(write("a", "60,6\n"), lambda: inbox.values[5:] == [60.0])]))


def test_lines_of_a_serial_port():
    pytest.importorskip("serial")
    master, slave = pty.openpty()
    source, inbox = SerialSource(port=os.ttyname(slave), key="scale"), Inbox()
    asyncio.run(followed(source, inbox, None, [
        (lambda: None, lambda: inbox.notes.get(source.name) == ""),
        (lambda: os.write(master, b"1.5\n2.") and None, lambda: inbox.values == [1.5]),
        (lambda: os.write(master, b"5\nrubbish\n") and None, lambda: inbox.values[1:] == [2.5]),
    ]))  # fmt: skip
    assert inbox.parcels[0].chunks[0].key == "scale"
    os.close(master)
    os.close(slave)


def test_keys_and_fields_from_topics():
    source = MqttSource("mqtt://h", ("#",), key="{1}", field="{2}")
    parcel = source.parcel("plant/pump 7/flow", b"3.5", Shape())
    assert [(chunk.key, chunk.fields) for chunk in parcel.chunks] == [("pump 7", {"flow": [3.5]})]
    assert source.parcel("a/b/c", b"{", Shape()).refused
