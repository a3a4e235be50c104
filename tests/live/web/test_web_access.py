"""Who may speak to the service, and how much; oracles are hashlib's own scrypt and plain arithmetic."""

import base64
import hashlib

import pytest

pytest.importorskip("starlette", reason='pip install "driftwise[live]"')

from driftwise.engine.errors import InputError
from driftwise.live.web.access import SESSION, Access, check_binding, hashed, is_ours, new_token
from driftwise.live.web.limits import Buckets


def test_the_hash_is_scrypt_with_a_salt_of_its_own():
    one, other = hashed("secret"), hashed("secret")
    kind, n, r, p, salt, found = one.split("$")
    plain = hashlib.scrypt(b"secret", salt=base64.b64decode(salt), n=int(n), r=int(r), p=int(p), dklen=32)
    assert kind == "scrypt" and base64.b64decode(found) == plain and one != other and "secret" not in one


def test_one_token_passes_and_is_remembered():
    token = new_token()
    access = Access(hashed(token))
    assert not access.is_remembered(token) and not access.is_remembered("")
    assert not access.is_right(token[:-1]) and not access.is_right("") and not access.is_right("x" * 10_000)
    assert access.is_right(token) and access.is_remembered(token) and not access.is_remembered(token + " ")
    assert access.is_right("wrong") is False and access.is_remembered(token)


@pytest.mark.parametrize("text", ["", "secret", "scrypt$1$8$1$AA==$AA==", "scrypt$16384$8$1$!$!", "md5$a$b$c$d$e"])
def test_what_is_no_hash_is_refused(text):
    with pytest.raises(InputError, match="driftwise live token"):
        Access(text)


def test_a_session_ends_and_cannot_be_made_up():
    kept = hashed("secret")
    access = Access(kept)
    cookie = access.session(now=1000.0)
    assert access.has_session(cookie, now=1000.0 + SESSION - 1) and Access(kept).has_session(cookie, now=1000.0)
    assert not access.has_session(cookie, now=1000.0 + SESSION + 1)
    assert not Access(hashed("secret")).has_session(cookie, now=1000.0), "a new hash ends all sessions"
    until, seal = cookie.split(".")
    for made_up in ("", ".", f"{int(until) + 9}.{seal}", f"{until}.", f"nan.{seal}", "\xff.\xff", cookie[:-1] + "0z"):
        assert not access.has_session(made_up, now=1000.0)


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1", "127.9.9.9"])
def test_this_machine_needs_no_token(host):
    check_binding(host, None)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.4", "plant.example", "127.0.0.1.example", ""])
def test_beyond_it_a_token_is_needed(host):
    with pytest.raises(InputError, match="token"):
        check_binding(host, None)
    check_binding(host, hashed("secret"))


@pytest.mark.parametrize(
    "headers, passes",
    [
        ({"host": "127.0.0.1:8765"}, True),
        ({"host": "127.0.0.1:8765", "origin": "http://127.0.0.1:8765", "sec-fetch-site": "same-origin"}, True),
        ({"host": "127.0.0.1:8765", "origin": "http://evil.example", "sec-fetch-site": "cross-site"}, False),
        ({"host": "127.0.0.1:8765", "origin": "http://127.0.0.1:9999"}, False),
        ({"host": "127.0.0.1:8765", "origin": "null"}, False),
        ({"host": "127.0.0.1:8765", "sec-fetch-site": "same-site"}, False),
    ],
)
def test_pages_of_others_change_nothing(headers, passes):
    assert is_ours(headers) is passes


def test_buckets_refill_and_forget_the_quietest():
    buckets = Buckets(rate=2.0, burst=3.0, addresses=2)
    assert [buckets.take("a", 0.0) for _ in range(4)] == [True, True, True, False]
    assert buckets.left("a", 1.0) == 2.0 and [buckets.take("a", 1.0) for _ in range(3)] == [True, True, False]
    assert buckets.take("b", 1.0) and buckets.take("c", 1.0)
    assert buckets.left("a", 1.0) == 3.0, "the address that was quiet longest is forgotten"
