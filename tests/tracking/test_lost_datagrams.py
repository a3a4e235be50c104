"""Datagrams that come faster than they are read: as many as possible wait, and those that are lost are told."""

import signal
import socket
import sys

import pytest

from driftwise.cli import listen as listening
from driftwise.tracking import sockets
from driftwise.tracking.tracker import Tracker
from driftwise.tracking.wire import Wire

LINES = [f'{{"time": {1e9 + k}, "lat": 46.0, "lon": {15.0 + 1e-3 * k:.4f}, "id": "K"}}\n'.encode() for k in range(400)]


class Hurried(sockets.Listener):
    """A listener to whom all is sent before it reads."""

    def __init__(self, url):
        super().__init__(url, pause=0.0)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for line in LINES:
                sender.sendto(line, ("127.0.0.1", self.place.port))


class Ending(Wire):
    """A wire at whose first packets the end is asked for."""

    def take(self, packets):
        if packets:
            signal.raise_signal(signal.SIGINT)
        return super().take(packets)


@pytest.fixture
def url():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        return f"udp://127.0.0.1:{free.getsockname()[1]}"


def heard(url, monkeypatch):
    """Return how many plots came and what was told of those that did not."""
    monkeypatch.setattr(listening, "Listener", Hurried)
    tracker = Tracker(20.0)
    listening.listen(url, Ending("udp", False), tracker, True, 12.0)
    return tracker.counts["plots"], [fault.what for fault in tracker.faults]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems do not say what they threw away")
def test_who_was_too_slow_is_told_how_many_were_lost(url, monkeypatch):
    monkeypatch.setattr(sockets, "BUFFER", 1 << 14)
    came, told = heard(url, monkeypatch)
    assert 0 < came < len(LINES)
    assert told == [f"datagrams came faster than they were read, and were lost: {len(LINES) - came}, this is the first"]


def test_nothing_is_told_where_nothing_was_lost(url, monkeypatch):
    assert heard(url, monkeypatch) == (len(LINES), [])


def test_a_buffer_that_is_refused_is_asked_for_again_by_half():
    class Strict:
        def __init__(self):
            self.asked = []

        def setsockopt(self, level, option, size):
            self.asked.append(size)
            if option != socket.SO_RCVBUF or size > 1 << 21:
                raise OSError("no buffer space available")

    made = Strict()
    sockets._widen(made)
    assert made.asked[-1] == 1 << 21


def test_a_stream_loses_none():
    with socket.create_server(("127.0.0.1", 0)) as server:
        client = sockets.Listener(f"tcp://127.0.0.1:{server.getsockname()[1]}")
        assert client.dropped == 0
        client.close()
        assert client.dropped == 0
