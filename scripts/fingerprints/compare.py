"""The fingerprint of a configuration, and what moved between two."""

from __future__ import annotations

import contextlib
import difflib
import hashlib
import tempfile
import warnings

import numpy as np

from .numbers import NUMBERS
from .words import WORDS, read_alike


def feed(digest, thing) -> None:
    """Take the numbers of anything into a hash: arrays, states, steps, lists and dictionaries of them."""
    if isinstance(thing, dict | list | tuple) or (isinstance(thing, np.ndarray) and thing.dtype == object):
        for part in thing.values() if isinstance(thing, dict) else thing:
            feed(digest, part)
        return
    if isinstance(thing, str):
        digest.update(thing.encode())
        return
    array = np.ascontiguousarray(np.nan if thing is None else thing)
    array = array.view(np.float64) if array.dtype.names or array.dtype.kind == "c" else array.astype(np.float64)
    digest.update(np.where(np.isnan(array), np.nan, array).tobytes())


def hashed(found) -> str:
    """Return a hash for each part of what a configuration gave."""
    parts = found if isinstance(found, dict) else {"all": found}
    digests = {name: hashlib.sha256() for name in parts}
    for name, digest in digests.items():
        feed(digest, parts[name])
    return " ".join(f"{name}:{digest.hexdigest()[:12]}" for name, digest in digests.items())


def take(name: str) -> str:
    """Return the fingerprint of one configuration, in an empty folder; of one that fails, how."""
    is_words = name.startswith("words/")
    case = WORDS[name.removeprefix("words/")] if is_words else NUMBERS[name]
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return read_alike(case()) if is_words else hashed(case())
        except Exception as error:
            return f"failed: {type(error).__name__}: {error}"


def difference(name: str, before: str, after: str, most: int = 40) -> list[str]:
    """Return the lines that say what moved; of words, at most so many."""
    if before == after:
        return []
    if "failed: " in (before[:8], after[:8]):
        return [f"{name} {after[:300]}" if after.startswith("failed: ") else f"{name}: worked"]
    if not name.startswith("words/"):
        return [f"{name}: {', '.join(sorted(part.split(':')[0] for part in {*after.split()} - {*before.split()}))}"]
    pair = read_alike(before).split("\n"), read_alike(after).split("\n")
    lines = [f"    {line}" for line in difflib.unified_diff(*pair, lineterm="", n=0) if line[:3] not in ("---", "+++")]
    lines = [line for line in lines if not line.startswith("    @@")]
    return [f"{name}:", *lines[:most], *(["    .."] if len(lines) > most else [])] if lines else []
