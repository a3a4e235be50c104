"""Whole-record answers: the order by evidence against the scans it consists of, least squares against the scan."""

from __future__ import annotations

from collections.abc import Iterator

import driftwise as dw

from .clock import ratio
from .plant import record
from .verdicts import Verdict, for_information

SOURCE = "bench/evidence.py"


def verdicts(samples: int = 20_000) -> Iterator[Verdict]:
    """Yield the cost of `choose_order` and of `batch`."""
    y, u = record(samples)
    orders = range(1, 6)
    five = [dw.Joint(n, 1, True, noise=dw.models.EquationError()) for n in orders]

    def scans():
        for est in five:
            est.scan(y, u, keep="innovations")

    def chosen():
        return dw.analysis.choose_order(y, u, orders, direct=True).best

    assert chosen() == 3
    value, ours, theirs = ratio(chosen, scans, rounds=9)
    note = f"{ours:.3f} s, scans {theirs:.3f} s for {samples} samples"
    yield for_information("choose_order, orders 1 to 5", value, "x five scans", SOURCE, note)
    est = five[2]
    value, ours, theirs = ratio(lambda: est.batch(y, u), lambda: est.scan(y, u, keep="innovations"), rounds=9)
    note = f"{ours / samples * 1e6:.2f} us a sample, scan {theirs / samples * 1e6:.2f} us"
    yield for_information("batch, Joint(3)", value, "x scan", SOURCE, note)
