"""The page: a handful of files that are read once, so that no path from the network reaches the file system."""

from __future__ import annotations

import hashlib
from importlib.resources import files
from typing import NamedTuple

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

MEDIA = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}


class Page(NamedTuple):
    """A file as it is sent."""

    content: bytes
    media: str
    tag: str


def read() -> dict[str, Page]:
    """Return the files of the page by name."""
    found = {}
    for item in files(__package__).joinpath("static").iterdir():
        media = MEDIA.get(item.name[item.name.rfind(".") :])
        if media:
            content = item.read_bytes()
            found[item.name] = Page(content, media, f'"{hashlib.sha256(content).hexdigest()[:16]}"')
    return found


def answer(request: Request, pages: dict[str, Page], name: str) -> Response:
    """Return a file; nothing but its tag where the browser has it."""
    page = pages.get(name)
    if page is None:
        raise HTTPException(404, "no such file")
    headers = {"ETag": page.tag, "Cache-Control": "no-cache"}
    if request.headers.get("if-none-match") == page.tag:
        return Response(status_code=304, headers=headers)
    return Response(page.content, headers=headers, media_type=page.media)
