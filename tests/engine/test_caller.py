"""Compiled loops as functions of Python: what is no array of theirs is refused, and nothing is kept or held up."""

import gc
import math
import shutil
import sys
import threading
import time

import numpy as np
import pytest

import driftwise as dw
from driftwise.engine import caller, compile, objects
from driftwise.engine.compilers import compilers

pytestmark = pytest.mark.skipif(not compilers(), reason="no C compiler: THE CALLER WAS NOT TESTED")


def gather(matrix, row, order, scale, times):
    s = 0.0
    for i in range(order.size):
        s += row[order[i]] * scale + times
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            matrix[i, j] += s
    return matrix.shape[0] * 100 + matrix.shape[1]


def spend(row, times):
    for _ in range(times):
        for j in range(row.size):
            row[j] = row[j] * 0.999 + 0.001


DIMENSIONS = 2, 1, "index", float, int


def arguments() -> list:
    return [np.ones((2, 3)), np.arange(4.0), np.array([3, 1]), 0.5, 2]


@pytest.fixture(scope="module")
def loop():
    return compile.function(gather, *DIMENSIONS)


@pytest.fixture
def both(loop, monkeypatch, tmp_path):
    """The same loop by both ways in: what an array looks like in memory, and the buffer protocol."""
    monkeypatch.setattr(caller, "_is_laid_out", lambda: False)
    again = shutil.copy(objects._caller().library._name, tmp_path / "again.so")
    entry = next(entry for key, entry in objects.loaded.items() if key.startswith("gather-"))
    return loop, caller.Caller(again).function(objects._entry(entry.path), DIMENSIONS)[0]


def test_numbers_are_those_of_plain_python_by_both_ways(both):
    for loop in both:
        fast, plain = arguments(), arguments()
        assert loop(*fast) == gather(*plain) == 203
        assert np.array_equal(fast[0], plain[0])


def test_arrays_of_other_types_with_the_same_memory_are_taken(both, tmp_path):
    class Mine(np.ndarray):
        pass

    plain = arguments()
    gather(*plain)
    mapped = np.memmap(tmp_path / "matrix", np.float64, "w+", shape=(2, 3))
    for loop in both:
        for matrix in (np.ones((2, 3)).view(Mine), mapped, memoryview(np.ones((2, 3)))):
            np.asarray(matrix)[:] = 1.0
            assert loop(matrix, *arguments()[1:]) == 203
            assert np.array_equal(np.asarray(matrix), plain[0])


def test_empty_arrays_are_arrays(both):
    for loop in both:
        assert loop(np.empty((0, 3)), np.empty(0), np.empty(0, np.int64), 0.5, 2) == 3


def _frozen():
    array = np.ones((2, 3))
    array.flags.writeable = False
    return array


WRONG = {
    "single precision": (0, np.ones((2, 3), np.float32)),
    "integers for numbers": (0, np.ones((2, 3), np.int64)),
    "numbers for integers": (2, np.ones(2)),
    "short integers": (2, np.ones(2, np.int32)),
    "unsigned integers": (2, np.ones(2, np.uint64)),
    "complex": (1, np.ones(4, complex)),
    "another order of bytes": (1, np.ones(4, ">f8" if sys.byteorder == "little" else "<f8")),
    "objects": (1, np.array([None] * 4)),
    "records": (1, np.zeros(4, [("x", "f8")])),
    "one dimension": (0, np.ones(6)),
    "three dimensions": (0, np.ones((2, 3, 1))),
    "no dimension": (1, np.array(1.0)),
    "columns": (0, np.asfortranarray(np.ones((2, 3)))),
    "every other one": (1, np.arange(8.0)[::2]),
    "backwards": (1, np.arange(4.0)[::-1]),
    "not to be written to": (0, _frozen()),
    "not aligned": (1, np.frombuffer(bytearray(33), np.uint8)[1:].view(np.float64)),
    "bytes": (0, b"123456"),
    "a list": (0, [[1.0]]),
    "nothing": (1, None),
    "a number": (1, 2.0),
    "a word for a number": (3, "half"),
    "a word for an integer": (4, "two"),
    "a fraction for an integer": (4, 2.5),
    "an integer too large": (4, 2**70),
}


@pytest.mark.parametrize("at, wrong", WRONG.values(), ids=WRONG)
def test_what_is_no_argument_is_refused(both, at, wrong):
    for loop in both:
        given = arguments()
        given[at] = wrong
        with pytest.raises((TypeError, BufferError, ValueError, OverflowError)):
            loop(*given)
        assert loop(*arguments()) == 203


@pytest.mark.parametrize("count", [0, 4, 6, 40])
def test_too_few_arguments_and_too_many(both, count):
    for loop in both:
        with pytest.raises(TypeError, match="as many arguments"):
            loop(*(arguments() * 9)[:count])
        with pytest.raises(TypeError):
            loop(*arguments(), scale=1.0)


def test_minus_one_is_a_number_like_any_other(both):
    for loop in both:
        fast, plain = [*arguments()[:3], -1.0, -1], [*arguments()[:3], -1.0, -1]
        assert loop(*fast) == gather(*plain)
        assert np.array_equal(fast[0], plain[0])


def test_nothing_is_kept_and_nothing_is_lost(both):
    for loop in both:
        times = int("1002")  # no other thread holds this very integer, as it may a two
        good, bad = [*arguments()[:4], times], [*arguments()[:4], "no number at all"]
        counts = [sys.getrefcount(thing) for thing in (*good, *bad, loop)]
        for _ in range(1000):
            loop(*good)
            with pytest.raises(TypeError):
                loop(*bad)
        gc.collect()
        assert [sys.getrefcount(thing) for thing in (*good, *bad, loop)] == counts
        good[0].resize((3, 2), refcheck=True)  # nobody holds its memory


def test_long_loops_let_other_threads_run():
    """The interpreter's lock is free: a second thread counts while the first is inside."""
    loop, row, seen = compile.function(spend, 1, int), np.ones(5000), []
    begin = time.perf_counter()
    loop(row, 200)
    times = int(200 * 0.5 / (time.perf_counter() - begin)) + 1  # half a second
    thread = threading.Thread(target=loop, args=(row, times))
    thread.start()
    while thread.is_alive():
        seen.append(time.perf_counter())
        time.sleep(0.002)
    thread.join()
    assert len(seen) > 10


def test_a_call_costs_less_than_a_microsecond_or_so():
    loop, row = compile.function(spend, 1, int), np.ones(1)
    best = min(_seconds(loop, row) for _ in range(5))
    print(f"{1e9 * best:.0f} ns a call")
    assert best < 5e-6


def _seconds(loop, row, calls=20_000):
    begin = time.perf_counter()
    for _ in range(calls):
        loop(row, 0)
    return (time.perf_counter() - begin) / calls


# --- one sample of plain numbers ---------------------------------------------------------------------------


def joint() -> dw.Joint:
    return dw.Joint(2, 1)


NUMBERS = [0.5, -1.0, math.nan, 3, np.float64(0.25), np.float32(0.5), True, np.int64(2), np.array(0.5), np.array([1.5])]


@pytest.mark.parametrize("est", [joint(), dw.AR(2), dw.ARX(1, 1, memory=dw.AutoMemory())], ids=repr)
def test_a_sample_taken_as_numbers_has_the_bits_of_the_record(est):
    """Also where most come as arrays and odd types, which go the general way."""
    ys = np.array([float(np.ravel(y)[0]) for y in NUMBERS] * 5)
    us = ys[::-1].copy() if est.model.inputs else None
    state, shown = est.start(), []
    for i, y in enumerate(NUMBERS * 5):
        state, step = est.update(state, y, None if us is None else us[i].item())
        shown.append(step)
    trace = est.scan(ys, us)
    assert state.tobytes() == trace.state.tobytes()
    assert np.array_equal([s.prediction for s in shown], trace.prediction, equal_nan=True)
    assert {type(s.status) for s in shown} == {int} and {type(s.variance) for s in shown} == {float}


def test_what_is_no_sample_is_left_to_the_general_way():
    est = joint()
    rows = est.start(1).view(float).reshape(1, -1)
    before = rows.tobytes()
    step = est._stream
    for y, u in [(math.inf, 0.0), (0.0, -math.inf), (10**400, 0.0), ("1", 0.0), (0.0, None), (True, 0.0), (None, 0.0)]:
        assert step(rows, y, u, est.spec) == ()
    for wrong in (rows[0], rows.astype(np.float32), rows.tolist(), np.asfortranarray(np.ones((3, 4)))):
        assert step(wrong, 0.0, 0.0, est.spec) == ()
    assert step(rows, 0.0, 0.0) == () == step(rows, 0.0, 0.0, est.spec[::2])
    rows.flags.writeable = False
    assert step(rows, 0.0, 0.0, est.spec) == ()
    assert rows.tobytes() == before


@pytest.mark.parametrize("y, u", [(math.inf, 0.0), (10**400, 0.0), (0.0, 10**400), ("one", 0.0), (0.0, None)])
def test_a_sample_that_is_none_is_refused_in_a_sentence(y, u):
    with pytest.raises(dw.InputError, match="y"):
        joint().update(joint().start(), y, u)


def test_steps_of_many_estimators_are_kept_once():
    before = len(caller._kept)
    for _ in range(5):
        est = joint()
        est.update(est.start(), 0.0, 0.0)
    assert len(caller._kept) <= before + 3  # the loop, the table of what it takes, and one step


def test_what_is_wide_goes_the_general_way():
    """Two inputs, two outputs, a start in the loop, an average: no step of their own, the same call."""
    assert dw.ARX(1, (1, 1))._stream(None, 0.0, (0.0, 0.0), None) == ()
    est = dw.Joint(1, 1, start="algebraic")
    _, shown = est.update(est.start(), 0.5, 1.0)
    assert est._stream is not joint()._stream and np.isfinite(shown.variance)
