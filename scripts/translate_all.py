"""Translate every loop that the library allows: a kernel that cannot become C is found before anybody meets it.

    python scripts/translate_all.py        # what `make check` runs: no compiler, exit code 1 with the refusals

The loops are those of the configurations of `fingerprint.py`, those of the tests of the laws, and of every form of
model with every memory, gate, scale and detector that it takes. Each kernel is translated and printed once for the
types it is called with.
"""

from __future__ import annotations

import contextlib
import sys
import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
sys.path[:0] = [str(ROOT / "scripts"), str(ROOT / "tests")]

import fingerprint  # noqa: E402
import numpy as np  # noqa: E402
import test_laws  # noqa: E402
from fingerprints.numbers import MEMORIES  # noqa: E402

import driftwise as dw  # noqa: E402
from driftwise.detect.registry import ENTRIES as DETECTORS  # noqa: E402
from driftwise.engine import compile  # noqa: E402
from driftwise.engine.translate.c99 import Printer  # noqa: E402
from driftwise.engine.translate.program import Program  # noqa: E402
from driftwise.engine.translate.refusal import Refusal  # noqa: E402
from driftwise.engine.translate.types import FLOAT, INT, View  # noqa: E402

KINDS: dict[Any, Any] = {int: INT, float: FLOAT, "index": View(1, INT)}
FORMS: dict[str, Any] = {
    "arx": lambda **o: dw.ARX(2, 2, **o),
    "arx, iv": lambda **o: dw.ARX(2, 2, method="iv", **o),
    "arx, delayed instruments": lambda **o: dw.ARX(1, 1, method="iv", instruments="delayed", **o),
    "arx, nlms": lambda **o: dw.ARX(2, 2, method="nlms", **o),
    "arx, lms": lambda **o: dw.ARX(2, 2, method="lms", step=0.01, **o),
    "arx, gaps": lambda **o: dw.ARX(2, 2, missing="skip", **o),
    "regression": lambda **o: dw.Regression(2, offset=True, **o),
    "regression, disturbance": lambda **o: dw.Regression(2, disturbance=dw.models.Disturbance(0.8), **o),
    "armax": lambda **o: dw.ARMAX(2, 2, 2, **o),
    "armax, plr": lambda **o: dw.ARMAX(1, 1, 1, method="plr", **o),
    "oe": lambda **o: dw.OE(2, 2, **o),
    "bj": lambda **o: dw.BJ(1, 1, 1, 1, **o),
    "arx mimo": lambda **o: dw.ARXMIMO(2, 1, **o),
    "joint": lambda **o: dw.Joint(2, 1, **o),
    "joint, output error": lambda **o: dw.Joint(2, 1, noise=dw.models.OutputError(), **o),
    "joint, polynomial": lambda **o: dw.Joint(2, 1, noise=dw.models.NoisePolynomial((0.1, -0.4), 0.01), **o),
    "joint, unknown polynomial": lambda **o: dw.Joint(2, 1, noise=dw.models.UnknownPolynomial(), **o),
    "joint, covariance": lambda **o: dw.Joint(2, 1, noise=dw.models.NoiseCovariance(np.eye(2)), **o),
    "joint mimo": lambda **o: dw.JointMIMO((2, 1), 1, **o),
    "continuous": lambda **o: dw.ContinuousJoint(1, **o),
    "gain": lambda **o: dw.AdaptiveGain(0.9, **o),
    "gain, plr": lambda **o: dw.AdaptiveGain(0.9, method="plr", **o),
    "observer": lambda **o: dw.estimators.AdaptiveObserver(1, 0.3, 1, **o),
    "manoeuvre": lambda **o: dw.tracking.Manoeuvre(**o),
}


def options() -> Iterator[dict[str, Any]]:
    """Yield what forms are tried with: each policy, alone and beside a gate and a scale that is known."""
    for memory in [None, *(make() for make in MEMORIES.values()), *map(restart, watchers())]:
        chosen = {} if memory is None else {"memory": memory}
        yield chosen
        yield {**chosen, "gate": dw.InnovationGate()}
    yield {"scale": dw.models.InverseGamma(2.0, 0.1)}
    yield {"missing": "hold"}
    yield from ({"detector": detector} for detector in watchers())


def watchers() -> Iterator[Any]:
    """Yield a detector of each kind that needs no settings."""
    for entry in DETECTORS.public().values():
        try:
            yield entry.kind()
        except (TypeError, dw.InputError):
            continue


def restart(detector) -> Any:
    """Return the memory that this detector ends, or none."""
    try:
        return dw.RestartOnChange(detector)
    except dw.InputError:
        return None


def ask(est) -> None:
    """Ask for the loops of an estimator and of a fleet of it."""
    for wanted in (lambda: est.drive, lambda: dw.Fleet(est, threads=1, lanes=False).crew.loop(4)):
        try:
            wanted()
        except (dw.InputError, AttributeError):
            continue  # it has none


def ask_all() -> None:
    """Ask for every loop."""
    for name in fingerprint.NUMBERS:
        fingerprint.take(name)  # what it makes of loops that do nothing is of no interest
    for est in (*test_laws.ESTIMATORS.values(), *test_laws.OBSERVERS.values()):
        ask(est)
        with contextlib.suppress(dw.InputError, AttributeError):
            est.predict(est.start(), np.zeros((2, est.model.inputs)) if est.model.inputs else None, horizon=2)
    for form in FORMS.values():
        for chosen in options():
            try:
                ask(form(**chosen))
            except (TypeError, dw.InputError):
                continue  # not allowed


def main() -> int:
    """Translate; say how much, and what is refused."""
    begun, found = time.process_time(), {}

    def note(make, sizes, kinds, dimensions, loop=None):
        found[make, sizes, dimensions, loop] = loop or make(*sizes, 0)
        return lambda *args: 0

    compile._load = note
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        ask_all()
    program, printer, refused = Program(), Printer(), {}
    for (_, sizes, dimensions, _), loop in found.items():
        try:
            program.function(loop, [KINDS.get(one) or View(one) for one in dimensions])
        except Refusal as refusal:
            refused.setdefault(str(refusal), sizes)
            program.open.clear()
    size = sum(len(printer.function(function)) for function in program.functions.values())
    for text, sizes in refused.items():
        print(f"{text} (for {sizes})")
    print(
        f"{len(found)} loops of {len(program.functions)} kernels translated, {size // 1000} kB of C, "
        f"{len(refused)} refused, {time.process_time() - begun:.0f} s"
    )
    return 1 if refused else 0


if __name__ == "__main__":
    sys.exit(main())
