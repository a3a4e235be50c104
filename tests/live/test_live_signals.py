"""A service that is asked to end or to read its configuration again, and one whose outputs publish by MQTT."""

import json
import signal
import subprocess
import time

import pytest
from broker import Broker, publisher
from live_plant import configuration, lines, opened, outputs, states
from live_plant import found as kept
from live_process import ended, listening, samples, started


def test_a_configuration_is_read_again(tmp_path):
    y, (first, second) = outputs(3, 200), (tmp_path / "a.jsonl", tmp_path / "b.jsonl")
    first.write_text(lines(y, 0, 100))
    second.write_text(lines(y, 100, 200))
    config = configuration(tmp_path, f'[[source]]\nkind = "file"\npath = "{first}"\n')
    good = config.read_text()
    service = started(config, stderr=subprocess.PIPE)
    Broker.wait(lambda: samples(tmp_path) == 300)
    config.write_text(good + "typo = 1\n")
    service.send_signal(signal.SIGHUP)
    assert "there is no option 'typo'" in service.stderr.readline()
    config.write_text(good.replace("a.jsonl", "b.jsonl"))
    service.send_signal(signal.SIGHUP)
    Broker.wait(lambda: samples(tmp_path) == 600)
    assert ended(service) == 0
    service.stderr.close()
    assert kept(opened(tmp_path / "store")) == states(y)


def test_asked_to_end_while_it_starts_it_ends_well(tmp_path):
    """And one that is told to read a configuration that it has not read yet goes on."""
    services = []
    for number, after in enumerate((0.0, 0.1, 0.2, 0.4, 0.8)):
        (folder := tmp_path / str(number)).mkdir()
        config = configuration(folder, f'[[source]]\nkind = "file"\npath = "{folder / "a.jsonl"}"\n')
        services.append((after, started(config, stderr=subprocess.PIPE)))
    for after, service in services:
        time.sleep(after / 2)
        if after:
            listening(service)
            service.send_signal(signal.SIGHUP)
            time.sleep(after / 2)
        assert ended(service) == 0
        assert service.stderr.read() in ("", "driftwise: stopped\n")
        service.stderr.close()


@pytest.mark.service
def test_events_and_estimates_are_published(tmp_path):
    broker = Broker(tmp_path / "broker")
    data = tmp_path / "a.jsonl"
    config = configuration(
        tmp_path,
        f'[[source]]\nkind = "file"\npath = "{data}"\n[[out]]\nkind = "mqtt"\nurl = "mqtt://127.0.0.1:{broker.port}"\n'
        'estimates = true\ndiscovery = "homeassistant"\n',
    )
    came = []
    client = publisher(broker.port)
    client.on_message = lambda c, u, message: came.append((message.topic, message.payload))
    client.subscribe([("driftwise/#", 1), ("homeassistant/#", 1)])
    service = started(config)
    y = outputs(1, 300)
    y[0, 200:] += 40.0
    try:
        broker.wait(broker.subscribed)
        time.sleep(1.0)
        data.write_text(lines(y, 0, 250))
        broker.wait(lambda: any(topic == "driftwise/events/s0" for topic, _ in came))
        event = json.loads(next(payload for topic, payload in came if topic == "driftwise/events/s0"))
        assert event["kind"] == "jump" and 1e9 + 200 <= event["time"] < 1e9 + 210
        with data.open("a") as file:
            file.write(lines(y, 250, 300))
        last = {"key": "s0", "time": 1e9 + 299}
        broker.wait(
            lambda: any(last.items() <= json.loads(p).items() for t, p in came if t == "driftwise/estimates/s0")
        )
        broker.wait(lambda: "homeassistant/sensor/driftwise_s0/config" in {topic for topic, _ in came})
    finally:
        ended(service)
        client.disconnect()
        client.loop_stop()
        broker.stop()
