"""Bytes altered at random through every decoder: `python -m tests.hostile.fuzz table --inputs 100000 --seed 1`.

With Atheris installed (`--atheris`), inputs are chosen by what code they reach. What breaks a promise is written into
the corpus, by its digest, and tried again by the tests for ever.
"""

from __future__ import annotations

import argparse
import hashlib
import resource
import signal
import sys
import time
import traceback
from collections import Counter
from pathlib import Path

import numpy as np

from driftwise.engine.errors import InputError

from .decoders import DECODERS, LONGEST
from .plots import mutated

CORPUS = Path(__file__).with_name("corpus")
SECONDS = 5.0  # of CPU for an input
WORDS = 4000  # characters of a refusal


class Slow(BaseException):
    """An input took too long."""


def broken(name: str, data: bytes) -> str:
    """Return what is wrong with how a decoder takes an input: nothing, or the last lines of a traceback."""
    begun = time.process_time()
    try:
        DECODERS[name].take(data)
    except InputError as error:
        if len(str(error)) > WORDS + len(data):  # it may repeat what it refuses
            return f"a refusal of more than {WORDS} characters"
    except (Exception, Slow):
        lines = traceback.format_exc().strip().splitlines()
        return " / ".join([next(line.strip() for line in reversed(lines) if "/driftwise/" in line), lines[-1][:300]])
    taken = time.process_time() - begun
    return f"took {taken:.1f} s" if taken > SECONDS else ""


def fuzz(name: str, inputs: int, seed: int, is_kept: bool = True) -> Counter[str]:
    """Try so many altered inputs; return what broke, and keep the first input that broke it so."""
    rng, found = np.random.default_rng([seed, len(name)]), Counter()
    pool = DECODERS[name].seeds() + [path.read_bytes() for path in sorted((CORPUS / name).glob("*"))]
    signal.signal(signal.SIGPROF, _stop)
    for _ in range(inputs):
        data = pool[int(rng.integers(len(pool)))]
        if rng.random() < 0.1:
            other = pool[int(rng.integers(len(pool)))]
            data = data[: int(rng.integers(len(data) + 1))] + other[int(rng.integers(len(other) + 1)) :]
        data = mutated(data, rng, 1 + int(rng.geometric(0.4)))[:LONGEST]
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        wrong = broken(name, data)
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        if wrong and not found[wrong] and is_kept:
            keep(name, data)
        found[wrong] += bool(wrong)
    return found


def keep(name: str, data: bytes) -> None:
    """Put an input into the corpus."""
    (CORPUS / name).mkdir(parents=True, exist_ok=True)
    (CORPUS / name / hashlib.sha256(data).hexdigest()[:12]).write_bytes(data)


def _stop(number, frame):
    raise Slow


def by_coverage(name: str, inputs: int, seed: int) -> None:
    """Let Atheris choose the inputs; it ends the process."""
    import atheris  # type: ignore[import-not-found]  # where it is installed

    reached = Path("out", "fuzz", name)  # which git ignores
    reached.mkdir(parents=True, exist_ok=True)
    for data in DECODERS[name].seeds():
        (reached / hashlib.sha256(data).hexdigest()[:12]).write_bytes(data)
    told: Counter[str] = Counter()

    def take(data: bytes) -> None:
        wrong = broken(name, data)
        if wrong and not told[wrong]:
            keep(name, data)
            print(f"\n! {name}: {wrong}", flush=True)
        told[wrong] += 1

    limits = [f"-runs={inputs}", f"-seed={seed or 1}", f"-max_len={LONGEST}", "-timeout=20", "-rss_limit_mb=2048"]
    atheris.Setup([sys.argv[0], *limits, "-verbosity=0", "-print_final_stats=1", str(reached)], take)
    atheris.Fuzz()


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.hostile.fuzz", description=__doc__)
    parser.add_argument("decoder", nargs="*", help=f"of {', '.join(DECODERS)}; all if omitted")
    parser.add_argument("--inputs", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--atheris", action="store_true", help="by coverage; one decoder")
    asked = parser.parse_args()
    if asked.atheris:
        by_coverage(asked.decoder[0], asked.inputs, asked.seed)
    total = 0
    for name in asked.decoder or DECODERS:
        begun = time.process_time()
        found = fuzz(name, asked.inputs, asked.seed)
        took, peak = time.process_time() - begun, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10
        print(
            f"{name}: {asked.inputs} inputs, {took:.0f} s of CPU, {peak} MB, {len(found) - ('' in found)} broke",
            flush=True,
        )
        for wrong, count in found.items():
            if wrong:
                print(f"  {count} x {wrong}", flush=True)
                total += 1
    return int(total > 0)


if __name__ == "__main__":
    np.seterr(all="ignore")
    if "--atheris" in sys.argv:
        import atheris  # type: ignore[import-not-found]  # where it is installed

        with atheris.instrument_imports(
            include=["driftwise.tables", "driftwise.tracking", "driftwise.results", "driftwise.cli"]
        ):
            import driftwise.cli.specs
            import driftwise.tables.autoread
            import driftwise.tables.plantfile
            import driftwise.tracking.live_plots
            import driftwise.tracking.read  # noqa: F401
    sys.exit(main())
