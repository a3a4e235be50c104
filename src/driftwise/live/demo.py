"""A plant of pumps to try the service on: one bearing fails after a minute."""

from __future__ import annotations

import asyncio
import json
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from ..engine.errors import InputError
from .board import Board, Sample
from .config import Config, ModelConfig, SeriesConfig, StoreConfig, WebConfig
from .outputs.log import LogOutput
from .sources.mqtt import MqttSource

PUMPS, FAILING = 12, 7
STEP, MINUTE = 0.1, 60.0  # s between samples; until the bearing fails
A, B, LEVEL, NOISE = 0.8, 0.4, 4.0, 0.05  # flow of a sound pump in m3/h, from its speed in Hz around 50
LEFT = 0.5  # of the gain, with a failed bearing
BROKER = "mosquitto"


class Plant:
    """Pumps whose flow follows their speed; from `fails` on one of them delivers half as much for it."""

    def __init__(self, fails: float, seed: int = 0):
        self.rng, self.fails = np.random.default_rng(seed), fails
        self.flow, self.speed = np.full(PUMPS, LEVEL), np.full(PUMPS, 50.0)

    def step(self, now: float) -> list[Sample]:
        """Return what the sensors of all pumps say now."""
        gain = np.full(PUMPS, B)
        if now >= self.fails:
            gain[FAILING - 1] *= LEFT
        noise = NOISE * self.rng.standard_normal(PUMPS)
        self.flow = LEVEL + A * (self.flow - LEVEL) + gain * (self.speed - 50.0) + noise
        turned = self.rng.random(PUMPS) < STEP
        self.speed = np.where(turned, 50.0 + 2.0 * self.rng.standard_normal(PUMPS), self.speed)
        return [
            Sample(f"pump {k + 1:02d}", {"flow": round(flow, 4), "speed": round(speed, 2)}, now)
            for k, (flow, speed) in enumerate(zip(self.flow.tolist(), self.speed.tolist()))
        ]


@contextmanager
def broker() -> Iterator[int | None]:
    """Run mosquitto on a free port of this machine; None where it is not installed."""
    program = shutil.which(BROKER) or shutil.which(BROKER, path="/usr/sbin:/usr/local/sbin")
    if program is None:
        yield None
        return
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    # without a configuration it listens to this machine alone
    process = subprocess.Popen([program, "-p", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        _wait_for(port)
        yield port
    finally:
        process.terminate()
        process.wait(10)


def _wait_for(port: int, seconds: float = 5.0) -> None:
    """Return when somebody listens at the port."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        with suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0):
            return
        time.sleep(0.05)
    raise InputError(f"{BROKER} does not answer at port {port}")


def configuration(port: int | None, folder: Path, web: WebConfig) -> Config:
    """Return the settings of the demonstration; without a broker nothing is subscribed to."""
    model: dict[str, Any] = dict(model="arx:1,1", jumps="parameters:100000", output="flow", inputs=("speed",))
    sources = () if port is None else (MqttSource(f"mqtt://127.0.0.1:{port}", ("plant/+",), key="{1}"),)
    pumps = SeriesConfig(**model, keys="pump *", unit="m3/h")
    return Config(
        sources,
        ModelConfig(**model),
        series=(pumps,),
        web=web,
        store=StoreConfig(path=str(folder)),
        outputs=(LogOutput(),),
    )


async def feed(plant: Plant, port: int | None, board: Board) -> None:
    """Send what the plant says, ten times a second, until cancelled: to the broker, or to the board where none is."""
    send = None if port is None else _publisher(port)
    start, k = time.time(), 0
    while True:
        k += 1
        await asyncio.sleep(max(start + k * STEP - time.time(), 0.0))
        samples = plant.step(start + k * STEP)
        if send is None:
            await board.put(samples)
        else:
            send(samples)


def _publisher(port: int) -> Any:
    """Return what publishes samples."""
    from paho.mqtt.client import Client
    from paho.mqtt.enums import CallbackAPIVersion

    client = Client(CallbackAPIVersion.VERSION2)
    client.connect("127.0.0.1", port)
    client.loop_start()

    def send(samples: Sequence[Sample]) -> None:
        for key, values, when in samples:
            client.publish(f"plant/{key}", json.dumps(values | {"time": when}), qos=1)

    return send


class Fed:
    """A site, and the plant that runs as long as it is there."""

    def __init__(self, site: Any, board: Board, port: int | None):
        self.site, self.board, self.port = site, board, port

    async def start(self) -> None:
        await self.site.start()
        self._feeding = asyncio.create_task(feed(Plant(time.time() + MINUTE), self.port, self.board))

    async def stop(self) -> None:
        self._feeding.cancel()
        with suppress(asyncio.CancelledError):
            await self._feeding
        await self.site.stop()


def free_port(wanted: int) -> int:
    """Return the port, or 0 (any) where something else listens there."""
    with socket.socket() as one:
        return wanted if one.connect_ex(("127.0.0.1", wanted)) else 0
