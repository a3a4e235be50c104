"""The table of what can be asked for: paths, handlers and their description are written here, once."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from starlette.routing import Route

from driftwise.version import __version__

from .rest import Api

JSON, NDJSON, TEXT = "application/json", "application/x-ndjson", "text/plain"
NUMBER = {"type": ["number", "null"]}
EVENT = {
    "type": "object",
    "properties": {
        "number": {"type": "integer", "description": "counts up without holes"},
        "key": {"type": "string"},
        "time": {**NUMBER, "description": "seconds since 1970"},
        "kind": {"enum": ["jump", "drift", "noise", "stuck", "lost", "outliers", "silent", "back", "model", "clock"]},
        "sentence": {"type": "string"},
        "odds": {**NUMBER, "description": "the detector's statistic over its threshold"},
        "acknowledged": {"type": "boolean"},
    },
}
TEXTS = {
    "key": "what it is called in the data",
    "name": "what it is called here",
    "unit": "of the output",
    "status": "well, or what is the matter",
    "model": "in words",
}
SERIES = {
    "type": "object",
    "properties": {
        **{name: {"type": "string", "description": about} for name, about in TEXTS.items()},
        "count": {"type": "integer", "description": "samples taken"},
        "time": {**NUMBER, "description": "seconds since 1970 of the last sample"},
        "output": NUMBER,
        "prediction": NUMBER,
        "low": {**NUMBER, "description": "of the band of 95 % of the prediction"},
        "high": NUMBER,
        "nis": {**NUMBER, "description": "mean squared surprise over its variance, 1 where error bars are true"},
        "score": {"type": "number", "description": "who needs a look: the larger, the sooner; 0 needs none"},
        "acknowledged": {"type": "boolean"},
        "event": {"oneOf": [EVENT, {"type": "null"}], "description": "the last one"},
        "parameters": {"type": "array", "description": "name, value, std of each; only of one series"},
        "ahead": {"type": "array", "description": "forecasts of the next outputs: prediction, low, high each"},
    },
}


@dataclass(frozen=True)
class Asked:
    """One row of the table; ``query`` are names and meanings of parameters, ``body`` media types and what they hold."""

    method: str
    path: str
    handler: str
    about: str
    query: dict[str, str] = field(default_factory=dict)
    body: dict[str, str] = field(default_factory=dict)
    media: str = JSON
    schema: dict[str, Any] = field(default_factory=dict)


TABLE = [
    Asked("GET", "/api/series", "series", "Every series as it is now", schema={"type": "array", "items": SERIES}),
    Asked("GET", "/api/series/{key}", "one", "One series: state, parameters, bands, model, events", schema=SERIES),
    Asked(
        "GET",
        "/api/series/{key}/history",
        "one",
        "Columns of the past of a series, and of its parameters; of many rows the extremes of each stretch",
        {"start": "seconds since 1970", "end": "seconds since 1970", "points": "rows at most"},
    ),
    Asked("GET", "/api/recent", "recent", "The last outputs of some series", {"key": "of a series; may come often"}),
    Asked(
        "GET",
        "/api/events",
        "events",
        "Events, oldest first",
        {"since": "number of the last one known", "key": "of a series", "limit": "how many at most"},
        schema={"type": "array", "items": EVENT},
    ),
    Asked("POST", "/api/events/{number}/acknowledge", "acknowledge", "Note that somebody saw an event", schema=EVENT),
    Asked(
        "POST",
        "/samples",
        "samples",
        "Hand over samples; answered when they are on disk",
        body={
            NDJSON: 'a line each: {"key": "pump 1", "time": 1767225600.0, "value": 3.2}',
            TEXT: "InfluxDB line protocol: pump,site=a flow=3.2 1767225600000000000",
        },
    ),
    Asked(
        "GET",
        "/stream",
        "stream",
        "Server-sent events: all, then those that changed",
        {"key": "of a series to be told everything of"},
        media="text/event-stream",
    ),
    Asked("GET", "/api/service", "service", "How the service is, and its totals"),
    Asked("GET", "/health", "health", "200 while the service works; needs no token"),
    Asked("GET", "/ready", "ready", "200 once it takes samples; needs no token"),
    Asked("GET", "/metrics", "metrics", "For Prometheus", media=TEXT),
    Asked("POST", "/sign-in", "sign_in", "Exchange the token for a cookie", body={TEXT: "the token"}),
]


def routes(api: Api) -> list[Route]:
    """Return the table as Starlette takes it."""
    found = {}
    for asked in TABLE:
        path = asked.path.replace("{number}", "{number:int}")
        if asked.path.startswith("/api/series/"):
            path = "/api/series/{rest:path}"  # both of them: a key may hold anything, %2F too
        found[path] = Route(path, getattr(api, asked.handler), methods=[asked.method])
    return list(found.values())


def openapi() -> dict[str, Any]:
    """Return the table as an OpenAPI 3.1 document."""
    paths: dict[str, Any] = {}
    for asked in TABLE:
        given = [part[1:-1] for part in asked.path.split("/") if part.startswith("{")]
        parameters = [_parameter(name, "path", "a / in it is written %2F" if name == "key" else "") for name in given]
        parameters += [_parameter(name, "query", about) for name, about in asked.query.items()]
        done = {"description": "done", "content": {asked.media: {"schema": asked.schema}}}
        described: dict[str, Any] = {"summary": asked.about, "operationId": f"{asked.method.lower()} {asked.path}"}
        described |= {"parameters": parameters, "responses": {"200": done}}
        if asked.path in ("/health", "/ready", "/sign-in"):
            described["security"] = []
        if asked.body:
            described["requestBody"] = {"content": {media: {"example": text} for media, text in asked.body.items()}}
        paths.setdefault(asked.path, {})[asked.method.lower()] = described
    return {
        "openapi": "3.1.0",
        "info": {"title": "driftwise live", "version": __version__},
        "paths": paths,
        "components": {"securitySchemes": {"token": {"type": "http", "scheme": "bearer"}}},
        "security": [{"token": []}],
    }


def _parameter(name: str, place: str, about: str) -> dict[str, Any]:
    kind = "string" if name == "key" else "number"
    return {"name": name, "in": place, "required": place == "path", "description": about, "schema": {"type": kind}}
