"""What programs are answered; the oracle is the board itself, read in the test."""

import json
import math
from urllib.parse import quote

import pytest

pytest.importorskip("starlette", reason='pip install "driftwise[live]"')
pytest.importorskip("httpx")

from live.simulated_board import Simulated
from starlette.testclient import TestClient

from driftwise.live.board import ParameterRow, Row, Sample
from driftwise.live.web.access import Access, hashed
from driftwise.live.web.app import application
from driftwise.live.web.encode import history, past
from driftwise.live.web.limits import Limits

KEYS = ["pump 1", "hall/a", "x/history", "<b>&\"'", "größe\u2028"]
HOME = "http://127.0.0.1:8765"


@pytest.fixture
def board():
    board = Simulated(KEYS, at=1.7e9)
    for _ in range(30):
        board.tick()
    return board


@pytest.fixture
def ask(board):
    with TestClient(application(board, limits=Limits(body=1000)), base_url=HOME) as client:
        yield client


def test_every_series_as_it_is(board, ask):
    told = ask.get("/api/series").json()["series"]
    assert [one["key"] for one in told] == KEYS
    for one, view in zip(told, board.series()):
        assert (one["output"], one["prediction"], one["low"], one["high"]) == (view.output, view.prediction, *view.band)
        assert (one["count"], one["time"], one["status"], one["nis"]) == (view.count, view.time, view.status, view.nis)


@pytest.mark.parametrize("key", KEYS)
def test_one_series_whatever_its_name(board, ask, key):
    told, view = ask.get(f"/api/series/{quote(key, safe='')}").json(), board.view(key)
    assert [(p["name"], p["value"], p["std"]) for p in told["parameters"]] == list(map(tuple, view.parameters))
    assert told["model"] == view.model and told["ahead"] == [list(step) for step in view.ahead]
    assert told["sparkline"] == list(view.sparkline)
    found = ask.get(f"/api/series/{quote(key, safe='')}/history?start={board.time - 9.5}").json()
    assert found["output"] == [row.output for row in board.rows[key][-10:]] and len(found["time"]) == 10
    rows = [row for row in board.past[key] if row.time >= board.time - 9.5]
    assert found["past"]["time"] == sorted({row.time for row in rows}) and rows
    for one in found["past"]["parameters"]:
        assert list(zip(one["value"], one["std"])) == [row[2:] for row in rows if row.name == one["name"]]


def test_paths_that_lead_nowhere(ask):
    for path in ("/api/series/none", "/api/series/hall/a", "/api/series/pump%201/future", "/api/series/", "/nowhere"):
        answer = ask.get(path)
        assert answer.status_code == 404 and answer.json()["detail"]
    for path in ("/static/..%2fapp.py", "/static/%2e%2e/app.py", "/static//etc/passwd", "/static/app.py"):
        assert ask.get(path).status_code == 404


def test_a_long_history_keeps_its_extremes():
    rows = [Row(float(t), math.sin(t), 0.0, 1.0, 0) for t in range(10_000)]
    rows[5001] = rows[5001]._replace(output=50.0)
    rows[7003] = rows[7003]._replace(output=math.nan)
    told = history(rows, 100)
    assert len(told["time"]) <= 100 and told["time"] == sorted(told["time"]) and max(told["output"]) == 50.0
    assert history(rows[7000:7006], 100)["output"][3] is None


def test_a_long_past_of_parameters_is_thinned_and_a_model_may_change():
    rows = [
        ParameterRow(float(t), name, float(t), 1.0) for t in range(1000) for name in ("a1", "b1" if t < 500 else "c1")
    ]
    told = past(rows, 100)
    assert len(told["time"]) == 100 and told["time"][0] == 0.0 and told["time"][-1] == 999.0
    a1, b1, c1 = told["parameters"]
    assert [one["name"] for one in (a1, b1, c1)] == ["a1", "b1", "c1"] and a1["value"] == told["time"]
    assert b1["value"][:50] == told["time"][:50] and set(b1["value"][50:]) == {None} == set(c1["std"][:50])
    assert past(rows[:10], 100)["time"] == [0.0, 1.0, 2.0, 3.0, 4.0] and past([], 9) == {"time": [], "parameters": []}


def test_events_are_told_in_order_and_acknowledged(board, ask):
    board.told.clear()
    for k in range(3):
        board.happened(KEYS[k % 2], "jump", f"<i>{k}</i>")
    told = ask.get("/api/events?since=1").json()
    assert [one["sentence"] for one in told["events"]] == ["<i>1</i>", "<i>2</i>"] and told["more"] is False
    assert [one["number"] for one in ask.get(f"/api/events?key={KEYS[0]}&limit=1").json()["events"]] == [1]
    assert ask.post("/api/events/3/acknowledge").json()["acknowledged"] is True
    assert board.told[2].acknowledged and not board.told[0].acknowledged
    assert ask.post("/api/events/99/acknowledge").status_code == 404
    assert ask.get("/api/events/3/acknowledge").status_code == 405
    assert ask.get("/api/events?since=nan").status_code == 400


INFLUX = {"content-type": "text/plain; charset=utf-8"}


def test_samples_are_handed_on(board, ask):
    lines = '{"key": "a", "time": 5, "value": 1}\n{"key": "b", "flow": [2, null], "speed": [3, 4], "time": [6, 7.5]}'
    assert ask.post("/samples", content=lines).json() == {"taken": 3, "refused": 0, "reason": ""}
    assert ask.post("/samples", content="pump,hall=1 flow=3.5 2000000000", headers=INFLUX).json()["taken"] == 1
    one, two, three, four = board.posted
    assert one == Sample("a", {"value": 1.0}, 5.0) and two == Sample("b", {"flow": 2.0, "speed": 3.0}, 6.0)
    assert (three.key, three.time, three.values["speed"]) == ("b", 7.5, 4.0) and math.isnan(three.values["flow"])
    assert four == Sample("pump/1", {"flow": 3.5}, 2.0)


def test_lines_that_cannot_be_used_are_counted(board, ask):
    told = ask.post("/samples", content='{"key": "a", "value": 1}\nnonsense\n{"value": 2}\n{"key": "c", "value": 3}')
    assert told.status_code == 200 and (told.json()["taken"], told.json()["refused"]) == (2, 2)
    assert "nonsense" in told.json()["reason"] and [one.key for one in board.posted] == ["a", "c"]
    assert board.posted[0].time is None, "the moment of receipt"


def test_bodies_that_are_refused(board, ask):
    line = '{"key": "a", "value": 1}\n'
    assert ask.post("/samples", content="nonsense").status_code == 400
    assert ask.post("/samples", content=line, headers={"content-type": "image/png"}).status_code == 415
    assert ask.post("/samples", content=line, headers={"content-encoding": "gzip"}).status_code == 415
    assert ask.post("/samples", content=line * 100).status_code == 413
    assert ask.post("/samples", content=(line.encode() for _ in range(100))).status_code == 413, "of unknown length"
    assert board.posted == []


def test_pages_of_others_may_not_post(board, ask):
    elsewhere = {"origin": "http://evil.example", "sec-fetch-site": "cross-site"}
    assert ask.post("/samples", content="{}", headers=elsewhere).status_code == 403
    assert ask.get("/api/series", headers={"host": "evil.example"}).status_code == 421, "a name that was rebound"
    assert board.posted == []


def test_numbers_that_json_does_not_know(board, ask):
    import dataclasses

    broken = dataclasses.replace(board.views["pump 1"], output=math.nan, band=(-math.inf, math.inf), nis=math.nan)
    board.views["pump 1"] = broken
    text = ask.get("/api/series/pump%201").text
    told = json.loads(text, parse_constant=lambda name: pytest.fail(name))
    assert told["output"] is None and told["low"] is None and told["nis"] is None


def test_health_tells_when_it_is_not(board, ask):
    assert ask.get("/health").status_code == 200 and ask.get("/ready").json() == {"ready": True}
    board.is_healthy = False
    assert ask.get("/health").status_code == 503


def test_every_answer_carries_the_policy(ask):
    for path in ("/", "/api", "/static/app.js", "/api/series", "/nowhere", "/metrics"):
        headers = ask.get(path).headers
        policy = headers["content-security-policy"]
        assert "default-src 'none'" in policy and "script-src 'self'" in policy and "unsafe" not in policy
        assert headers["x-content-type-options"] == "nosniff" and "server" not in headers
    assert ask.get("/", headers={"if-none-match": ask.get("/").headers["etag"]}).status_code == 304


def test_the_document_lists_what_is_routed(ask):
    paths = ask.get("/openapi.json").json()["paths"]
    routed = {route.path for route in ask.app.routes} - {"/", "/api", "/static/{name}", "/openapi.json"}
    plain = {path.replace("{number:int}", "{number}") for path in routed if "{rest:path}" not in path}
    assert plain | {"/api/series/{key}", "/api/series/{key}/history"} == set(paths)


def test_with_a_token_nothing_is_told_without_it(board):
    access = Access(hashed("secret"))
    with TestClient(application(board, access), base_url="https://plant.example") as ask:
        for path in ("/api/series", "/api/series/pump%201", "/api/events", "/metrics", "/stream", "/api/service"):
            assert ask.get(path).status_code == 401
        assert ask.post("/samples", content="{}").status_code == 401
        for path in ("/", "/static/app.js", "/health", "/ready", "/api", "/openapi.json"):
            assert ask.get(path).status_code == 200
        assert ask.get("/api/series", headers={"authorization": "Bearer wrong"}).status_code == 401
        assert ask.get("/api/series", headers={"authorization": "Bearer secret"}).status_code == 200
        assert ask.post("/sign-in", content="wrong").status_code == 401
        signed = ask.post("/sign-in", content="secret")
        cookie = signed.headers["set-cookie"].lower()
        assert "httponly" in cookie and "samesite=strict" in cookie and "secure" in cookie and "secret" not in cookie
        assert ask.get("/api/series").status_code == 200, "the cookie is enough now"


def test_wrong_tokens_are_counted(board):
    limits = Limits(trials=3)
    with TestClient(application(board, Access(hashed("secret")), limits), base_url=HOME) as ask:
        tried = [ask.get("/metrics", headers={"authorization": f"Bearer {k}"}).status_code for k in range(5)]
        assert tried == [401, 401, 401, 429, 429]
        assert ask.get("/metrics", headers={"authorization": "Bearer secret"}).status_code == 429, "not a trial more"


def test_requests_are_counted(board):
    with TestClient(application(board, limits=Limits(rate=0.001, burst=3)), base_url=HOME) as ask:
        assert [ask.get("/health").status_code for _ in range(5)] == [200, 200, 200, 429, 429]
