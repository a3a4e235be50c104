"""Compile loops for a wheel: ``python -m driftwise.cli.stock FOLDER [all]``; the build calls it, and it never fails.

What is in the folder belongs to these very sources: a loop's key holds their fingerprint, which the installed package
finds again. Only optimising compilers are asked; where there is none, loops are compiled when they are first used.
"""

from __future__ import annotations

import os
import shlex
import sys
import tempfile
import time
import warnings
from pathlib import Path

from driftwise.engine.compilers import Compiler, compilers

HERE = "a C compiler (gcc or clang) here would have compiled loops ahead; now that happens at their first use"


def main(folder: str, extent: str = "front") -> int:
    """Compile into ``folder`` the loops that are needed first, or all; say what was done."""
    compiler = next((c for c in compilers() if not c.is_quick and _works(c)), None)
    if compiler is None:
        _told(HERE)
        return 0
    os.environ |= {"DRIFTWISE_CC": shlex.join(compiler.command), "DRIFTWISE_CACHE": folder, "DRIFTWISE_ENGINE": "c"}
    from driftwise.estimators.common.warm import front, warm
    from driftwise.fleet.warm import warm as fleets

    start = time.perf_counter(), _seconds()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # what does not compile here may do so where it is used
        for name in front() if extent == "front" else (*warm(), *fleets()):
            _told(f"compiled {name}")
    made = list(Path(folder).glob("*.so"))
    size = sum(path.stat().st_size for path in made) / 1e6
    _told(
        f"{len(made)} objects by {compiler.name}, {size:.1f} MB, in {time.perf_counter() - start[0]:.1f} s "
        f"({_seconds() - start[1]:.1f} s of CPU)"
    )
    return 0


def _told(text: str) -> None:
    """Tell the log of the build, whose environment has no library for terminals; no data come this way."""
    sys.stdout.write(f"driftwise: {text}\n")
    sys.stdout.flush()


def _works(compiler: Compiler) -> bool:
    """Say whether a compiler is there as a whole."""
    with tempfile.TemporaryDirectory() as place:
        source, made = Path(place) / "trial.c", Path(place) / "trial.so"
        source.write_text("double driftwise_run(double x) { return x * x; }\n")
        return not compiler.run(source, made)


def _seconds() -> float:
    """Return the CPU time of this process and of those it waited for."""
    return sum(os.times()[:4])


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
