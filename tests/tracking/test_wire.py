"""Plots over a wire: whatever comes by UDP or TCP is what a file of it gives; hostile bytes end nothing."""

import json
import signal
import socket
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from hostile.wires import AIS, START, STREAMS, beast, trial

import driftwise as dw
from driftwise.tracking.forgetting import forget
from driftwise.tracking.plots import plots
from driftwise.tracking.read import read_plots
from driftwise.tracking.sockets import Listener, Packet, place
from driftwise.tracking.wire import Wire, capture


def record(seconds, rho, theta):
    """Return an ASTERIX block of category 48: time of day, range (NM), azimuth (degrees)."""
    body = bytes([0b11010000, 25, 201]) + round(seconds * 128).to_bytes(3, "big")
    body += round(rho * 256).to_bytes(2, "big") + round(theta * 65536 / 360).to_bytes(2, "big")
    return bytes([48]) + (3 + len(body)).to_bytes(2, "big") + body


def together(parts):
    """Return times and positions of all plots that came."""
    parts = [part for part in parts if part is not None]
    assert not [fault for part in parts for fault in part.faults]
    return np.concatenate([p.time for p in parts]), np.concatenate([p.position for p in parts])


def test_asterix_by_datagrams_is_the_capture():
    came = [(START + 4 * k, record((START + 4 * k) % 86400, 30 + 0.2 * k, 45 + 0.1 * k)) for k in range(40)]
    wire = Wire("udp", False, sites="25/201=46.2,15.1,800")
    parts = [wire.take([Packet(*one) for one in came[k : k + 3]]) for k in range(0, 40, 3)]
    time, position = together(parts)
    whole = dw.tracking.formats.asterix.read_asterix(capture(came), sites="25/201=46.2,15.1,800")
    np.testing.assert_array_equal(time, whole.time)
    np.testing.assert_allclose(position, whole.position, atol=1e-6)
    assert abs(time[0] - START) < 0.01, "the day is that on which it came"
    stranger = came[0][1].replace(bytes([25, 201]), bytes([25, 202]))
    with pytest.raises(dw.InputError, match="SAC/SIC"):  # at the beginning
        Wire("udp", False, sites="25/203=46,15,0").take([Packet(START, stranger), Packet(*came[0])])
    later = wire.take([Packet(START + 200, stranger), Packet(START + 200, record((START + 200) % 86400, 30, 45))])
    assert later.sensor.tolist() == ["25/201"], "a radar that nobody knows, and comes later, is left out"


def test_anybody_may_send_a_datagram():
    wire = Wire("udp", False, sites="25/201=46.2,15.1,800")
    good = [record((START + 4 * k) % 86400, 30 + 0.2 * k, 45) for k in range(8)]
    kinds = [b"\x00\x01\x02", b"hello", b"\xff" * 900, AIS, b"$GPGGA,bad*00", b"time,east,north\n1,2,3\n", b"{" * 500]
    seen = []
    for k in range(300):
        packets = [Packet(START + k, kinds[k % 7]), Packet(START + k, kinds[k % 5])]
        if k % 40 == 0:
            packets.append(Packet(START + 4 * (k // 40), good[k // 40]))
        if (found := wire.take(packets)) is not None:
            seen += found.sensor.tolist()
    assert seen.count("25/201") == 8


@pytest.mark.parametrize("size", [1, 7, 1000])
def test_a_capture_through_a_pipe_may_be_cut_anywhere(size, tmp_path):
    data = capture([(START + 4 * k, record((START + 4 * k) % 86400, 30 + 0.2 * k, 45)) for k in range(12)])
    wire = Wire("-", True)
    parts = [wire.take([Packet(START, data[k : k + size])]) for k in range(0, len(data), size)]
    (tmp_path / "x.pcap").write_bytes(data)
    np.testing.assert_array_equal(together(parts)[0], read_plots(tmp_path / "x.pcap").time)


@pytest.mark.parametrize("cut", [False, True])
@pytest.mark.parametrize("name", STREAMS)
def test_every_kind_of_stream_gives_its_plots(name, cut):
    make, many, wanted = STREAMS[name]
    wire, parts = Wire(name, True), []
    for k in range(many):
        data = make(k)
        at = len(data) // 3 if cut else 0
        parts += [wire.take([Packet(START + 20.0 * k, piece)]) for piece in (data[:at], data[at:])]
    time, position = together(parts)
    assert len(time) == wanted and np.isfinite(position).all()
    if name in ("beast", "avr", "sbs", "ais"):
        steps = np.arange(many - wanted, many)
        np.testing.assert_allclose(time, START + 20.0 * steps, atol=1e-3)
    if name == "sbs":
        assert parts[-1].key[0] == "40621D" and abs(parts[-1].altitude[0] - 38000 * 0.3048) < 1


def test_lines_without_end_and_bytes_without_frames_are_bounded():
    wire = Wire("x", True)
    wire.take([Packet(0.0, b"time,east,north\n1,2,3\n")])
    for _ in range(50):
        wire.take([Packet(0.0, b"x" * 10_000)])
        assert len(wire._rest) < 40_000
    found = wire.take([Packet(0.0, b"x\n2,3,4\n")])
    assert len(found) == 1 and "more than" in found.faults[0].what
    wire = Wire("x", True)
    wire.take([Packet(0.0, beast(0))])
    for _ in range(20):
        wire.take([Packet(0.0, b"\x00" * 10_000)])
        assert len(wire._rest) < 40_000


@pytest.mark.parametrize("seed", range(40))
def test_mutated_bytes_are_refused_in_words_or_read(seed):
    trial(seed)


def test_urls():
    assert place("tcp://localhost:30003") == ("tcp", "localhost", 30003, "")
    for wrong in ("udp://239.1.2.3", "http://a:80", "tcp://:80", "udp://a:99999", "udp://a:80/x", "udp://a:80?x=1"):
        with pytest.raises(dw.InputError, match="no place to listen to"):
            place(wrong)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with pytest.raises(dw.InputError, match="is that the right address"):
        Listener(f"tcp://127.0.0.1:{port}")


def test_a_group_is_joined_on_the_loopback():
    listener = Listener("udp://239.255.26.2:48626?interface=127.0.0.1", pause=1.0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        sender.sendto(b"hello", ("239.255.26.2", 48626))
    assert [packet.data for packet in listener.read()] == [b"hello"]
    listener.close()


def served(messages, again):
    """Serve messages on a port, then close; a second time what is left. Return the port."""
    server = socket.create_server(("127.0.0.1", 0))

    def serve():
        for some in (messages, again):
            client, _ = server.accept()
            with client:
                for message in some:
                    client.sendall(message)
                    time.sleep(0.005)
        server.close()

    threading.Thread(target=serve, daemon=True).start()
    return server.getsockname()[1]


def test_a_lost_connection_is_made_again_and_the_table_is_told(tmp_path):
    def line(k):
        return json.dumps({"time": START + 4 * k, "lat": 46 + 0.005 * k, "lon": 15.0, "id": "K"}).encode() + b"\n"

    port = served([line(k) for k in range(20)], [line(k) for k in range(20, 40)])
    command = [sys.executable, "-m", "driftwise.cli.main", "track", "--listen", f"tcp://127.0.0.1:{port}"]
    found = tmp_path / "found.json"
    with subprocess.Popen([*command, "--json", str(found)], stdout=subprocess.PIPE, text=True) as process:
        for text in process.stdout:
            row = json.loads(text)
            if "estimate" in row and row["time"] == START + 4 * 39:
                process.send_signal(signal.SIGINT)
                break
        process.stdout.read()
    told = json.loads(found.read_text())
    assert process.returncode == 0 and [t["plots"] for t in told["tracks"]] == [40]
    assert "the connection was lost" in str(told["skipped"])


def test_what_is_forgotten_does_not_change_what_is_estimated():
    rng = np.random.default_rng(1)
    t = 4.0 * np.arange(600)
    east = 100 * np.concatenate([t, t[:100]])
    seen = plots(
        np.concatenate([t, t[:100] + 1]), rng.normal(0, 20, (700, 2)) + np.outer(east, [1, 0]),
        key=["AB1"] * 600 + [f"N{k // 10}" for k in range(100)], sensor=["A"] * 600 + [f"S{k}" for k in range(100)],
    )  # fmt: skip
    whole, kept = dw.tracking.Tracker(), dw.tracking.Tracker()
    whole.feed(seen)
    for first in range(0, 700, 50):
        kept.feed(seen[first : first + 50])
        forget(kept.targets, kept.inbox.newest - 400)
    one, other = whole.tracks.of("AB1")[0], kept.tracks.of("AB1")[0]
    n = len(other)
    assert 64 <= n < 200 and other.state.tobytes() == one.state.tobytes()
    np.testing.assert_array_equal(other.table, one.table[-n:])
    assert other.plots.key[0] == "AB1" and list(kept.targets.numbers) == ["", "AB1", "A"]
    assert len(kept.targets.past) == 0 and len(kept.tracks) == 1 and len(kept.events) < 5
