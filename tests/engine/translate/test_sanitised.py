"""No loop reads or writes out of bounds, or does what C leaves open: run once with every check that a compiler has."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from in_c import alike, translated
from recorded import MAIN, packed

from driftwise.engine import dispatch

COMPILER = shutil.which("gcc") or shutil.which("clang")
CHECKS = "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"
FLAGS = "-std=c99", "-O1", "-ffp-contract=off", "-fno-math-errno", "-Wno-unused-function", *CHECKS


def run(source: Path) -> str:
    """Compile a recorded loop with all checks and run it; return what went wrong, or nothing."""
    program, ours = source.with_suffix(".x"), source.with_suffix(".ours")
    subprocess.run([COMPILER, *FLAGS, str(source), "-o", str(program), "-lm"], check=True)
    done = subprocess.run([program, source.with_suffix(".given"), ours], capture_output=True, text=True)
    program.unlink()
    if done.returncode:
        return f"{source.stem}: {(done.stderr or str(done.returncode))[:1000]}"
    a, b = (np.frombuffer(one.read_bytes()) for one in (ours, source.with_suffix(".made")))
    return "" if alike(a, b) else f"{source.stem}: other numbers than plain Python's"


@pytest.mark.slow
@pytest.mark.skipif(COMPILER is None, reason="no gcc or clang: NO LOOP RAN WITH CHECKS")
def test_every_loop_runs_with_all_checks(tmp_path):
    recorder = Path(__file__).with_name("recorded.py")
    subprocess.run([sys.executable, str(recorder), str(tmp_path)], check=True, env={**os.environ})
    sources = sorted(tmp_path.glob("*.c"))
    assert len(sources) > 100
    wrong = [found for source in sources if (found := run(source))]
    assert not wrong, "\n".join(wrong)


BODIES = {
    "an element": "v[i] = 1.0",
    "an entry of a table": "v[0] = T[i]",
    "a row": "v[0] = v.reshape(2, 2)[i, 0]",
    "what a slice left": "part = v[i:]\n    v[0] = part[0]",
}


@pytest.mark.skipif(COMPILER is None, reason="no gcc or clang: CHECKS WERE NOT TESTED")
@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_checks_see_an_index_out_of_bounds(body, tmp_path):
    loop = dispatch.written(f"def f(v, i):\n    {body}\n", "f", {"T": (1.0, 2.0, 3.0, 4.0)})
    source, program, given = tmp_path / "loop.c", tmp_path / "loop.x", tmp_path / "given"
    source.write_text(translated(loop, (1, int), checked=True).replace(" go(", " driftwise_run(") + MAIN)
    subprocess.run([COMPILER, "-std=c99", str(source), "-o", str(program), "-lm"], check=True)
    for i, is_fine in ((1, True), (5, False), (-1, False)):
        given.write_bytes(np.int64(1).tobytes() + packed((np.ones(4), i), (1, int)))
        done = subprocess.run([program, given, tmp_path / "made"], capture_output=True, text=True)
        assert (done.returncode == 0) == is_fine and ("index" in done.stderr) != is_fine, (i, done.stderr)
