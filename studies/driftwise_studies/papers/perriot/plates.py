"""Section 5: the three plates, and everything else that can be done with the same records."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..verdict import Estimate, Picture, Scaled, Section, Table, Verdict, numbers
from . import claims, engine, figures, hampton
from .detectors import Hinkley, printed_signal
from .hampton import LEVELS, SEGMENT, Averaging, Fortescue, Walk, follow, plant, records
from .score import delays, score

PLATES = "Perriot-Mathonna 1981, section 5"
OURS = "this package's study, docs/adaptive-gain.md"
PAPER = dict(up=(0.15, 15.0), down=(0.07, 20.0))
DESIGNED = dict(up=(0.3119 / 2, 11.2), down=(0.1369 / 2, 9.0), N0=(46.0, 95.0))
MATCHED = 0.2**2 / SEGMENT  # jump squared times jump rate


class AtTheJumps:
    """Knows when the jumps are: what detection could give at best."""

    N0 = (26.5, 26.5)

    def start(self, count):
        """Nothing to forget."""

    def look(self, s):
        """Return an alarm at the last sample before each jump, so that the jump meets the new gain."""
        return np.full(len(s.y), int(s.n % SEGMENT == SEGMENT - 1))


class FromOneSample(Walk):
    """Negative control: the noise variance is the square of sample ``first`` at once, and then has memory 100."""

    def __init__(self, q, first):
        super().__init__(q)
        self.first = first

    def seen(self, nu):
        """Take nu into the noise variance."""
        if self.c.n == self.first:
            self.c.n, self.c.value = 10**9, nu * nu
        else:
            super().seen(nu)


class Row(NamedTuple):
    """One method: how to make it, and what is expected: K-MSE with Q and R jumps, state with Q jumps."""

    name: str
    way: Any
    detector: Any
    Q: float
    R: float | None
    state: float
    wide: float = 0.08


def on_paper(N0=(6.0, 15.0)):
    """Return Hinkley's test on Z with the paper's Δμ and thresholds."""
    return Hinkley(printed_signal, **PAPER, N0=N0)


def forgetting(p):
    """Return the gains (8)."""
    return lambda t: engine.weighted(t, p)


def limit(N):
    """Return the gains (6)."""
    return lambda t: engine.limited(t, N)


def none():
    """Return no detector."""
    return None


PLATE_1 = Row("Plate 1: 1/n", Averaging, none, 13.35, 17.9, 1.193)
PLATE_2 = Row("Plate 2: forgetting .996", lambda: Averaging(forgetting(0.996)), none, 11.98, 15.4, 1.163)
PLATE_3 = Row("Plate 3: Hinkley, the paper's values", Averaging, on_paper, 16.03, 18.8, 1.200)
LARGER = Row("Hinkley, the paper's values but N0 = 26.5", Averaging, lambda: on_paper((26.5, 26.5)), 14.30, 18.3, 1.185)
BEST = Row("random walk, gradient, matched q", lambda: Walk(MATCHED), none, 6.26, 6.9, 1.098, 0.12)
LISTED_RECORDS = 500  # that what is expected comes from, and other code
SEEN, FEW, TUNED = [0.84, 0.72, 0.77], [0.01, 0.73, 0.01], [0.94, 0.99, 0.91]
ROWS = [
    PLATE_1,
    Row("Hampton's variance as printed", lambda: Averaging(printed=True), none, 39.7, 42.4, 1.440, 0.25),
    PLATE_2,
    Row("limited gain, N = 250", lambda: Averaging(limit(250)), none, 12.25, 15.6, 1.165),
    Row("limited gain, N = 50", lambda: Averaging(limit(50)), none, 14.71, 14.7, 1.188),
    PLATE_3,
    LARGER,
    Row("Hinkley, minimum of J*", Averaging, lambda: Hinkley(printed_signal, **DESIGNED), 12.64, 16.9, 1.164),
    Row("re-initialised at the true jumps, N0 = 26.5", Averaging, AtTheJumps, 10.41, 11.5, 1.130),
    Row("Fortescue's variable forgetting", Fortescue, none, 11.93, 14.4, 1.157),
    Row("random walk, pseudo-linear, matched q", lambda: Walk(MATCHED, score=False), none, 8.76, 9.7, 1.134, 0.12),
    Row("bank of 25 filters", None, none, 8.80, 7.9, 1.108),
    Row("gradient, forgetting .98", lambda: Averaging(forgetting(0.98), score=True), none, 8.45, 9.3, 1.121),
    BEST,
]


def run(row: Row, y):
    """Return the path of one method."""
    return hampton.bank(y) if row.way is None else follow(y, row.way(), row.detector())


def section(seeds: int) -> Section:
    """Run every method on the same ``seeds`` records with Q jumps, and on as many with R jumps."""
    shown, scores = {}, {}
    for jumps in "QR":
        levels = plant(LEVELS, jumps)
        x, y = records(levels, seeds, 1981)
        best = hampton.kalman(levels, y)
        for row in ROWS:
            path = run(row, y)
            scores[row.name, jumps] = score(path, levels, x, best)
            if jumps == "Q" and row in (PLATE_1, PLATE_2, PLATE_3, BEST):
                shown[row.name] = path
    scaled, truth = Scaled(seeds, 500), plant(LEVELS).K
    return Section(
        "The three plates",
        [
            "Hampton's filter learns a Kalman gain without knowing Q and R: Φ = .99, H = 1, K_0 = 0, 2000 samples, the "
            "optimal gain jumps by .2 every 500. The paper shows one record and no levels; .1 and .3 are inferred "
            "from its Δμ, which are half the mean of Z after such jumps.",
            "K-MSE is the mean square of K − K_opt times 1000. R = 1 and Q jumps, or Q stays and R jumps. A restart is "
            "not free: on jumps this small the paper's detector loses to no detector at all, and a random walk "
            "with the right gradient beats every restart.",
        ],
        [_table(scores, seeds), _jumps(scores)],
        [
            Picture(
                "plates",
                "The estimated gain on the paper's three plates and with the best method found: median and the middle "
                "80 % of all records, one record, the optimal gain. Below plate 3: when it raises alarms.",
                lambda: figures.plates(shown, truth, {name: scores[name, "Q"].error for name in shown}),
            ),
            Picture(
                "methods",
                "Error of the gain, all methods on the same records; a line is two standard errors. Orange: the "
                "paper's own.",
                lambda: figures.methods(scores, [row.name for row in ROWS]),
            ),
        ],
        [*_rows(scores, scaled), *_claims(scores, scaled, seeds), *_starts(seeds)],
        [
            "The levels of K_opt are not legible in the paper, and its figures are lost: the single record with a "
            "false alarm at n = 920 cannot be compared."
        ],
    )


def _table(scores, seeds):
    rows = []
    for row in ROWS:
        q, r = scores[row.name, "Q"], scores[row.name, "R"]
        rows.append(
            [
                row.name,
                f"{q.error:.2f} ± {q.deviation:.2f}",
                f"{row.Q}",
                numbers(q.segments, 1),
                f"{q.state:.3f}",
                f"{row.state:.3f}",
                f"{r.error:.1f}",
                f"{row.R}",
            ]
        )
    head = [
        "method",
        "K-MSE, Q jumps",
        "expected",
        "segments 1 to 4",
        "state / optimal",
        "expected",
        "R jumps",
        "expected",
    ]
    return Table(f"All methods, {seeds} records", head, rows)


def _jumps(scores):
    rows = []
    for row in ROWS:
        if row.detector in (none, AtTheJumps):
            continue
        for jumps in "QR":
            found = scores[row.name, jumps]
            rows.append(
                [
                    f"{row.name}, {jumps} jumps",
                    numbers(found.seen, 2),
                    delays(found.delay),
                    f"{found.false:.1f}",
                ]
            )
    return Table("Jumps seen (up, down, up)", ["", "share seen", "mean delay", "false alarms per record"], rows)


def _rows(scores, scaled):
    found = []
    for row in ROWS:
        q, r, wide = scores[row.name, "Q"], scores[row.name, "R"], float(scaled.wide(row.wide))
        off = max(abs(q.error / row.Q - 1), abs(r.error / row.R - 1))
        state, slack = abs(q.state - row.state), float(scaled.wide(0.02 if row.wide < 0.2 else 0.15))
        found.append(
            Verdict(
                f"K-MSE of {row.name}",
                f"{q.error:.2f} (Q jumps), {r.error:.2f} (R jumps), state {q.state:.3f}",
                f"{row.Q} and {row.R} within {100 * wide:.0f} %, state {row.state:.3f} ± {slack:.3f}",
                bool(off <= wide and state <= slack),
                PLATES if row.name.startswith(("Plate", "Hampton")) else OURS,
            )
        )
    return found


def _claims(scores, scaled, seeds):
    q = {row.name: scores[row.name, "Q"] for row in ROWS}
    plain, paper, printed = q[PLATE_1.name], q[PLATE_3.name], q[ROWS[1].name]
    seen, few = paper.seen, scores[PLATE_3.name, "R"].seen
    tuned = q["Hinkley, minimum of J*"]

    def room(found, listed):
        """Return the widest of what chance allows the shares of two studies."""
        return Estimate.share(found, seeds).room(Estimate.share(listed, LISTED_RECORDS)).max()

    def agree(found, listed):
        return Estimate.share(found, seeds).agrees(Estimate.share(listed, LISTED_RECORDS))

    return [
        Verdict(
            "re-initialisation does not pay on these plates: plate 3 is worse than plates 1 and 2",
            f"1000 × mean square error of K: {paper.error:.2f} with re-initialisation, {plain.error:.2f} "
            f"without, {q[PLATE_2.name].error:.2f} with forgetting; {q[LARGER.name].error:.2f} with N0 = 26.5",
            "in this order: 16.0, 13.4, 12.0; less than the first with N0 = 26.5 (14.3)",
            bool(paper.error > plain.error > q[PLATE_2.name].error and paper.error > q[LARGER.name].error),
            PLATES,
            claims.WORTH,
        ),
        Verdict(
            "Hampton's variance as printed, without its term − ω⁻¹(n), at least doubles the error",
            f"1000 × mean square error of K: {printed.error:.1f} as printed, {plain.error:.2f} with the term",
            "at least twice (39.7 against 13.35)",
            bool(printed.error > 2 * plain.error),
            PLATES,
            claims.VARIANCE,
        ),
        Verdict(
            "plate 3: jumps seen (up, down, up), Q jumps",
            f"{numbers(seen, 2)}, delays {delays(paper.delay)}, {paper.false:.1f} false alarms a record",
            f".84, .72, .77 ± {room(seen, SEEN):.2f}; delays 98, 212, 124 ± {scaled.wide(15):.0f}; "
            f"1.4 ± {scaled.wide(0.3):.1f}",
            bool(
                agree(seen, SEEN)
                and np.all(np.abs(paper.delay - [98, 212, 124]) <= scaled.wide(15))
                and abs(paper.false - 1.4) <= scaled.wide(0.3)
            ),
            PLATES,
        ),
        Verdict(
            "plate 3 with R jumps: the increases are not seen",
            numbers(few, 2),
            f".01, .73, .01 ± {room(few, FEW):.2f}",
            agree(few, FEW),
            PLATES,
        ),
        Verdict(
            "the minimum of J* is no event reporter",
            f"sees {numbers(tuned.seen, 2)} and raises {tuned.false:.1f} false alarms a record",
            f".94, .99, .91 ± {room(tuned.seen, TUNED):.2f}; 11 ± {scaled.wide(2):.0f}",
            bool(agree(tuned.seen, TUNED) and abs(tuned.false - 11) <= scaled.wide(2)),
            OURS,
        ),
    ]


def _starts(seeds):
    """How the random walk's noise variance starts: the first segment of four times as many records (a heavy tail)."""
    first = plant(LEVELS[:1])
    _, y = records(first, max(4 * seeds, 400), 1982)
    ways = (Walk(MATCHED), Walk(MATCHED, prior=(5.0, 1.0)), FromOneSample(MATCHED, 0), FromOneSample(MATCHED, 1))
    mean, prior, first_only, second_only = (1e3 * float(np.mean((follow(y, way).K - LEVELS[0]) ** 2)) for way in ways)
    return [
        Verdict(
            "random walk, gradient, matched q: K-MSE of the first segment",
            f"{mean:.2f}; with a prior scale of 5 samples {prior:.2f}",
            "< 7 (5.4), and less than 5 with a prior scale (3.7)",
            mean < 7 and prior < 5,
            OURS,
        ),
        Verdict(
            "a noise variance that starts from one sample spoils the first segment",
            f"K-MSE of the first segment {second_only:.2f} from the second sample, {first_only:.2f} from the first, "
            f"{mean:.2f} from all",
            "worse, from the second sample by a third or more (9.7 against 5.4)",
            second_only > 4 / 3 * mean and first_only > mean,
            OURS,
        ),
    ]
