"""`Config`: what a service runs, from a file, the environment and flags; checked before anything begins."""

from __future__ import annotations

import math
import os
import tomllib
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from ..engine.errors import InputError
from .join import Clock
from .outputs import OUTPUTS
from .reading import Section, lines_of, nearest, read
from .sources import SOURCES

PREFIX = "DRIFTWISE_LIVE_"  # DRIFTWISE_LIVE_WEB_PORT=8765 is port in [web]


@dataclass(frozen=True)
class ModelConfig:
    """What runs on a series.

    Attributes
    ----------
    model : as the command line has it, "arx:2,2"; "auto": the first ``identify`` samples choose it
    memory, jumps : as the command line has them
    output, inputs : fields of the messages
    dt : step of the clock: ticks without a sample become missing samples; 0: one sample after the other
    first : complete rows that tell level and units of a series
    identify : samples by which "auto" chooses
    tolerance, hold, lag : how messages that come apart are joined
    stuck : equal outputs in a row that are told, where a series has moved before; 0: never
    silence : s without a message after which a series is told lost; 0: never
    """

    model: str = "auto"
    memory: str = "auto"
    jumps: str | None = None
    output: str = "value"
    inputs: tuple[str, ...] = ()
    dt: float = 0.0
    first: int = 32
    identify: int = 500
    tolerance: float = 0.0
    hold: float = math.inf
    lag: float = 0.0
    stuck: int = 100
    silence: float = 0.0

    def __post_init__(self):
        for name in ("dt", "tolerance", "hold", "lag", "silence"):
            if getattr(self, name) < 0:
                raise InputError(f"{name} is at least 0, got {getattr(self, name):g}")
        for name, least in (("first", 0), ("identify", 100), ("stuck", 0)):
            if getattr(self, name) < least:
                raise InputError(f"{name} is at least {least}, got {getattr(self, name)}")
        if self.output in self.inputs or len(set(self.inputs)) < len(self.inputs):
            raise InputError(f"inputs names a field twice, or the output {self.output!r}: {self.inputs}")

    @property
    def clock(self) -> Clock:
        """How messages are joined."""
        return Clock(self.tolerance, self.hold, self.lag)


@dataclass(frozen=True)
class SeriesConfig(ModelConfig):
    """Series whose key fits ``keys`` ("pump/*"), with a model of their own, a name, a unit, a scale for the output."""

    keys: str = "*"
    name: str = ""
    unit: str = ""
    scale: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class WebConfig:
    """Where page and API are served; beyond this machine a token is needed, of which the file has the hash."""

    host: str = "127.0.0.1"
    port: int = 8765
    token_hash: str = ""
    tls_cert: str = ""
    tls_key: str = ""
    enabled: bool = True

    def __post_init__(self):
        if not 0 <= self.port < 1 << 16:
            raise InputError(f"port is between 0 and 65535, got {self.port}")
        if bool(self.tls_cert) != bool(self.tls_key):
            raise InputError("tls_cert and tls_key go together: a certificate and its key")


@dataclass(frozen=True)
class StoreConfig:
    """Where state is kept.

    Attributes
    ----------
    path : folder; made if need be
    url : "postgresql://user@host/database" keeps states and events there, and history in the folder; its password is
        in PGPASSWORD or ~/.pgpass
    fsync : s between two moments at which all is on the disk; 0: at every commit
    days : of history that are kept; 0: all
    most : series in memory; beyond, those that were silent longest are on the disk alone until they speak again
    """

    path: str = "driftwise-live"
    url: str = ""
    fsync: float = 1.0
    days: int = 0
    most: int = 100_000

    def __post_init__(self):
        if self.fsync < 0 or self.days < 0 or self.most < 1:
            raise InputError("fsync and days are at least 0, most at least 1")
        parts = urlsplit(self.url)
        if self.url and parts.scheme not in ("postgresql", "postgres"):
            raise InputError(f"url is postgresql://USER@HOST/DATABASE, got a {parts.scheme or 'text'}")
        if parts.password or "password=" in parts.query:
            raise InputError("url holds a password: put it into PGPASSWORD or ~/.pgpass")


@dataclass(frozen=True)
class Config:
    """All of it."""

    sources: tuple[Any, ...]
    model: ModelConfig = field(default_factory=ModelConfig)
    series: tuple[SeriesConfig, ...] = ()
    web: WebConfig = field(default_factory=WebConfig)
    store: StoreConfig = field(default_factory=StoreConfig)
    outputs: tuple[Any, ...] = ()

    def of(self, key: str) -> SeriesConfig:
        """Return what holds for a key: the first [[series]] that fits it, else [model]."""
        for one in self.series:
            if fnmatchcase(key, one.keys):
                return one
        return _plain(self.model)


@cache
def _plain(model: ModelConfig) -> SeriesConfig:
    """Return what [model] says of any series."""
    return SeriesConfig(**vars(model))


SINGLE: dict[str, type] = {"model": ModelConfig, "web": WebConfig, "store": StoreConfig}
SEVERAL = "source", "series", "out"


def load(path: str | Path) -> Config:
    """Return the configuration in a file, with what the environment says besides.

    Raises
    ------
    InputError
        Where something cannot be; with the line, what was expected, what came, and the nearest word.
    """
    try:
        text = Path(path).read_text("utf-8")
    except FileNotFoundError:
        raise InputError(f"there is no file {path}; `driftwise live init` writes one") from None
    except IsADirectoryError:
        words = f"{path} is a folder, not a configuration: `driftwise live status {path}` asks a store in it"
        raise InputError(words) from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read: {error}") from None
    return parse(text, str(path), os.environ)


def parse(text: str, file: str = "", environment=None) -> Config:
    """Return the configuration in a text (TOML)."""
    try:
        found = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{file}: {error}") from None
    lines = lines_of(text)
    known = (*SINGLE, *SEVERAL)
    for name in found:
        if name not in known:
            line = next((at[""] for (section, _), at in lines.items() if section == name), None) or lines["", 0].get(
                name
            )
            raise InputError(f"{file}:{line}: there is no section [{name}]; {nearest(name, known)}")
    single = {}
    for name, kind in SINGLE.items():
        options = found.get(name, {})
        if not isinstance(options, dict):
            raise InputError(f"{file}: [{name}] is one section, written [{name}]")
        section = Section(name, options | _environment(name, kind, environment or {}), lines.get((name, 0), {}), file)
        single[name] = read(section, kind)
    several: dict[str, list[Section]] = {}
    for name in SEVERAL:
        listed = found.get(name, [])
        if not isinstance(listed, list) or not all(isinstance(one, dict) for one in listed):
            raise InputError(f"{file}: there may be several {name}: write [[{name}]]")
        several[name] = [Section(name, one, lines.get((name, i), {}), file) for i, one in enumerate(listed)]
    series = []
    for section in several["series"]:  # what is not said is that of [model]
        said = {**vars(single["model"]), **section.options}
        plain = {name: list(value) if isinstance(value, tuple) else value for name, value in said.items()}
        options = {name: value for name, value in plain.items() if value is not None}
        series.append(read(section._replace(options=options), SeriesConfig))
    return Config(
        tuple(_kind(section, SOURCES) for section in several["source"]),
        single["model"],
        tuple(series),
        single["web"],
        single["store"],
        tuple(_kind(section, OUTPUTS) for section in several["out"]),
    )


def _kind(section: Section, kinds: dict[str, type]) -> Any:
    """Return a source or an output, whose ``kind`` says which."""
    options = dict(section.options)
    kind = options.pop("kind", None)
    if kind not in kinds:
        asked = f"kind = {kind!r}" if kind is not None else "no kind"
        raise InputError(f"{section.where('kind')}{asked} in [[{section.name}]]; {nearest(str(kind), kinds)}")
    return read(section._replace(options=options, name=f"{section.name}: {kind}"), kinds[kind])


def _environment(name: str, kind: type, environment) -> dict[str, Any]:
    """Return the options of a section that stand in the environment."""
    begin = f"{PREFIX}{name.upper()}_"
    found = {}
    for variable, text in environment.items():
        if variable.startswith(begin):
            value = text
            for plain in (int, float):
                try:
                    value = plain(text)
                    break
                except ValueError:
                    continue
            found[variable.removeprefix(begin).lower()] = {"true": True, "false": False}.get(text.lower(), value)
    return found
