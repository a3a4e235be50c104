"""Who may speak to the service: a token of which only the hash is kept, and pages of our own."""

from __future__ import annotations

import base64
import hashlib
import hmac
import ipaddress
import secrets
import time
from collections.abc import Mapping

from driftwise.engine.errors import InputError

COST, BLOCK, LANES, SALT = 2**14, 8, 1, 16  # of scrypt: 16 MiB and some 50 ms a trial
LONGEST = 256  # characters of a token that are looked at
SESSION = 30 * 86400  # s that a browser stays signed in
COOKIE = "driftwise"


def new_token() -> str:
    """Return a token nobody guesses: 256 bits."""
    return secrets.token_urlsafe(32)


def hashed(token: str, salt: bytes | None = None) -> str:
    """Return what is written into the settings in place of `token`: scrypt (Percival, 2009; RFC 7914) with a salt.

    >>> hashed("secret").split("$")[:4]
    ['scrypt', '16384', '8', '1']
    """
    salt = secrets.token_bytes(SALT) if salt is None else salt
    found = hashlib.scrypt(token.encode(), salt=salt, n=COST, r=BLOCK, p=LANES, dklen=32)
    texts = (base64.b64encode(part).decode() for part in (salt, found))
    return "$".join(["scrypt", str(COST), str(BLOCK), str(LANES), *texts])


def is_loopback(host: str) -> bool:
    """Return whether only this machine reaches what listens at `host`."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def check_binding(host: str, token_hash: str | None) -> None:
    """Refuse to listen beyond this machine without a token."""
    if token_hash is None and not is_loopback(host):
        raise InputError(
            f"whoever reaches {host} could read and write; listen at 127.0.0.1, or give a token: "
            "`driftwise live token` prints one and the line of the settings that holds its hash."
        )


class Access:
    """Whether a request may pass: by the token in ``Authorization: Bearer`` or by the cookie of a signed-in browser.

    Without a token everything on this machine passes. A token is compared with its scrypt hash once, later with a
    keyed hash that only this process knows, both in constant time. Bad at telling people apart: there is one token.

    Parameters
    ----------
    token_hash : what `hashed` returned, or None where only this machine listens
    """

    def __init__(self, token_hash: str | None = None):
        self.token_hash = token_hash
        self._key, self._known = secrets.token_bytes(32), b""
        if token_hash is not None:
            self._salt, self._hash = _parts(token_hash)
            self._seal = hashlib.sha256(b"driftwise session" + self._hash).digest()

    @property
    def is_open(self) -> bool:
        return self.token_hash is None

    def is_remembered(self, token: str) -> bool:
        """Return whether `token` is the one that passed before; costs nothing."""
        mine = hmac.digest(self._key, token[:LONGEST].encode(), "sha256")
        return hmac.compare_digest(mine, self._known)

    def is_right(self, token: str) -> bool:
        """Return whether `token` is the one; takes some 50 ms, so it is asked for in a thread."""
        if not token or len(token) > LONGEST:
            return False
        found = hashlib.scrypt(token.encode(), salt=self._salt, n=COST, r=BLOCK, p=LANES, dklen=32)
        if hmac.compare_digest(found, self._hash):
            self._known = hmac.digest(self._key, token.encode(), "sha256")
            return True
        return False

    def session(self, now: float | None = None) -> str:
        """Return the value of a cookie: until when it holds, and the seal over it. A new token ends all sessions."""
        until = str(int((time.time() if now is None else now) + SESSION))
        return f"{until}.{self._sealed(until)}"

    def has_session(self, cookie: str, now: float | None = None) -> bool:
        until, _, seal = cookie[:LONGEST].partition(".")
        if not hmac.compare_digest(seal.encode(), self._sealed(until).encode()):
            return False
        return float(until) > (time.time() if now is None else now)

    def _sealed(self, until: str) -> str:
        return hmac.new(self._seal, until.encode(), "sha256").hexdigest()


def _parts(token_hash: str) -> tuple[bytes, bytes]:
    """Return salt and hash as `hashed` wrote them."""
    try:
        kind, cost, block, lanes, salt, found = token_hash.split("$")
        parts = base64.b64decode(salt, validate=True), base64.b64decode(found, validate=True)
    except ValueError:
        kind, cost, block, lanes, parts = "", "", "", "", (b"", b"")
    if (kind, cost, block, lanes) != ("scrypt", str(COST), str(BLOCK), str(LANES)) or len(parts[1]) != 32:
        raise InputError("the hash of the token is not one that `driftwise live token` printed.")
    return parts


def is_ours(headers: Mapping[str, str]) -> bool:
    """Return whether a request that changes something comes from our page or from no page at all.

    Browsers say where a request was begun: a page of someone else's may not acknowledge alarms or post samples.
    """
    if headers.get("sec-fetch-site", "same-origin") not in ("same-origin", "none"):
        return False
    origin = headers.get("origin")
    return origin is None or origin.partition("://")[2] == headers.get("host")


def is_named_here(headers: Mapping[str, str]) -> bool:
    """Return whether the host asked for is this machine: a name of someone else's that leads here is refused."""
    host = headers.get("host", "")
    name = host[: host.find("]") + 1] if host.startswith("[") else host.partition(":")[0]
    return is_loopback(name)
