"""The engine keeps its promises: nothing compiles early, numbers never recompile, the cache is used and never stale."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import driftwise as dw
from driftwise.engine import compile, objects, ud
from driftwise.engine.dispatch import Size, Vector, flatten, read, read_all
from driftwise.memory import time_update

PACKAGE = Path(dw.__file__).parent


def python(code, **env):
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, **env}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_import_loads_nothing_heavy():
    code = (
        "import sys, driftwise; print([m for m in ('numba', 'numpy', 'scipy', 'bokeh', 'pyarrow') if m in sys.modules])"
    )
    assert python(code) == "[]"


def test_help_does_not_load_numba_or_numpy():
    code = (
        "import sys\n"
        "from driftwise.cli.main import main\n"
        "sys.argv = ['driftwise', '--help']\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print('loaded', [m for m in ('numba', 'numpy', 'scipy', 'bokeh') if m in sys.modules])"
    )
    assert python(code).endswith("loaded []")


def test_numbers_never_recompile():
    a = dw.Joint(2, inputs=1, noise=dw.models.EquationError(0.1), memory=dw.RandomWalk(1e-3))
    b = dw.Joint(5, inputs=3, direct=True, noise=dw.models.EquationError(7.0), memory=dw.RandomWalk(np.arange(23.0)))
    a.update(a.start(), 0.0, 0.0)
    b.update(b.start(), 0.0, [0.0, 0.0, 0.0])
    assert a.drive is b.drive


def test_read_only_integer_float32_and_fortran_records_share_one_compilation():
    est = dw.Joint(1, inputs=2)
    rng = np.random.default_rng(0)
    y, u = rng.integers(-5, 5, 50), np.asfortranarray(rng.integers(-5, 5, (50, 2)).astype(np.float32))
    y.flags.writeable = u.flags.writeable = False
    whole = est.scan(y, u)
    again = est.scan(y.astype(float), np.ascontiguousarray(u, float))
    assert np.array_equal(whole.table, again.table)
    y, u = y.astype(float), np.ascontiguousarray(u, float)
    y.flags.writeable = u.flags.writeable = False  # as what a data frame hands over
    assert np.array_equal(whole.table, est.scan(y, u).table)


CACHED = """
import driftwise as dw
est = dw.Joint(1, noise=dw.models.EquationError(1.0), P0=1.0)
state, step = est.update(est.start(), 1.0)
from driftwise.engine import objects
print(*(entry.origin for entry in objects.loaded.values()), float(step.variance))
"""


def test_cache_is_used_and_never_stale(tmp_path):
    """A copy of the package is edited in a module other than the driver's: the edit must take effect."""
    shutil.copytree(PACKAGE, tmp_path / "driftwise", ignore=shutil.ignore_patterns("__pycache__", "data"))
    env = {"PYTHONPATH": str(tmp_path), "DRIFTWISE_CACHE": str(tmp_path / "cache")}
    assert python(CACHED, **env) == "made 2.0"
    assert python(CACHED, **env) == "cache 2.0"
    source = tmp_path / "driftwise" / "engine" / "ud.py"
    text = source.read_text()
    assert text.count("a = R + f[0] * b[0]") == 1
    source.write_text(text.replace("a = R + f[0] * b[0]", "a = 3.0 * R + f[0] * b[0]"))
    assert python(CACHED, **env) == "made 4.0"
    assert python(CACHED, **env) == "cache 4.0"


class Breathing(NamedTuple):
    """A user's own memory: the parameters widen for one sample in ``period``."""

    period: float
    q: Vector


@time_update.on(Breathing)
def _(memory, state, elapsed, view):
    if view.D[view.first] * memory.period < 0.01:
        for i in range(memory.q.size):
            ud.widen(view.U, view.D, view.first + i, memory.q[i], view.b)
    return 1.0, 0


def test_a_users_own_policy_runs_compiled_in_a_few_lines():
    est = dw.Joint(
        1, inputs=1, noise=dw.models.EquationError(0.01), memory=Breathing(7.0, np.array([1e-3, 1e-3])), P0=10.0
    )
    y, u = dw.simulate([-0.8], [1.0], samples=80, noise_std=0.1, noise="equation", seed=2)
    fast = est.scan(y, u)
    rows, outs = est._rows(est.start()), np.empty_like(fast.table[None])
    drive = compile.plain_driver(*map(type, est.policies))
    drive(rows, y.reshape(1, -1, 1), u.reshape(1, -1, 1), outs, est.spec, est.scratch())
    np.testing.assert_allclose(fast.table, outs[0], rtol=1e-9, atol=1e-12)
    dw.check_policy(Breathing(7.0, np.array([1e-9] * 4)))
    plain = dw.Joint(1, inputs=1, noise=dw.models.EquationError(0.01), P0=10.0).scan(y, u)
    assert fast.parameters_std[-1, 0] > plain.parameters_std[-1, 0]


def test_a_change_of_a_users_policy_changes_the_fingerprint():
    assert compile.fingerprint((Breathing,)) != compile.fingerprint(())


@pytest.mark.parametrize("numbers", [(), (1.0,), (1.0, np.array([2.0, 3.0])), (np.array([]), 4.0)])
def test_policies_survive_the_trip_through_a_row(numbers):
    names = [f"p{i}" for i in range(len(numbers))]
    kinds = [Vector if np.ndim(v) else float for v in numbers]
    kind = NamedTuple("kind", list(zip(names, kinds)))
    back, at = read(kind, flatten([kind(*numbers), kind(*numbers)]), 0)
    assert all(np.array_equal(a, b) for a, b in zip(back, numbers))
    assert at == len(flatten([kind(*numbers)]))


class Shape(NamedTuple):
    n: Size
    b: Vector
    scale: float
    m: Size


@pytest.mark.parametrize("sizes", [(), (3.0, 5.0)])
def test_all_policies_of_a_row_are_read_at_once_and_the_sizes_of_the_first_where_they_are_given(sizes):
    policies = (
        Shape(2.0, np.array([7.0, 8.0]), 0.5, 4.0),
        Breathing(7.0, np.array([])),
        Shape(1.0, np.ones(3), 2.0, 9.0),
    )
    assert compile.sizes(policies[0]) == (2.0, 4.0)
    form, *others = read_all(tuple(map(type, policies)), sizes, flatten(policies))
    assert (form.n, form.m) == (sizes or (2.0, 4.0)) and form.scale == 0.5 and form.b.tolist() == [7.0, 8.0]
    assert [type(policy) for policy in others] == [Breathing, Shape]
    assert flatten(others).tolist() == flatten(policies[1:]).tolist()


def test_history_does_not_grow():
    """What one update allocates does not depend on how many came before."""
    import tracemalloc

    est = dw.Joint(2, inputs=1)
    state = est.start()
    for k in range(50):
        state, _ = est.update(state, float(k % 3), 1.0)
    objects.wait()  # another thread allocates too, as long as it has a compiler at work
    tracemalloc.start()
    sizes = []
    for k in range(600):
        state, _ = est.update(state, float(k % 3), 1.0)
        if k % 200 == 199:
            sizes.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert max(sizes) - min(sizes) < 2000
