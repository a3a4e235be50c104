"""Webhooks are signed and tried again; nothing that was committed stays untold."""

import asyncio
import hashlib
import hmac
import json
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from driftwise.live.board import EventView
from driftwise.live.outputs import webhook
from driftwise.live.outputs.log import LogOutput
from driftwise.live.outputs.webhook import SIGNATURE, WebhookOutput


@pytest.fixture
def hook(monkeypatch):
    """A server that answers as it is told, and keeps what it was sent."""
    answers, came = [], []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            body = self.rfile.read(int(self.headers["Content-Length"]))
            came.append((self.headers.get(SIGNATURE), body))
            self.send_response(answers.pop(0) if answers else 204)
            self.end_headers()

        def log_message(self, *words):
            pass

    server = HTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    monkeypatch.setattr(webhook, "FIRST", 0.01)
    monkeypatch.setenv("DRIFTWISE_WEBHOOK_SECRET", "s3cret")
    yield WebhookOutput(f"http://127.0.0.1:{server.server_port}/alarms?token=x"), answers, came
    server.shutdown()
    server.server_close()


def delivered(output, events):
    """Return what was noted, and the numbers told as delivered."""
    notes, numbers = [], []

    async def go():
        queue = asyncio.Queue()
        queue.put_nowait(events)
        task = asyncio.create_task(
            output.run(queue, lambda name, words: notes.append(words), lambda name, number: numbers.append(number))
        )
        while not numbers or numbers[-1] < events[-1].number:
            await asyncio.sleep(0.005)
        task.cancel()

    asyncio.run(asyncio.wait_for(go(), 20))
    return notes, numbers


def some(count):
    return [EventView(i, "pump", 1e9 + i, "jump", "moved", 2.0) for i in range(1, count + 1)]


def test_a_webhook_is_signed(hook):
    output, _, came = hook
    delivered(output, some(2))
    signature, body = came[0]
    assert signature == "sha256=" + hmac.new(b"s3cret", body, hashlib.sha256).hexdigest()
    assert [event["number"] for event in json.loads(body)["events"]] == [1, 2]


def test_it_is_tried_again_and_events_keep_their_order(hook):
    output, answers, came = hook
    answers += [500, 503, 429]
    notes, numbers = delivered(output, some(250))
    assert [word for word in notes if word] == ["answers 500", "answers 503", "answers 429"]
    assert numbers == [100, 200, 250]
    taken = [event["number"] for _, body in came[3:] for event in json.loads(body)["events"]]
    assert taken == list(range(1, 251))


def test_a_refusal_is_final_and_told(hook):
    output, answers, came = hook
    answers += [400]
    notes, numbers = delivered(output, some(1))
    assert (notes, numbers, len(came)) == (["answers 400"], [1], 1)


def test_its_name_tells_no_secret(hook):
    assert "token" not in hook[0].name


@pytest.mark.parametrize("form", ["text", "json"])
def test_the_log(tmp_path, form):
    path = tmp_path / "log"
    delivered(LogOutput(form, str(path)), some(2))
    lines = path.read_text().splitlines()
    assert len(lines) == 2
    assert lines[0].startswith("2001-09-09T01:46:41.000+00:00 pump: jump: moved" if form == "text" else '{"number": 1')
