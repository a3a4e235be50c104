"""A whole record: driftwise against C and against filterpy."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .clock import cpu, ratio
from .opponents import FilterPy, InC
from .plant import joint, record
from .verdicts import Verdict, at_least, at_most, for_information, not_measured

SOURCE = "bench/records.py"
WHY = "no status, nothing may be missing, no policies"
CASES = [
    ("EquationError", "innovations", 4),
    ("EquationError", "std", 24),
    ("OutputError", "innovations", 4),
    ("OutputError", "std", 24),
]


def verdicts(samples: int = 20_000) -> Iterator[Verdict]:
    """Yield the budgets of a record of Joint(3) with input and direct term (N = 10)."""
    try:
        in_c, native = InC(), InC("-march=native")
    except OSError as error:
        yield not_measured("record against C", "<= 2.5 x C", SOURCE, str(error))
    else:
        for case in CASES:
            yield _against_c(in_c, *case, samples)
        value, note = _measure(native, *CASES[0], samples)
        name = "record, EquationError, C with -march=native"
        yield for_information(name, value, "x C", SOURCE, note).beside("C -O3 -march=native", value, WHY)
    yield from _against_filterpy()


def _against_c(in_c: InC, noise: str, keep: str, columns: int, samples: int) -> Verdict:
    value, note = _measure(in_c, noise, keep, columns, samples)
    return at_most(f"record, {noise}, keep {keep}", value, 2.5, "x C", SOURCE, note).beside("C -O3", value, WHY)


def _measure(in_c: InC, noise: str, keep: str, columns: int, samples: int) -> tuple[float, str]:
    y, u = record(samples)
    est = joint(noise)
    mine, theirs = np.empty((1, samples, columns)), np.empty((samples, columns))
    ys, us, scratch = y.reshape(1, -1, 1), u.reshape(1, -1, 1), est.scratch()

    def ours():
        est.drive(est.start(1).view("f8").reshape(1, -1), ys, us, mine, est.spec, scratch)

    def opponent():
        in_c.run(noise, est, y, u, theirs)

    ours(), opponent()
    same = [i for i in range(columns) if i != 3]  # all but the status
    np.testing.assert_allclose(mine[0][:, same], theirs[:, same], rtol=1e-9, atol=1e-9)
    value, ours_s, theirs_s = ratio(ours, opponent)
    return value, f"{ours_s / samples * 1e9:.0f} ns a sample, C {theirs_s / samples * 1e9:.0f} ns"


def _against_filterpy(samples: int = 3_000) -> Iterator[Verdict]:
    name, expected = "record, filterpy's time over ours", ">= 100 x"
    try:
        import filterpy  # noqa: F401
    except ImportError:
        yield not_measured(name, expected, SOURCE, "filterpy is not installed: pip install .[bench]")
        return
    y, u = record(samples)
    est = joint("EquationError", P0=10.0)
    opponent, many = FilterPy(est, y, u), 20
    out, scratch = np.empty((1, samples, 4)), est.scratch()

    def ours():
        for _ in range(many):
            est.drive(
                est.start(1).view("f8").reshape(1, -1), y.reshape(1, -1, 1), u.reshape(1, -1, 1), out, est.spec, scratch
            )

    ours()
    np.testing.assert_allclose(out[0, :, 0], opponent.run(), atol=1e-6)
    theirs = np.array([[cpu(opponent.run), cpu(ours) / many] for _ in range(3)])
    per_sample = np.median(theirs, axis=0) / samples * 1e6
    note = f"filterpy {per_sample[0]:.0f} us a sample, ours {per_sample[1]:.2f} us; N = {est.model.N}"
    value = float(np.median(theirs[:, 0] / theirs[:, 1]))
    yield at_least(name, value, 100, "x", SOURCE, note).beside("filterpy", 1 / value)
