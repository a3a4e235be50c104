"""The claim of sections 4.1 and 6 that convergence with probability 1 is kept: a million samples without a jump."""

from __future__ import annotations

import numpy as np

from driftwise.detect.average_run_length import growth

from ..verdict import Scaled, Section, Table, Verdict
from . import claims, walks
from .walks import compiled

PAPER = "Perriot-Mathonna 1981, sections 4.1 and 6"
OURS = "this package's derivation, docs/detectors.md"
LOOKS = np.array([10**3, 10**4, 10**5, 10**6])
DMU, H, N0 = 0.25, 6.0, 5.0


def section(seeds: int) -> Section:
    """Count alarms and the error that stays, with a fixed and with a growing threshold."""
    scaled = Scaled(seeds, 500)
    runs = min(40, scaled.records(40))
    found = {
        name: compiled(walks.loop)(np.random.default_rng(6), H, slope, DMU, N0, LOOKS, runs)
        for name, slope in (("h = 6", 0.0), ("h = 6 + 1.1 G²/(2 Δμ) ln n", growth(DMU)))
    }
    fixed, growing = found.values()
    counts, still, wide = fixed[0].mean(axis=1), fixed[1].mean(), scaled.wide(0.05)
    rare, end = growing[0][-1].mean(), growing[2].mean()
    rows = [
        [name, *(f"{count:.4g}" for count in alarms.mean(axis=1)), f"{half.mean():.2g}", f"{last.mean():.2g}"]
        for name, (alarms, half, last) in found.items()
    ]
    head = ["threshold", *(f"alarms until {n:,}" for n in LOOKS), "mean x² of the second half", "x² at the end"]
    return Section(
        "Convergence with probability 1",
        [
            "The linear case without any jump, Δμ = .25, N0 = 5. With a fixed threshold false alarms never stop and "
            "each one lifts the gain again, so that the estimate does not converge. A threshold that grows like ln n "
            "gives convergence back; the delay then grows like ln n too.",
        ],
        [Table(f"{runs} runs of a million samples", head, rows)],
        [],
        [
            Verdict(
                "a fixed threshold: false alarms never stop, the estimate does not converge",
                f"{counts[-1]:.0f} alarms in a million samples without a jump, mean square error stuck at {still:.4f}; "
                f"with a growing threshold {rare:.2f} alarms, error {end:.1e}",
                f"7664 within {100 * wide:.0f} %, x² = .019 ± {scaled.wide(0.002):.3f}",
                bool(abs(counts[-1] / 7664 - 1) <= wide and abs(still - 0.019) <= scaled.wide(0.002)),
                PAPER,
                claims.CONVERGENCE,
            ),
            Verdict(
                "a growing threshold: alarms in a million samples",
                f"{rare:.2f}; the error falls to {end:.1e}",
                "less than 1, and below 5e-6 (.08 and 1.3e-6)",
                bool(rare < 1 and end < 5e-6),
                OURS,
            ),
        ],
    )
