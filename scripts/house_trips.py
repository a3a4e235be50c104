"""What has to run to be measured: the memories that families take, and trips.

How the moves of a trip are counted: every call of a named function of the package is written down with its file, in
order; a move is a call into another file than the call before it (returns, lambdas, comprehensions and bodies of
modules do not count). The trip is taken warm. One sample is followed into its kernels, uncompiled; in `driftwise run`
and in a fleet the loop over samples counts as one step, as it is there, compiled.
"""

from __future__ import annotations

import ast
import contextlib
import importlib
import io
import itertools
import os
import sys
import tempfile
import tomllib
from typing import Any

from house_tree import ANSWERS, MEMORIES, PACKAGE, ROOT, TAKERS, Fact, dotted, each, is_dispatcher, load


@contextlib.contextmanager
def uncompiled():
    """Let every loop that is asked for meanwhile be the plain function that would have been compiled."""
    loops: Any = sys.modules[load("plain_driver").__module__]
    held, before = [loops.driver, loops.passage, loops.function], os.environ.get("DRIFTWISE_ENGINE", "c")
    for engine in ("python", before):
        for each_kind in held:
            each_kind.cache_clear()
        os.environ["DRIFTWISE_ENGINE"] = engine
        if engine == "python":
            yield


def taken() -> Fact:
    """How many memories each family takes: it is made with them, and takes three samples."""
    found: dict[str, list[str]] = {name: [] for name in TAKERS}
    for (name, settings), (names, numbers) in itertools.product(TAKERS.items(), MEMORIES.items()):
        memory = load(*names)(*numbers)
        with contextlib.suppress(ValueError, TypeError, KeyError):
            est = load(name)(*settings, memory=memory)
            one, u = [1.0, 0.5] if name == "JointMIMO" else 1.0, 0.5 if est.model.inputs else None
            state = est.start()
            for _ in range(3):
                state, _step = est.update(state, one, u)
            found[name].append(type(memory).__name__)
    counts = ", ".join(str(len(names)) for names in found.values())
    return Fact(f"memories that {', '.join(TAKERS)} take, of {len(MEMORIES)}", counts, "", found)


def second_names() -> Fact:
    """Types of kernels that are no public memory: what the tables of the memories' functions hold besides."""
    public = set(itertools.chain(*MEMORIES)) - {"Fade"}
    answers = [(path, n.name) for path, n in each(ast.FunctionDef) if is_dispatcher(n) and n.name in ANSWERS]
    tables = [getattr(importlib.import_module(dotted(path)), name).table for path, name in answers]
    found = {kind.__name__ for kind in itertools.chain(*tables)} - public
    odd = sorted(name for name in found if not name.endswith("Kernel"))
    counts = f"{len(odd)}; {len(found) - len(odd)}"
    return Fact("second names of memories; types that kernels see, called <Public>Kernel", counts, "0;", odd)


def moves(trip) -> list[tuple[str, str]]:
    """Return the moves between files of a trip, the second time."""
    trip()
    files: list[str] = []

    def look(frame, event, argument):
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(str(PACKAGE)) and not code.co_name.startswith("<"):
            files.append(code.co_filename)

    sys.setprofile(look)
    try:
        trip()
    finally:
        sys.setprofile(None)
    return [(a, b) for a, b in itertools.pairwise(files) if a != b]


def one(est, sample):
    """Return the trip of one more sample through `update`, after forty."""
    state = est.start()
    for i in range(40):
        state, _ = est.update(state, *sample(i))
    return lambda: est.update(state, *sample(40))


def report() -> None:
    """`driftwise run` of the flight that comes along, with a report, without a named clock."""
    entry = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]["driftwise"]
    module, name = entry.split(":")
    with tempfile.TemporaryDirectory() as out, contextlib.redirect_stdout(io.StringIO()):
        file, before = str(PACKAGE / "data" / "flight.csv"), sys.argv
        sys.argv = ["driftwise", "run", file, "--output", "ground_speed_mps", "--report", f"{out}/report.html"]
        try:
            getattr(importlib.import_module(module), name)()
        except SystemExit as done:
            if done.code:
                raise
        finally:
            sys.argv = before


def samples() -> list[Fact]:
    """Moves between files of one sample, followed into its kernels."""
    y, u = [0.3, 1.2, -0.7, 0.4, 1.0], [0.5, -1.0, 0.2]
    plots, sample = (lambda i: (4.0 * i, [200.0 * i, 9.0 * i])), (lambda i: (y[i % 5], u[i % 3]))
    joint, auto = load("Joint")(2, 1), load("ARX")(2, 2, memory=load("AutoMemory", "Auto")())
    what = "moves between files: "
    return [
        Fact(what + "one Joint.update", len(moves(one(joint, sample))), "<= 14"),
        Fact(what + "one sample of ARX with AutoMemory", len(moves(one(auto, sample)))),
        Fact(what + "one TrackEstimator.update", len(moves(one(load("TrackEstimator")(), plots)))),
    ]


def trips() -> list[Fact]:
    """Moves between files of a run with a report, and of a sample of a fleet; loops are compiled, one step each."""
    pair = load("Fleet")(load("ARX")(2, 2), ["a"])
    step = pair.update_batch
    what, opened = "moves between files: ", []
    sys.addaudithook(lambda event, given: opened.append(str(given[0])) if event == "open" else None)
    report()
    times = sum(file.endswith("flight.csv") for file in opened)
    ways = moves(report)
    return [
        Fact("times that driftwise run opens FILE, without a named clock", times, "1"),
        Fact(what + "driftwise run FILE --report, loops as one step", len(ways), "<= 500"),
        Fact(what + "the same, each counted once however often a search makes it", len(set(ways))),
        Fact(what + "one sample of a fleet, loops as one step", len(moves(lambda: step(None, [1.0], [0.5]))), "5"),
    ]
