"""A broker behind TLS that knows its users: credentials from the environment, and never printed."""

import json
import os
import shutil
import ssl
import subprocess

import pytest
from broker import Broker, messages
from live_plant import configuration, found, opened, outputs, states
from live_process import ended, samples, started
from test_live_site import self_signed

pytestmark = pytest.mark.service
SECRET = "quite-secret-0815"
SERIES, SAMPLES = 5, 300


@pytest.fixture
def broker(tmp_path):
    if shutil.which("mosquitto_passwd") is None:
        pytest.skip("mosquitto is not installed: make services")
    certificate, key = self_signed(tmp_path)
    passwords = tmp_path / "passwords"
    subprocess.run(["mosquitto_passwd", "-c", "-b", passwords, "plant", SECRET], check=True)
    for path in (passwords, certificate, key):
        path.chmod(0o644)
    one = Broker(tmp_path / "broker", f"certfile {certificate}\nkeyfile {key}\npassword_file {passwords}")
    yield one
    one.stop()


def service(folder, broker, password, host="localhost"):
    url, ca = f"mqtts://{host}:{broker.port}", f'ca_file = "{folder / "cert.pem"}"\n'
    config = configuration(
        folder,
        f'[[source]]\nkind = "mqtt"\nurl = "{url}"\ntopics = ["plant/+"]\nkey = "{{1}}"\nclient = "tls"\n'
        f'{ca}[[out]]\nkind = "mqtt"\nurl = "{url}"\n{ca}',
    )
    environment = os.environ | {"DRIFTWISE_MQTT_USER": "plant", "DRIFTWISE_MQTT_PASSWORD": password}
    return started(config, env=environment, stderr=subprocess.PIPE, stdout=subprocess.PIPE)


def test_samples_and_events_go_through_tls(tmp_path, broker):
    paho = pytest.importorskip("paho.mqtt.client")
    y = outputs(SERIES, SAMPLES)
    y[2, 150:] = y[2, 149]  # stuck
    process = service(tmp_path, broker, SECRET)
    broker.wait(broker.subscribed)
    client, events = paho.Client(paho.CallbackAPIVersion.VERSION2), []
    client.tls_set(str(tmp_path / "cert.pem"))
    client.username_pw_set("plant", SECRET)
    client.on_message = lambda c, u, message: events.append(json.loads(message.payload))
    client.on_connect = lambda *words: client.subscribe("driftwise/events/+", 1)
    client.on_subscribe = lambda *words: events.append({"kind": "subscribed", "key": ""})
    client.connect("localhost", broker.port)
    client.loop_start()
    broker.wait(lambda: events)
    for topic, payload in messages(y, 0, SAMPLES, 10):
        client.publish(topic, payload, qos=1)
    broker.wait(lambda: samples(tmp_path) == SERIES * SAMPLES)
    broker.wait(lambda: any(event["key"] == "s2" and event["kind"] == "stuck" for event in events), 30)
    assert ended(process) == 0
    assert SECRET not in process.stdout.read() + process.stderr.read()
    client.loop_stop()
    assert found(opened(tmp_path / "store")) == states(y)
    stranger = paho.Client(paho.CallbackAPIVersion.VERSION2)
    stranger.tls_set()
    with pytest.raises(ssl.SSLError):
        stranger.connect("localhost", broker.port)


@pytest.mark.parametrize(("password", "host"), [("wrong", "localhost"), (SECRET, "127.0.0.1")])
def test_a_wrong_password_or_name_brings_nothing(tmp_path, broker, password, host):
    process = service(tmp_path, broker, password, host)
    log = tmp_path / "broker" / "log"
    words = "not authorised" if password == "wrong" else "alert"
    broker.wait(lambda: words in log.read_text("utf-8", "replace"), 30)
    assert not broker.subscribed()
    assert ended(process) == 0
    told = process.stdout.read() + process.stderr.read()
    assert SECRET not in told and "wrong" not in told
