"""The map of `driftwise track --listen --page`: what is drawn is what the tracker says, and it holds nothing up."""

import json
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from http.client import HTTPConnection
from urllib.request import urlopen

import numpy as np
import pytest

pytest.importorskip("starlette", reason='pip install "driftwise[live]"')
from browser import PROGRAM, Browser

import driftwise as dw
from driftwise.live.web.track_map import TrackMap
from driftwise.tracking.plots import plots

START = 1.7e9
NASTY = "<img src=x onerror=alert(1)>"


class Feed:
    """A sender of lines on a port; whoever comes gets what was sent so far, and what comes."""

    def __init__(self):
        self.server = socket.create_server(("127.0.0.1", 0))
        self.url, self.client, self.k = f"tcp://127.0.0.1:{self.server.getsockname()[1]}", None, 0

    def send(self, steps, names):
        """Send plots, one of each name every 4 s, that fly round circles."""
        if self.client is None:
            self.client, _ = self.server.accept()
        for _ in range(steps):
            for n, name in enumerate(names):
                turn, radius = 0.004 * 4 * self.k + 1.3 * n, 0.02 + 0.05 * n
                row = {"time": START + 4 * self.k, "lat": 46 + radius * np.sin(turn), "lon": 15 + radius * np.cos(turn)}
                self.client.sendall(json.dumps(row | {"id": f"K{n}", "name": name}).encode() + b"\n")
            self.k += 1

    def close(self):
        if self.client is not None:
            self.client.close()
        self.server.close()


@contextmanager
def tracked(feed, *options):
    """Run the command on a feed; yield its process and the address of its page."""
    command = [sys.executable, "-m", "driftwise.cli.main", "track", "--listen", feed.url, "--page", "0", *options]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        try:
            line = process.stderr.readline()
            yield process, re.search(r"http://127\.0\.0\.1:\d+", line)[0]
        finally:
            process.kill()


@pytest.fixture
def feed():
    feed = Feed()
    yield feed
    feed.close()


def asked(address, until, seconds=30):
    """Return the tracks as soon as they are as wanted."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        seen = json.load(urlopen(f"{address}/tracks"))
        if until(seen):
            return seen
        time.sleep(0.05)
    raise AssertionError(f"never so: {seen}")


def test_the_command_shows_what_comes_and_ends_with_its_page(feed, tmp_path):
    found = tmp_path / "found.json"
    with tracked(feed, "--json", str(found)) as (process, address):
        assert asked(address, lambda seen: True)["tracks"] == []
        feed.send(20, ["SWR12", NASTY])
        seen = asked(address, lambda seen: seen["plots"] == 40 and seen["time"] == START + 76 and seen["tracks"])
        assert {one["name"] for one in seen["tracks"]} == {"SWR12", NASTY} and seen["silent"] < 10
        with urlopen(address) as page:
            assert b"<svg" in page.read() and "default-src 'none'" in page.headers["Content-Security-Policy"]
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 0
    told = {track["label"]: track["speed"] for track in json.loads(found.read_text())["tracks"]}
    assert told.keys() == {"K0", "K1"}
    with pytest.raises(OSError):
        urlopen(address)


def test_a_pipe_is_shown_and_ends_with_its_page():
    command = [sys.executable, "-m", "driftwise.cli.main", "track", "-", "--follow", "--page", "0"]
    ends = {"stdin": subprocess.PIPE, "stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **ends) as process:
        address = re.search(r"http://127\.0\.0\.1:\d+", process.stderr.readline())[0]
        process.stdin.write("time,east,north,id\n" + "".join(f"{4 * k},{600 * k},0,A\n" for k in range(9)))
        process.stdin.flush()
        assert asked(address, lambda seen: seen["tracks"])["tracks"][0]["name"] == "A"
        process.stdin.close()
        assert process.wait(30) == 0


def test_what_cannot_be_is_said_at_the_door(call, monkeypatch, tmp_path):
    path = tmp_path / "plots.csv"
    path.write_text("time,east,north\n")
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        code, out, err = call("track", path, "--follow", "--page", port)
    assert (code, out) == (2, "") and f"--page {port}: nothing can listen at 127.0.0.1:{port}" in " ".join(err.split())
    monkeypatch.delitem(sys.modules, "driftwise.live.web.track_map")
    monkeypatch.setitem(sys.modules, "starlette.applications", None)
    code, out, err = call("track", path, "--follow", "--page", 0)
    assert (code, out) == (2, "") and 'starlette: pip install "driftwise[live]"' in " ".join(err.split())


def test_only_this_machine_is_answered():
    page = TrackMap()
    try:
        for host, status in (("127.0.0.1", 200), ("localhost", 200), ("evil.example", 421)):
            line = HTTPConnection(page.address.removeprefix("http://"))
            line.request("GET", "/tracks", headers={"Host": host})
            assert line.getresponse().status == status
            line.close()
        with pytest.raises(dw.InputError, match="nothing can listen"):
            TrackMap(int(page.address.rpartition(":")[2]))
    finally:
        page.close()
    page.close()  # twice is once
    assert not page._thread.is_alive()


def test_who_asks_and_hangs_holds_no_tracker_up():
    tracker, page = dw.tracking.Tracker(), TrackMap()
    t = 4.0 * np.arange(50)
    address = ("127.0.0.1", int(page.address.rpartition(":")[2]))
    hanging = [socket.create_connection(address) for _ in range(20)]
    stop = threading.Event()

    def ask():
        while not stop.is_set():
            json.load(urlopen(f"{page.address}/tracks"))

    asking = threading.Thread(target=ask)
    try:
        for one in hanging:
            one.sendall(b"GET /tracks HTTP/1.1\r\nHost: 127.0.0.1\r\n")  # and no end
        asking.start()
        longest = 0.0
        for k in range(len(t)):
            tracker.feed(plots(t[k : k + 1], [[150 * t[k], 0.0]], key=["A"]))
            begin = time.thread_time()
            page.show(tracker)
            longest = max(longest, time.thread_time() - begin)
            page._next = 0.0  # a picture each time
        assert longest < 0.05
        assert json.load(urlopen(f"{page.address}/tracks"))["time"] == t[-1]
    finally:
        stop.set()
        asking.join()
        for one in hanging:
            one.close()
        page.close()


@pytest.mark.service
@pytest.mark.skipif(PROGRAM is None, reason="no Chromium on the PATH: THE MAP OF TRACKS WAS NOT TESTED")
def test_the_page_draws_the_tracks_where_they_are(feed, tmp_path):
    names = ["SWR12", NASTY, "AFR34ZG"]
    browser = Browser(tmp_path / "profile")
    try:
        with tracked(feed, "--keep", "1") as (process, address):
            browser.visit(address)
            browser.wait("document.querySelector('#answer').textContent.startsWith('Waiting')")
            feed.send(90, names)
            browser.wait("document.querySelector('#counts').textContent.startsWith('270 plots')")
            agree(browser, asked(address, lambda seen: seen["time"] == START + 4 * 89))
            browser.picture(tmp_path / "map.png")
            browser.run(
                "[...document.querySelectorAll('#rows tr')].find(r => r.textContent.startsWith('SWR12')).click()"
            )
            assert browser.run("document.querySelector('#map .marked').textContent") == "SWR12"
            feed.send(30, names)
            browser.wait("document.querySelector('#counts').textContent.startsWith('360 plots')")
            agree(browser, asked(address, lambda seen: seen["time"] == START + 4 * 119))
            scale = browser.run("document.querySelector('#scale').textContent")
            for _ in range(5):
                browser.run("document.querySelector('#farther').click()")
            assert browser.run("document.querySelector('#scale').textContent") != scale
            browser.wait("/^No plot has come for 1\\d s/.test(document.querySelector('#answer').textContent)")
            assert not browser.errors and all(url.startswith((address, "about:")) for url in browser.requests)
            process.send_signal(signal.SIGINT)
            assert process.wait(30) == 0
        browser.wait("document.querySelector('#link').dataset.link == 'gone'")
    finally:
        browser.close()


def agree(browser, seen):
    """Hold what is drawn to what was told: places relative to one another by the scale bar, and the table."""
    drawn = browser.run(
        "Object.fromEntries([...document.querySelectorAll('#map .place')].map(c => "
        "[c.parentNode.dataset.id, [+c.getAttribute('cx'), -c.getAttribute('cy')]]))"
    )
    length = browser.run("+document.querySelector('#map .bar').getAttribute('d').match(/h([\\d.]+)/)[1]")
    number, unit = browser.run("document.querySelector('#scale').textContent").split()
    assert len(drawn) == len(seen["tracks"]) == 3
    scale = float(number) * {"m": 1.0, "km": 1000.0}[unit] / length
    first, *others = seen["tracks"]
    for one in others:
        apart = np.subtract(drawn[str(one["id"])], drawn[str(first["id"])]) * scale
        np.testing.assert_allclose(apart, np.subtract(one["position"], first["position"]), atol=2 * scale)
    rows = browser.run("[...document.querySelectorAll('#rows tr')].map(r => [...r.children].map(c => c.textContent))")
    assert {row[0] for row in rows} == {one["name"] for one in seen["tracks"]}
    speeds = {row[0]: float(row[1].split()[0]) for row in rows}
    for one in seen["tracks"]:
        assert speeds[one["name"]] == pytest.approx(one["speed"], abs=0.6)
