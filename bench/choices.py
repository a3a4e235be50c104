"""What a memory, or a noise that is estimated too, costs beside the default Joint(3)."""

from __future__ import annotations

from collections.abc import Iterator

import driftwise as dw

from .clock import ratio
from .plant import record
from .verdicts import Verdict, for_information

SOURCE = "bench/choices.py"


def verdicts(samples: int = 10_000) -> Iterator[Verdict]:
    """Yield the overhead of each choice: the same record, scan with std."""
    y, u = record(samples)
    plain = dw.Joint(3, 1, True)
    choices = {
        "memory Walk": dict(memory=dw.RandomWalk(1e-6)),
        "memory RestartOnChange": dict(memory=dw.RestartOnChange()),
        "noise UnknownPolynomial": dict(noise=dw.models.UnknownPolynomial()),
        "noise OutputError": dict(noise=dw.models.OutputError()),
    }
    for name, options in choices.items():
        est = dw.Joint(3, 1, True, **options)
        value, ours, theirs = ratio(lambda: est.scan(y, u), lambda: plain.scan(y, u), rounds=9)
        note = f"{ours / samples * 1e9:.0f} ns a sample, default {theirs / samples * 1e9:.0f} ns; N = {est.model.N}"
        yield for_information(f"{name}, record, keep std", value, "x Joint(3)", SOURCE, note)
