"""Messages become samples: JSON in its usual shapes, plain numbers, InfluxDB's line protocol."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import NamedTuple

from ..engine.errors import InputError

LARGEST = 1 << 20  # bytes of a message
PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
NAN = math.nan


class Chunk(NamedTuple):
    """Samples of one series, in the order they came; ``fields`` has as many values of each name as there are times.

    An instant is NaN where the message had none. A missing value is NaN.
    """

    key: str
    time: list[float]
    fields: dict[str, list[float]]


class Shape(NamedTuple):
    """Where key and time stand in a message: names of fields, and the unit of times that are numbers."""

    key: str = "key"
    time: str = "time"
    unit: str = "s"


def chunks(payload: bytes | str, key: str, shape: Shape = Shape()) -> list[Chunk]:
    """Return the samples of one message about a series, or of several series where the message names keys.

    A number; an object of fields, ``{"time": 1.5, "value": 20.1, "speed": 3}``; the same with lists of equal length;
    or a list of such objects. null and NaN are missing values; a text that is a number is that number, and other texts
    (a unit beside a value) are passed over.

    Raises
    ------
    InputError
        Where the message is none of these, or above a megabyte.
    """
    if len(payload) > LARGEST:
        raise InputError(f"a message of {len(payload)} bytes is above the largest, {LARGEST}")
    try:
        found = json.loads(payload)
    except (ValueError, RecursionError):
        raise InputError(f"neither JSON nor a number: {payload[:80]!r}") from None
    if isinstance(found, list):
        return _gathered([chunk for item in found for chunk in _of(item, key, shape)])
    return _of(found, key, shape)


def _of(found, key: str, shape: Shape) -> list[Chunk]:
    """Return the samples of one number or object."""
    if not isinstance(found, dict):
        return [Chunk(key, [NAN], {"value": [number(found, "value")]})]
    named, when = found.pop(shape.key, None), found.pop(shape.time, None)
    if named is not None and not isinstance(named, str | int):
        raise InputError(f"a key is text or a whole number, got {str(named)[:40]!r}")
    key = str(named) if named is not None else key
    if not key:
        raise InputError(f"a message without a key: no {shape.key!r} in it")
    if found and all(type(value) is float and not math.isinf(value) for value in found.values()):  # most of them
        return [Chunk(key, [instant(when, shape.unit)], {name: [value] for name, value in found.items()})]
    found = {name: value for name, value in found.items() if not (isinstance(value, str) and _is_text(value))}
    if not found:
        raise InputError(f"a message about {key} without a number")
    if not any(isinstance(value, list) for value in found.values()):
        fields = {name: [number(value, name)] for name, value in found.items()}
        return [Chunk(key, [instant(when, shape.unit)], fields)]
    sizes = {name: len(value) for name, value in found.items() if isinstance(value, list)}
    size = next(iter(sizes.values()))
    times = when if isinstance(when, list) else [when] * size
    if len(sizes) < len(found) or set(sizes.values()) != {len(times)}:
        raise InputError(f"lists in a message about {key} must be of one length, got {sizes} and {len(times)} times")
    return [
        Chunk(
            key,
            [instant(one, shape.unit) for one in times],
            {name: [number(one, name) for one in values] for name, values in found.items()},
        )
    ]


def _is_text(value: str) -> bool:
    """Say whether a text is no number, such as a unit beside a value."""
    try:
        float(value)
    except ValueError:
        return True
    return False


def _gathered(found: list[Chunk]) -> list[Chunk]:
    """Join samples of equal key and fields that follow each other."""
    parts: list[Chunk] = []
    for chunk in found:
        last = parts[-1] if parts else None
        if last is not None and last.key == chunk.key and last.fields.keys() == chunk.fields.keys():
            last.time.extend(chunk.time)
            for name, values in chunk.fields.items():
                last.fields[name].extend(values)
        else:
            parts.append(chunk)
    return parts


def number(value, name: str) -> float:
    """Return a value as a number; null is missing."""
    if type(value) is float or type(value) is int:
        try:
            value = float(value)
        except OverflowError:
            raise InputError(f"{name} is beyond all numbers") from None
        if math.isinf(value):
            raise InputError(f"{name} is infinite")
        return value
    if value is None:
        return NAN
    if isinstance(value, bool):
        return float(value)
    try:
        if isinstance(value, str):
            return number(float(value), name)
    except ValueError:
        pass
    raise InputError(f"{name} must be a number, got {str(value)[:40]!r}")


def instant(value, unit: str = "s") -> float:
    """Return an instant in seconds since 1970: a number in its unit, or a date; NaN for none."""
    if value is None:
        return NAN
    if isinstance(value, str):
        try:
            moment = datetime.fromisoformat(value)
        except ValueError:
            return number(value, "time") / PER_SECOND[unit]
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    found = number(value, "time")
    return found if unit == "s" else found / PER_SECOND[unit]


# --- many lines ------------------------------------------------------------------------------------------------


def json_lines(text: bytes, key: str = "", shape: Shape = Shape()) -> Iterator[Chunk | InputError]:
    """Yield what each line holds, in order; a line that cannot be used is the error that says why."""
    lines = [line for line in map(bytes.strip, text.splitlines()) if line]
    for line, found in zip(lines, _objects(lines) or lines):
        try:
            yield from chunks(line, key, shape) if found is line else _of(found, key, shape)
        except InputError as error:
            yield error


def _objects(lines: list[bytes]) -> list | None:
    """Return lines as JSON at one go, where each is an object; None where one of them is not, or is too long."""
    if not all(line[:1] == b"{" and line[-1:] == b"}" and len(line) <= LARGEST for line in lines):
        return None
    try:
        found = json.loads(b"[" + b",".join(lines) + b"]")
    except (ValueError, RecursionError):
        return None
    return found if len(found) == len(lines) else None


def influx_lines(text: bytes | str, unit: str = "ns", time: str = "time") -> Iterator[Chunk | InputError]:
    """Yield the samples of InfluxDB's line protocol: ``measurement,tag=x field=1.5,other=2i 1700000000000000000``.

    The key is the measurement with the values of its tags, as in ``pump/7``; texts among the fields are passed over.
    """
    lines = text.decode("utf-8", "replace") if isinstance(text, bytes) else text
    for line in lines.split("\n"):
        if not line.strip() or line.startswith("#"):
            continue
        try:
            yield _influx(line.strip(), unit)
        except InputError as error:
            yield error


SPACE, COMMA, EQUALS = (re.compile(rf'(?:\\.|"(?:\\.|[^"\\])*"|[^{sign}\\])+') for sign in (" ", ",", "="))


def _influx(line: str, unit: str) -> Chunk:
    parts = SPACE.findall(line) if "\\" in line or '"' in line else line.split()
    if not 2 <= len(parts) <= 3:
        raise InputError(f"a line is MEASUREMENT,TAGS FIELDS TIME, got {line[:80]!r}")
    name, *tags = COMMA.findall(parts[0]) if "\\" in parts[0] else parts[0].split(",")
    key = "/".join([name, *(tag.partition("=")[2] for tag in tags)]).replace("\\", "")
    fields = {}
    for pair in COMMA.findall(parts[1]) if '"' in parts[1] or "\\" in parts[1] else parts[1].split(","):
        field, equals, value = pair.partition("=")
        if not equals or not value:
            raise InputError(f"a field is NAME=VALUE, got {pair[:40]!r}")
        if value[0] != '"':
            fields[field.replace("\\", "")] = [_influx_value(value, field)]
    if not fields:
        raise InputError(f"no field of {key} is a number")
    when = instant(parts[2], unit) if len(parts) == 3 else NAN
    return Chunk(key, [when], fields)


TRUTHS = dict.fromkeys(("t", "T", "true", "True", "TRUE"), 1.0)
TRUTHS |= dict.fromkeys(("f", "F", "false", "False", "FALSE"), 0.0)


def _influx_value(value: str, field: str) -> float:
    if value in TRUTHS:
        return TRUTHS[value]
    return number(value[:-1] if value[-1] in "iu" else value, field)
