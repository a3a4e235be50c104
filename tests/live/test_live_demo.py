"""The demonstration: it says where its page is, finds the bearing, and leaves nothing behind."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from urllib.request import urlopen

import numpy as np
import pytest

pytest.importorskip("starlette", reason='pip install "driftwise[live]"')

from driftwise.live import demo


def test_the_plant_is_what_it_says():
    plant = demo.Plant(fails=1000.0)
    rows = np.array([[(s.values["flow"], s.values["speed"]) for s in plant.step(float(t))] for t in range(2000)])
    sound, failed = slice(0, 1000), slice(1000, 2000)
    for pump, half, gain in ((0, sound, 0.4), (6, sound, 0.4), (6, failed, 0.2), (5, failed, 0.4)):
        y, u = (rows[half, pump, k] - level for k, level in ((0, demo.LEVEL), (1, 50.0)))
        a, b = np.linalg.lstsq(np.column_stack([y[:-1], u[:-1]]), y[1:], rcond=None)[0]
        assert (a, b) == pytest.approx((0.8, gain), abs=0.02)


def test_a_port_that_is_taken_is_left_alone():
    import socket

    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        one.listen()
        assert demo.free_port(one.getsockname()[1]) == 0


@pytest.mark.service
def test_the_bearing_is_found(tmp_path):
    """A minute and a half of it, as a user sees it; by mosquitto where that is installed."""
    environment = os.environ | {"TMPDIR": str(tmp_path)}
    command = [sys.executable, "-m", "driftwise", "live", "demo", "--port", "0"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment)
    try:
        address = next(found[0] for line in process.stdout if (found := re.search(r"http://\S+", line)))
        end, events = time.monotonic() + 120, []
        while time.monotonic() < end and not any(event["key"] == "pump 07" for event in events):
            time.sleep(1)
            with urlopen(f"{address}/api/events", timeout=10) as answer:
                events = json.load(answer)["events"]
        with urlopen(f"{address}/api/series", timeout=10) as answer:
            series = json.load(answer)["series"]
        first = next(event for event in events if event["key"] == "pump 07")
        assert first["kind"] == "jump" and len(series) == demo.PUMPS
        worst = max(series, key=lambda one: one["score"])
        assert worst["key"] == "pump 07" and not worst["acknowledged"]
    finally:
        process.send_signal(signal.SIGTERM)
        rest, _ = process.communicate(timeout=30)
    assert process.returncode == 0 and "Traceback" not in rest
    assert list(tmp_path.iterdir()) == [], "nothing is left behind"
