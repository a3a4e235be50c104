"""A Prometheus of Debian scrapes the service and fires the rules of `deploy/`; deploy files hold what they promise."""

import configparser
import json
import re
import shutil
import socket
import subprocess
import time
from pathlib import Path
from urllib.request import urlopen

import pytest

pytest.importorskip("starlette", reason='pip install "driftwise[live]"')
from live.simulated_board import Simulated
from live.simulated_site import Running

from driftwise.live.web.access import Access, hashed
from driftwise.live.web.metrics import Picture, exposition

DEPLOY = Path(__file__).resolve().parents[3] / "deploy"
RULES = DEPLOY / "prometheus-rules.yml"


def names_of(board):
    """Return the names of all metrics that are told."""
    text, _ = exposition(Picture(board.series(), board.health(), board.counters(), 1000), "")
    return set(re.findall(r"^(\w+)", text.decode(), re.MULTILINE))


def test_rules_and_dashboard_speak_of_metrics_that_exist():
    board = Simulated(["a"], at=1.7e9)
    board.tick()
    dashboard = json.loads((DEPLOY / "grafana.json").read_text())
    asked = [target["expr"] for panel in dashboard["panels"] for target in panel.get("targets", [])]
    found = set(re.findall(r"driftwise_\w+", RULES.read_text() + " ".join(asked)))
    assert len(found) > 5 and found <= names_of(board), found - names_of(board)


def test_the_unit_locks_the_service_in():
    unit = configparser.RawConfigParser(strict=False)
    unit.optionxform = str
    unit.read(DEPLOY / "driftwise.service")
    service = unit["Service"]
    for name in (
        "DynamicUser",
        "NoNewPrivileges",
        "PrivateTmp",
        "ProtectHome",
        "ProtectKernelModules",
        "LockPersonality",
    ):
        assert service[name] == "yes", name
    assert service["ProtectSystem"] == "strict" and service["CapabilityBoundingSet"] == ""
    assert "driftwise live" in service["ExecStart"] and service["Restart"] == "on-failure"


def test_the_image_runs_as_nobody_and_asks_after_its_health():
    text = (DEPLOY / "Dockerfile").read_text()
    assert re.search(r"^FROM python:[\d.]+-slim", text, re.MULTILINE)
    assert re.search(r"^USER (?!root)\w+", text, re.MULTILINE) and re.search(r"^HEALTHCHECK", text, re.MULTILINE)


@pytest.mark.service
@pytest.mark.skipif(shutil.which("prometheus") is None, reason="no prometheus on the PATH: SCRAPING WAS NOT TESTED")
def test_prometheus_scrapes_and_its_rule_fires(tmp_path):
    board = Simulated(["hall 1/pump 1", 'hall 2/"pump" 2'])
    for _ in range(30):
        board.tick()
    for seen in list(board.told):
        board.acknowledge(seen.number)
    site = Running(board, Access(hashed("scraper")))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        own = f"127.0.0.1:{free.getsockname()[1]}"
    rules = re.sub(r"for: \d+[ms]", "for: 0s", RULES.read_text())
    (tmp_path / "rules.yml").write_text(rules)
    (tmp_path / "prometheus.yml").write_text(
        "global: {scrape_interval: 1s, evaluation_interval: 1s}\nrule_files: [rules.yml]\n"
        "scrape_configs:\n  - job_name: driftwise\n    authorization: {credentials: scraper}\n"
        f"    static_configs: [{{targets: ['127.0.0.1:{site.port}']}}]\n"
    )
    options = [
        f"--config.file={tmp_path}/prometheus.yml",
        f"--storage.tsdb.path={tmp_path}/db",
        f"--web.listen-address={own}",
    ]
    with open(tmp_path / "log", "w") as log:
        process = subprocess.Popen(["prometheus", *options], stdout=log, stderr=log)
    try:
        output = wait_for(own, "query?query=driftwise_series_output", lambda data: data["result"])
        assert {one["metric"]["series"] for one in output} == set(board.keys)
        values = {one["metric"]["series"]: float(one["value"][1]) for one in output}
        assert values == {view.key: view.output for view in board.series()}
        assert alerts(own) == set()
        site.do(board.happened, board.keys[1], "jump", "b1 jumped")
        wait_for(own, "alerts", lambda data: ("DriftwiseSeriesNeedsALook", board.keys[1]) in firing(data))
        site.do(board.acknowledge, board.told[-1].number)
        wait_for(own, "alerts", lambda data: not firing(data))
        site.stop()
        wait_for(own, "alerts", lambda data: ("DriftwiseUnwell", None) in firing(data))
    finally:
        process.terminate()
        process.wait(20)
        if site.thread.is_alive():
            site.stop()


def firing(data):
    """Return names and series of the alerts that fire; five minutes of a service of seconds say nothing."""
    found = {
        (one["labels"]["alertname"], one["labels"].get("series")) for one in data["alerts"] if one["state"] == "firing"
    }
    return {one for one in found if one[0] != "DriftwiseNoSamples"}


def alerts(own):
    return firing(wait_for(own, "alerts", lambda data: data))


def wait_for(own, question, found, seconds=60):
    """Return what `found` finds in the answer of Prometheus as soon as it is something."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            with urlopen(f"http://{own}/api/v1/{question}", timeout=5) as answer:
                data = json.load(answer)["data"]
            if found(data):
                return data["result"] if "result" in data else data
        except OSError:
            pass
        time.sleep(0.3)
    raise AssertionError(f"Prometheus never said so: {question}")
