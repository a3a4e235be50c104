"""A mosquitto of our own, on a free port, and a publisher that forgets nothing."""

from __future__ import annotations

import json
import random
import shutil
import signal
import socket
import subprocess
import time
from contextlib import suppress
from pathlib import Path

import pytest

CONFIG = """
listener {port} 127.0.0.1
{more}
persistence true
persistence_location {folder}/
max_queued_messages 0
max_inflight_messages 0
log_dest file {folder}/log
log_type all
"""


class Broker:
    """Debian's mosquitto; it keeps sessions, and its port, through a restart. ``more`` says who may talk to it."""

    def __init__(self, folder: Path, more: str = "allow_anonymous true"):
        if shutil.which("mosquitto") is None:
            pytest.skip("mosquitto is not installed: make services")
        self.port = kept_port()
        self.folder = folder
        folder.mkdir()
        self.config = folder / "mosquitto.conf"
        folder.chmod(0o777)
        self.config.write_text(CONFIG.format(port=self.port, folder=folder, more=more) + "user root\n")
        self.start()

    def start(self):
        self.process = subprocess.Popen(["mosquitto", "-c", str(self.config)])
        self.wait(lambda: self._answers())

    def _answers(self):
        with socket.socket() as one:
            return one.connect_ex(("127.0.0.1", self.port)) == 0

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(30)

    def restart(self):
        self.stop()
        self.start()

    def subscribed(self):
        """Say whether somebody has subscribed."""
        log = self.folder / "log"
        return log.exists() and "Received SUBSCRIBE" in log.read_text("utf-8", "replace")

    @staticmethod
    def wait(condition, seconds=120.0):
        until = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < until, "it did not come to pass in time"
            time.sleep(0.05)


def kept_port() -> int:
    """Return a free port that no connection is given while a broker is restarted: one below those that are given."""
    while True:
        port = random.randrange(10_000, 30_000)
        with socket.socket() as free, suppress(OSError):
            free.bind(("127.0.0.1", port))
            return port


def publisher(port: int):
    """Return a client that publishes with QoS 1, in order, through restarts of the broker."""
    paho = pytest.importorskip("paho.mqtt.client")
    client = paho.Client(paho.CallbackAPIVersion.VERSION2, client_id="plant", clean_session=False)
    client.max_queued_messages_set(0)
    client.reconnect_delay_set(1, 1)
    client.connect("127.0.0.1", port)
    client.loop_start()
    return client


def messages(y, first: int, last: int, size: int):
    """Yield topics and payloads of samples, so many a message, series by series."""
    for begin in range(first, last, size):
        for i in range(len(y)):
            at = range(begin, min(begin + size, last))
            yield (
                f"plant/s{i}",
                json.dumps({"time": [1e9 + t for t in at], "value": [float(y[i, t]) for t in at]}),
            )
