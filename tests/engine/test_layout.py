"""Rows declared once: what is written from a declaration is what one would have written by hand."""

import inspect
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from driftwise.engine.layout import REST, Field, Layout, each, joined, layout_of, numbers, policy

n = 99  # a name of the module is no size


class Form(NamedTuple):
    """A form with a condition, a table and a policy."""

    n: float
    inputs: float
    tested: float
    gains: np.ndarray
    memory_size: float


LAYOUT = Layout(
    *numbers("head", samples="samples taken", status="bits"),
    *joined("s", Field("x", ("n",)), Field("theta", ("N - n",))),
    Field("U", ("N", "N")),
    *joined("pairs", *each("n", low="below", high="above"), table=("2", "n")),
    Field("tests", ("pair * n * (form.tested > 0)",)),
    Field("gains", ("len(form.gains)",)),
    policy("memory_state", of="memory"),
    pair=2,
    N="n * (inputs + 1)",
)
LAYOUT.on(Form)


@pytest.mark.parametrize("tested", [0.0, 0.5])
def test_views_are_the_slices_written_by_hand(tested):
    form = Form(3.0, 1.0, tested, np.zeros(4), 5.0)
    n, N, tests = 3, 6, 6 if tested else 0
    row = np.arange(2.0 + N + N * N + 2 * n + tests + 4 + 5)
    view, at = LAYOUT.open(form, row), 2 + N + N * N
    assert LAYOUT.size(form) == row.size
    assert np.array_equal(view.head, row[:2]) and np.array_equal(view.s, row[2 : 2 + N])
    assert np.array_equal(view.U, row[2 + N : at].reshape(N, N))
    assert np.array_equal(view.pairs, row[at : at + 2 * n].reshape(2, n))
    assert view.tests.size == tests and np.array_equal(view.gains, row[-9:-5])
    assert np.array_equal(view.memory_state, row[-5:])
    assert all(np.shares_memory(part, row) or not part.size for part in view)


def test_a_record_has_the_same_numbers_under_their_names():
    form = Form(2.0, 1.0, 1.0, np.zeros(1), 3.0)
    row = np.arange(float(LAYOUT.size(form)))
    state, view = row.view(LAYOUT.dtype(form)).reshape(()), LAYOUT.open(form, row)
    assert state["samples"] == 0.0 and state["status"] == 1.0
    assert np.array_equal(np.concatenate([state["x"], state["theta"]]), view.s)
    assert np.array_equal([state["low"], state["high"]], view.pairs)
    assert np.array_equal(state["memory_state"], view.memory_state)
    for name, at in LAYOUT.slices(form).items():
        assert np.array_equal(np.ravel(state[name]), row[at])
    assert layout_of(form) is LAYOUT
    more = LAYOUT.dtype(form, more=[("begun", "f8")])
    assert more.fields["begun"][1] == LAYOUT.dtype(form).itemsize


def test_sizes_may_be_given_one_by_one_and_the_last_field_may_take_the_rest():
    layout = Layout(Field("ms", ("N",)), Field("q", ("N",)), Field("own", (REST,)), given=("N",))
    view, places = layout.open(np.arange(7.0), 2), layout.places(2)
    assert view.ms.tolist() == [0, 1] and view.q.tolist() == [2, 3] and view.own.tolist() == [4, 5, 6]
    assert places == (0, 2, 4) and layout.size(2) == 4
    wider = layout.replace(N="3", given=("own",))
    assert wider.open(np.arange(7.0), 1).own.tolist() == [6]


def test_the_text_is_there_for_a_debugger():
    assert "end_of_s = end_of_head + n + (N - n)" in LAYOUT.source
    assert inspect.getsource(LAYOUT.open) in LAYOUT.source
    assert LAYOUT.open.__module__ == __name__, "a user's own declaration is part of the key of compiled code"


def test_compiled_views_are_the_plain_ones():
    import numba

    from driftwise.engine import views

    views.bind()
    layout = Layout(*numbers("head", a="", b=""), Field("M", ("n", "n + 1")), Field("v", (REST,)), given=("n",))
    row = np.arange(20.0)
    for plain, compiled in zip(layout.open(row, 3), numba.njit(layout.open)(row, 3)):
        assert np.array_equal(plain, compiled) and np.shares_memory(compiled, row)


def test_the_tables_of_the_documentation_are_what_is_declared():
    script = Path(__file__).parents[2] / "scripts" / "state_tables.py"
    assert subprocess.run([sys.executable, script, "--check"]).returncode == 0, f"run {script.name}"
