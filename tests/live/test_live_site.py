"""The service with its page: samples in by HTTP, the same numbers out."""

import json
import signal
import subprocess
import sys
import urllib.request

import pytest
from live_plant import found as kept
from live_plant import lines, opened, outputs, states

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")
pytest.importorskip("sse_starlette")
pytest.importorskip("prometheus_client")


def asked(address, data=None):
    kind = {"Content-Type": "application/x-ndjson", "X-Driftwise": "1"} if data else {}
    with urllib.request.urlopen(urllib.request.Request(address, data, kind), timeout=60) as answer:
        return json.loads(answer.read())


def test_samples_by_http_are_estimated_and_told(tmp_path):
    y = outputs(5, 300)
    path = tmp_path / "live.toml"
    path.write_text(f'[model]\nmodel = "ar:2"\n[store]\npath = "{tmp_path / "store"}"\n[web]\nport = 0\n')
    service = subprocess.Popen([sys.executable, "-m", "driftwise", "live", path], stderr=subprocess.PIPE, text=True)
    try:
        address = service.stderr.readline().split()[-1]
        for at in range(0, 300, 50):
            told = asked(f"{address}/samples", lines(y, at, at + 50).encode())
            assert told == {"taken": 250, "refused": 0, "reason": ""}
        series = asked(f"{address}/api/series")["series"]
        assert [one["key"] for one in series] == [f"s{i}" for i in range(5)]
        one = asked(f"{address}/api/series/s3")
        assert one["count"] == 300
        assert one["output"] == pytest.approx(y[3, -1], rel=1e-12)
        assert len(one["parameters"]) == 3
        past = asked(f"{address}/api/series/s3/history")
        assert past["output"] == pytest.approx(y[3].tolist(), rel=1e-12)
        assert asked(f"{address}/health")["healthy"]
    finally:
        service.send_signal(signal.SIGTERM)
        assert service.wait(30) == 0
        service.stderr.close()
    assert kept(opened(tmp_path / "store")) == states(y)
