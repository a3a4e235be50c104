"""`est.export("folder")`: an estimator as C for a controller, with a test and what it takes."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from ..engine import validation
from ..engine.atomic import replaced
from ..engine.errors import InputError
from ..engine.translate.c99_values import KEYWORDS
from ..engine.translate.refusal import Refusal
from ..estimators.base import Estimator, is_estimator
from . import structured_check
from .check import test
from .host import Library, compiler
from .readme import readme
from .record import answers, record
from .source import Source

LANGUAGES, PRECISIONS = ("c", "st"), ("double", "single")


def export(est: Estimator, folder, state, *, language: str, name: str, precision: str, keep: str) -> list[Path]:
    """Write an estimator as `Estimator.export` promises; what is not said was filled in there."""
    is_structured = validation.one_of("language", language, LANGUAGES) == "st"
    is_single = validation.one_of("precision", precision, PRECISIONS) == "single"
    if is_structured:
        return written(structured_text(est, state, name, precision, keep), folder)
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name) or name in KEYWORDS:
        raise InputError(f"name must be a name in C of small letters, digits and _, such as pump; got {name!r}")
    source = source_of(est, est.start() if state is None else state, name, keep, is_single)
    samples = record(est, source.begun)
    texts = {f"{name}.c": source.source(), f"{name}.h": source.header()}
    with tempfile.TemporaryDirectory() as work:
        for file, text in texts.items():
            (Path(work) / file).write_text(text)
        if is_single:
            expected = Library(source, work).run(samples)
        else:
            expected = answers(est, source.begun, keep, samples)
        texts[f"test_{name}.c"] = test(source, samples, expected)
        texts["README.md"] = readme(source, work)
    return written(texts, folder)


def structured_text(est: Any, state, name: str, precision: str, keep: str) -> dict[str, str]:
    """Return the files of an estimator as Structured Text, which is written for double precision."""
    if precision != "double":
        raise InputError('Structured Text is written in double precision (LREAL): precision="double"')
    return structured_check.files(est, state, name, keep)


def written(texts: dict[str, str], folder) -> list[Path]:
    """Write files into a folder; return where they are."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    for file, text in texts.items():
        with replaced(target / file) as place:
            Path(place).write_text(text, encoding="utf-8")
    return [target / file for file in texts]


def source_of(est: Any, state, name: str, keep: str = "std", is_single: bool = False) -> Source:
    """Return the texts of an estimator, refused in a sentence where there are none."""
    kind = type(est)
    if not is_estimator(est):
        raise InputError(f"an estimator is exported, such as ARX(2, 2), got {est!r}")
    if not est.is_single_step:
        raise InputError(
            f"{kind.__name__} is not exported: it needs a host, as it is no single step from sample to sample; export "
            "one of the estimators it is made of, such as ARX or Joint"
        )
    if est.starting is not None:
        raise InputError(
            f"{kind.__name__}(.., start=..) is not exported: identifying the first samples needs a host; leave start "
            "out, or run it there and give its estimate to one without, by theta0 and P0 (Joint: s0 and P0)"
        )
    state = np.asarray(state)
    if state.shape != ():
        raise InputError(f"one state is exported, got {state.shape}: choose one of the fleet's, states[i]")
    est._rows(state)
    if is_single and compiler() is None:
        raise InputError(
            "single precision needs a C compiler here (gcc or clang): its errors are measured, not promised"
        )
    try:
        return Source(est, state, name, keep, is_single)
    except Refusal as refusal:
        raise InputError(f"{est!r} is not exported, as its step cannot be translated: {refusal}") from None
