"""What an open page is told: everything at first, then what changed, then the end."""

import asyncio
import json

import pytest

pytest.importorskip("sse_starlette", reason='pip install "driftwise[live]"')
from live.simulated_board import Simulated

from driftwise.live.web import stream
from driftwise.live.web.encode import LAST
from driftwise.live.web.stream import Hub


def follow(board, act, key=None, wanted=3):
    """Run a hub and one page; `act` is called after each message; return the messages."""

    async def run():
        hub, found = Hub(board, 4), []
        looking = asyncio.create_task(hub.run())
        async with asyncio.timeout(20):
            async for message in hub.messages(key):
                found.append((message.event, json.loads(message.data)))
                if len(found) == wanted:
                    hub.close()
                elif len(found) < wanted:
                    act(board, hub)
        assert not hub._queues, "a page that is gone is forgotten"
        looking.cancel()
        return found

    return asyncio.run(run())


def test_all_then_what_changed():
    board = Simulated(["a", "b"], at=1.7e9)
    board.tick()
    found = follow(board, lambda board, hub: board.tick(["b"]))
    assert [name for name, _ in found] == ["all", "changed", "changed"]
    assert found[0][1]["columns"] == list(LAST) and [row[0] for row in found[0][1]["rows"]] == ["a", "b"]
    last = dict(zip(LAST, found[-1][1]["rows"][-1]))
    assert last["key"] == "b" and last["count"] == board.views["b"].count and last["output"] == board.views["b"].output


def test_one_series_is_told_whole():
    board = Simulated(["a", "b"], at=1.7e9)
    board.tick()
    found = follow(board, lambda board, hub: board.tick(["a"]), key="a", wanted=4)
    assert [name for name, _ in found] == ["all", "series", "changed", "series"]
    assert [p["name"] for p in found[-1][1]["parameters"]] == ["a1", "b1"]
    assert follow(board, lambda board, hub: None, key="nobody", wanted=2)[1][1] == {"key": "nobody", "missing": True}


def test_a_page_too_far_behind_begins_anew(monkeypatch):
    monkeypatch.setattr(stream, "BACKLOG", 3)
    board = Simulated(["a"], at=1.7e9)

    def hurry(board, hub):
        for _ in range(8):
            board.tick()
            hub.look()

    found = follow(board, hurry, wanted=2)
    assert [name for name, _ in found] == ["all", "all"] and found[1][1]["rows"][0][3] == 8
