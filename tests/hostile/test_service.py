"""Requests that once broke a live service."""

import pytest

from hostile.service import Request, served

pytest.importorskip("starlette")
SAMPLES = b"POST /samples HTTP/1.1\r\nHost: localhost\r\nX-Driftwise: 1\r\nContent-Type: application/x-ndjson\r\n"
CHUNKS = b" HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n"
LATE = b'{"key": "%s", "time": 1e300, "value": 1}' % (b"k " * 2500)
BROKE = {
    "a body that breaks off": (SAMPLES + b'Content-Length: 99\r\n\r\n{"key"', True),
    "an event beyond every number": (
        b"POST /api/events/99999999999999999999/acknowledge HTTP/1.1\r\nHost: localhost\r\nX-Driftwise: 1\r\n\r\n",
        False,
    ),
    "events since such a one": (b"GET /api/events?since=1e300 HTTP/1.1\r\nHost: localhost\r\n\r\n", False),
    "a long key, far ahead": (SAMPLES + b"Content-Length: %d\r\n\r\n%s" % (len(LATE), LATE), False),
    "a body of chunks that are none": (
        b"GET /api/series HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nno\r\n", False,
    ),
    "the same, and only the head is asked for": (
        b"HEAD /api/series HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nno\r\n", False,
    ),
    "no HTTP at all": (b"\x16\x03\x01 hello\r\n\r\n", True),
    "no HTTP, when it was answered already": (b"GET /api/series" + CHUNKS, False, b"no\r\n\r\n"),
    "no HTTP, while events are told": (b"GET /stream" + CHUNKS, True, b"no\r\n\r\n"),
}  # fmt: skip


def test_what_once_broke_a_service_is_answered_or_refused(tmp_path):
    with served(tmp_path) as service:
        wrong = {told: service.tried(Request(data, told, *more))[0] for told, (data, *more) in BROKE.items()}
        after, outcome = service.end()
    assert not any(wrong.values()) and not after, (wrong, after)
    page, *refused = outcome.err.splitlines()  # where it is, and what was refused; nothing of what strangers sent
    assert "http://" in page and [line[:9] for line in refused] == ["not used,"] and "k k" not in refused[0], (
        outcome.err
    )
