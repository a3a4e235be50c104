"""MQTT by a real broker: nothing is lost, nothing counts twice, whatever is killed."""

import os
import random
import signal
import time

import pytest
from broker import Broker, messages, publisher
from live_plant import configuration, found, opened, outputs, states
from live_process import ended, samples, started

pytestmark = pytest.mark.service
SERIES, SAMPLES, SIZE = 200, 600, 10


@pytest.mark.parametrize(("kills", "restarts"), [(0, 0), (20, 3)])
def test_states_are_those_of_a_fleet(tmp_path, kills, restarts):
    y, drawn = outputs(SERIES, SAMPLES), random.Random(11)
    broker = Broker(tmp_path / "broker")
    config = configuration(
        tmp_path,
        f'[[source]]\nkind = "mqtt"\nurl = "mqtt://127.0.0.1:{broker.port}"\ntopics = ["plant/+"]\nkey = "{{1}}"\n'
        'client = "tested"\n',
    )
    process = started(config)
    broker.wait(broker.subscribed)
    client = publisher(broker.port)
    stages = max(kills, 1)
    step = SAMPLES // stages
    for stage in range(stages):
        said = list(messages(y, stage * step, (stage + 1) * step, SIZE))
        for i, (topic, payload) in enumerate(said):
            if restarts and stage == 9 and i == len(said) // 2:
                broker.restart()  # while all are at work
            broker.wait(client.is_connected)  # what is published into a reconnection overtakes what waits for it
            client.publish(topic, payload, qos=1)
        if kills:
            time.sleep(drawn.uniform(0.0, 1.5))
            os.kill(process.pid, signal.SIGKILL)
            process.wait()
            if restarts and stage in (3, 16):
                broker.restart()
            process = started(config)
    broker.wait(lambda: samples(tmp_path) == SERIES * SAMPLES, 120)
    assert ended(process) == 0
    client.disconnect()
    client.loop_stop()
    broker.stop()
    core = opened(tmp_path / "store")
    assert found(core) == states(y)
    assert sum(len(rows) for _, rows in core.history.recent) == SERIES * SAMPLES
