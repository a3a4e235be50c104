"""`driftwise track --listen` at a socket: Ctrl-C loses nothing that has come, a lost connection its last piece only."""

import io
import json
import signal
import socket
import threading

import pyarrow.csv
import pytest

from driftwise.cli import listen as listening
from driftwise.cli.follow import asked_to_stop
from driftwise.tracking import sockets
from driftwise.tracking.tracker import Tracker
from driftwise.tracking.wire import Wire

LINES = [json.dumps({"time": 1.7e9 + 4 * k, "lat": 46 + 0.005 * k, "lon": 15.0, "id": "K"}) for k in range(60)]


class Interrupting(Wire):
    """A wire during whose first packets Ctrl-C is pressed."""

    def take(self, packets):
        if packets and not self.kind and not self.lines.kind:
            signal.raise_signal(signal.SIGINT)
        return super().take(packets)


def counted(url, wire):
    tracker = Tracker(250.0)
    listening.listen(url, wire, tracker, True, 12.0)
    return tracker.counts["plots"], [fault.what for fault in tracker.faults]


@pytest.fixture
def unread(monkeypatch):
    """A listener that takes one piece of 100 bytes at a time."""
    monkeypatch.setattr(sockets, "MOST", 1)
    monkeypatch.setattr(sockets, "LONGEST", 100)


def test_datagrams_that_wait_when_the_end_is_asked_for_are_tracked(monkeypatch, unread):
    def sent(url):
        source = sockets.Listener(url)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for line in LINES:
                sender.sendto(line.encode(), ("127.0.0.1", port))
        return source

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    monkeypatch.setattr(listening, "Listener", sent)
    assert counted(f"udp://127.0.0.1:{port}", Interrupting("udp", False)) == (len(LINES), [])


def test_lines_of_a_stream_that_wait_when_the_end_is_asked_for_are_tracked(unread):
    with socket.create_server(("127.0.0.1", 0)) as server:

        def send():
            there, _ = server.accept()
            with there:
                there.sendall("".join(f"{line}\n" for line in LINES).encode())

        sender = threading.Thread(target=send)
        sender.start()
        url = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        assert counted(url, Interrupting("tcp", True))[0] == len(LINES)
        sender.join()


def test_who_never_stops_sending_does_not_keep_us_from_stopping(monkeypatch, unread):
    monkeypatch.setattr(sockets, "BUFFER", 1000)
    with socket.create_server(("127.0.0.1", 0)) as server:
        client = sockets.Listener(f"tcp://127.0.0.1:{server.getsockname()[1]}")
        there, _ = server.accept()
        with there:
            there.sendall(bytes(5000))
            pieces = [packet.data for packets in client.waiting() for packet in packets]
        client.close()
    assert 0 < len(b"".join(pieces)) <= 1000


class Counting(Wire):
    """A wire that says when so many plots have come."""

    def __init__(self, enough):
        super().__init__("tcp", True)
        self.left, self.is_over = enough, threading.Event()

    def take(self, packets):
        found = super().take(packets)
        self.left -= len(found) if found is not None else 0
        if self.left <= 0:
            self.is_over.set()
        return found


def test_the_piece_of_a_line_at_which_a_connection_is_lost_spoils_no_other(monkeypatch):
    monkeypatch.setattr(sockets, "WAIT", (0.05, 0.1))
    wire = Counting(len(LINES) - 1)
    with socket.create_server(("127.0.0.1", 0)) as server:

        def send():
            for part in ("\n".join(LINES[:20])[:-9], "".join(f"{line}\n" for line in LINES[20:])):
                there, _ = server.accept()
                with there:
                    there.sendall(part.encode())
            wire.is_over.wait(10.0)
            signal.raise_signal(signal.SIGINT)

        sender = threading.Thread(target=send)
        sender.start()
        plots, faults = counted(f"tcp://127.0.0.1:{server.getsockname()[1]}", wire)
        sender.join()
    assert plots == len(LINES) - 1
    assert any("cut off where the connection was lost" in what for what in faults)


class Broken(io.RawIOBase):
    """A table while which is read Ctrl-C is pressed, and which then breaks off."""

    def readable(self):
        return True

    def read(self, size=-1):
        signal.raise_signal(signal.SIGINT)
        raise OSError("gone")


def test_ctrl_c_is_heard_while_a_table_is_read_that_is_refused():
    with asked_to_stop() as asked:
        with pytest.raises(OSError, match="gone"):
            pyarrow.csv.read_csv(Broken())
        assert asked(), "pyarrow takes signals while it reads, and hands on none where it fails by something else"
