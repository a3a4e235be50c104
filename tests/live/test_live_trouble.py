"""What goes wrong around a service for long: the broker is gone for an hour, the disk is full."""

import json
import os
import subprocess
import sys
import time
import urllib.error
import urllib.request
from contextlib import suppress

import pytest
from broker import Broker, messages, publisher
from live_plant import found, lines, opened, outputs, states
from live_process import ended, samples, started

pytestmark = pytest.mark.service
SERIES, SAMPLES = 20, 600
QUICK = 300  # times as quickly as it says does this client try again: an hour of tries is over after 12 s
CLIENT = f"""
import sys, paho.mqtt.client as paho
wait, tries, again = paho.Client.reconnect_delay_set, [0], paho.Client.reconnect
paho.Client.reconnect_delay_set = lambda self, low, high: wait(self, low / {QUICK}, high / {QUICK})
def counted(self, *words):
    tries[0] += 1
    print("try", tries[0], file=sys.stderr, flush=True)
    return again(self, *words)
paho.Client.reconnect = counted
from driftwise.cli.entry import main
main()
"""


def asked(address):
    """Return the answer in JSON, also where it says that something is wrong."""
    try:
        with urllib.request.urlopen(address, timeout=60) as answer:
            return json.loads(answer.read())
    except urllib.error.HTTPError as error:
        return json.loads(error.read())


def notes(address):
    """Return what a service says of itself."""
    return asked(f"{address}/api/service")["health"]["notes"]


def address_of(process, words=()):
    """Return where the page of a service is, which it says on standard error."""
    for line in process.stderr:
        if "the page is at" in line:
            return line.split()[-1]
    raise AssertionError("no page")


def test_the_broker_is_gone_for_an_hour(tmp_path):
    y, broker = outputs(SERIES, SAMPLES), Broker(tmp_path / "broker")
    config = tmp_path / "live.toml"
    config.write_text(
        f'[model]\nmodel = "ar:2"\n[store]\npath = "{tmp_path / "store"}"\n[web]\nport = 0\n'
        f'[[source]]\nkind = "mqtt"\nurl = "mqtt://127.0.0.1:{broker.port}"\ntopics = ["plant/+"]\nkey = "{{1}}"\n'
        'client = "patient"\n'
    )
    log = tmp_path / "stderr"
    with log.open("w") as file:
        service = subprocess.Popen([sys.executable, "-c", CLIENT, "live", str(config)], stderr=file)
    broker.wait(broker.subscribed)
    address = next(line.split()[-1] for line in log.read_text().splitlines() if "the page is at" in line)
    client = publisher(broker.port)

    def say(first, last):
        for topic, payload in messages(y, first, last, 10):
            client.publish(topic, payload, qos=1)

    say(0, 200)
    broker.wait(lambda: samples(tmp_path) == SERIES * 200)
    before, size = log.read_text().count("try"), memory(service.pid)
    broker.stop()
    say(200, 400)  # waits at the plant
    broker.wait(lambda: any("the broker is gone" in note for note in notes(address)))
    assert not asked(f"{address}/health")["healthy"] and asked(f"{address}/ready")["ready"]
    time.sleep(3600 / QUICK)
    tries = log.read_text().count("try") - before
    assert tries > 50, "it tries again, all the hour"
    assert asked(f"{address}/api/series/s7")["count"] == 200, "it answers meanwhile"
    assert memory(service.pid) < size + 30e6
    broker.start()
    broker.wait(client.is_connected)
    say(400, 600)
    broker.wait(lambda: samples(tmp_path) == SERIES * SAMPLES)
    broker.wait(lambda: not notes(address), 10)
    assert ended(service) == 0
    client.disconnect()
    client.loop_stop()
    broker.stop()
    core = opened(tmp_path / "store")
    assert found(core) == states(y)
    assert sum(len(rows) for _, rows in core.history.recent) == SERIES * SAMPLES


def memory(number):
    """Return the bytes that a process has in memory."""
    with open(f"/proc/{number}/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.fixture
def small_disk(tmp_path):
    """A disk of four megabytes."""
    folder = tmp_path / "disk"
    folder.mkdir()
    if os.geteuid() or subprocess.run(["mount", "-t", "tmpfs", "-o", "size=4m", "none", folder]).returncode:
        pytest.skip("nothing may be mounted here: run as root, or in a container with CAP_SYS_ADMIN")
    yield folder
    subprocess.run(["umount", "-l", folder], check=True)


def fill(path):
    """Write until nothing fits any more."""
    with suppress(OSError), path.open("wb", buffering=0) as file:
        while True:
            file.write(bytes(4096))
    with pytest.raises(OSError, match="No space left"):
        path.with_suffix(".more").write_bytes(bytes(4096))


def test_a_disk_that_is_really_full(tmp_path, small_disk):
    """It goes on estimating and says so; when there is room all of it is on record, with the bits of a fleet."""
    y, data, filler = outputs(SERIES, SAMPLES), tmp_path / "samples.jsonl", small_disk / "filler"
    data.touch()
    config = tmp_path / "live.toml"
    config.write_text(
        f'[model]\nmodel = "ar:2"\n[store]\npath = "{small_disk / "store"}"\nfsync = 0.2\n[web]\nport = 0\n'
        f'[[source]]\nkind = "file"\npath = "{data}"\n'
    )
    service = started(config, stderr=subprocess.PIPE)
    address = address_of(service)

    def say(first, last):
        with data.open("a") as file:
            file.write(lines(y, first, last))

    def counts(last):
        return all(one["count"] == last for one in asked(f"{address}/api/series")["series"])

    def wait(condition):
        Broker.wait(condition, 60)

    say(0, 100)
    wait(lambda: counts(100) and len(asked(f"{address}/api/series")["series"]) == SERIES)
    fill(filler)
    for last in (200, 300, 400):
        say(last - 100, last)
        wait(lambda last=last: counts(last))
    told = notes(address)
    assert any("nothing can be written" in note and "estimating goes on" in note for note in told), told
    assert not asked(f"{address}/health")["healthy"]
    filler.unlink()
    wait(lambda: not notes(address))
    say(400, 600)
    wait(lambda: counts(600))
    assert ended(service) == 0
    service.stderr.close()
    core = opened(small_disk / "store")
    assert found(core) == states(y)
    assert sum(len(rows) for _, rows in core.history.recent) == SERIES * SAMPLES
    core.store.close()
