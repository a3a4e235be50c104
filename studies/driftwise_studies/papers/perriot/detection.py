"""Which test sees the jumps of section 5, at one false alarm per 2000 samples; and whether seeing them helps."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..verdict import Estimate, Picture, Scaled, Section, Table, Verdict, numbers
from . import figures, fresh
from .detectors import Hinkley, Studentised, Windows
from .fresh import SOURCE, data, hinkley_on_z, probes
from .hampton import Averaging, follow
from .score import delays, detection


class Test(NamedTuple):
    """One test in the loop: how to make it, and what is expected with Q and with R jumps (up, down, up)."""

    name: str
    make: Any
    Q: tuple
    R: tuple


def _same(signal, dmu, h):
    return Hinkley(signal, (dmu, h), (dmu, h))


LISTED_RECORDS = 1000  # that these shares come from, and other code
TESTS = [
    Test("Z, Hinkley", hinkley_on_z, (0.82, 0.61, 0.65), (0.00, 0.73, 0.00)),
    Test("studentised Z, Hinkley", lambda: _same(Studentised(), 0.10, 20.7), (0.81, 0.61, 0.66), (0.61, 0.87, 0.68)),
    Test("studentised Z, largest window", lambda: Windows(Studentised(), 23.1), (0.48, 0.19, 0.32), (0.15, 0.96, 0.17)),
    Test("gradient, Hinkley", lambda: _same(Studentised(True), 0.15, 20.2), (0.84, 0.68, 0.73), (0.67, 0.90, 0.67)),
    Test("gradient, largest window", lambda: Windows(Studentised(True), 25.4), (0.68, 0.13, 0.57), (0.31, 0.84, 0.32)),
    Test(
        "gradient, mixture of windows",
        lambda: Windows(Studentised(True), np.exp(9.43), mixture=True),
        (0.82, 0.33, 0.71),
        (0.60, 0.78, 0.64),
    ),
    Test("probe bank", probes, (0.77, 0.92, 0.71), (0.87, 0.83, 0.88)),
]


def section(seeds: int) -> Section:
    """Run every test on twice as many records as seeds."""
    scaled, count = Scaled(seeds, 500), 2 * seeds
    seen, late = {}, {}
    for jumps in "QR":
        levels, y = data((0.1, 0.3), jumps, count, 2)
        for test in TESTS:
            seen[test.name, jumps], late[test.name, jumps], _ = detection(
                follow(y, Averaging(), test.make()).alarms, levels
            )
    tables, verdicts = fresh.judge(seeds, scaled)
    return Section(
        "The missed decrease, and what sees it",
        [
            "The paper's plate 3 misses the decrease. The reasons: the mean of Z is only −.137 for an error of .2; "
            "the variance in Z is that of before the jump; and the product of two neighbours ignores what older "
            "residuals know. Studentising helps where R jumps, the largest window and the mixture do not help.",
            "What helps is a bank of filters with fixed gains beside the adaptive one and a likelihood ratio against "
            "each. It is not better everywhere: it sees fewer of the increases between high gains, and its run "
            "length depends on the optimal gain.",
        ],
        [_table(seen, late, count), *tables],
        [
            Picture(
                "detection",
                "Share of the jumps seen within 500 samples, every test at one false alarm per 2000 samples; open "
                "circles are what is expected.",
                lambda: figures.detection(TESTS, seen),
            )
        ],
        [*_seen(seen, count), _probe(seen, count), *verdicts],
    )


def _table(seen, late, count):
    rows = [
        [
            test.name,
            *(
                text
                for jumps, listed in (("Q", test.Q), ("R", test.R))
                for text in (
                    numbers(seen[test.name, jumps], 2),
                    numbers(listed, 2),
                    delays(late[test.name, jumps]),
                )
            ),
        ]
        for test in TESTS
    ]
    head = ["test signal, test", "Q jumps", "expected", "mean delay", "R jumps", "expected", "mean delay"]
    return Table(
        f"Share of jumps seen (up, down, up), {count} records; estimator (4)-(5) with 1/n, N0 = 26.5", head, rows
    )


def _seen(seen, count):
    found = []
    for test in TESTS[:-1]:
        pairs = [
            (Estimate.share(seen[test.name, jumps], count), Estimate.share(listed, LISTED_RECORDS))
            for jumps, listed in (("Q", test.Q), ("R", test.R))
        ]
        room = max(float(got.room(expected).max()) for got, expected in pairs)
        found.append(
            Verdict(
                f"jumps seen by {test.name}",
                f"Q {numbers(seen[test.name, 'Q'], 2)}; R {numbers(seen[test.name, 'R'], 2)}",
                f"Q {numbers(test.Q, 2)}; R {numbers(test.R, 2)}; three standard errors of the difference, at most "
                f"± {room:.2f}",
                all(got.agrees(expected) for got, expected in pairs),
                SOURCE,
            )
        )
    return found


def _probe(seen, count):
    listed = (0.92, 0.59)
    decrease, hinkley = seen["probe bank", "Q"][1], seen["Z, Hinkley", "Q"][1]
    got, expected = Estimate.share([decrease, hinkley], count), Estimate.share(listed, LISTED_RECORDS)
    return Verdict(
        "the decrease, Q jumps: probe bank with h = 6.17",
        f"{decrease:.3f}; Hinkley on Z at the same rate {hinkley:.2f}",
        "; ".join(f"{p:.2f} ± {room:.2f}" for p, room in zip(listed, got.room(expected))),
        got.agrees(expected),
        SOURCE,
    )
