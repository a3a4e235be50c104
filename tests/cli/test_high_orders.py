"""A model with very many unknowns is told before the work, and is not judged by what takes minutes."""

import time

import numpy as np
import pytest

import driftwise as dw
from driftwise.analysis import diagnose
from driftwise.cli import estimate
from driftwise.engine import ud
from driftwise.models.canonical import Canonical


@pytest.fixture(scope="module")
def record():
    return dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=100, noise_std=0.1, seed=2)


def test_many_unknowns_are_told_before_the_work_and_too_many_refused(call, record, tmp_path, monkeypatch):
    file = tmp_path / "table.csv"
    file.write_text("u,y\n" + "".join(f"{u},{y}\n" for y, u in zip(*record)))
    run = ("run", file, "-o", "y", "-i", "u", "--memory", "constant", "--model")
    assert estimate.MANY > 30
    monkeypatch.setattr(estimate, "MANY", 5)
    code, _, err = call(*run, "arx:3,3,1")
    assert code == 0
    assert err == (
        "driftwise: --model arx:3,3,1 has 7 unknowns, which takes long, and 100 rows may be too few for so many: "
        "was a smaller one meant?\n"
    )
    assert call(*run, "arx:2,2,1")[2] == ""
    code, out, err = call(*run, "arx:60,60,1")
    assert (code, out) == (1, "") and "100 measured outputs are too few for 121 unknowns (--model arx:60,60,1" in err


def test_odds_that_would_take_minutes_are_not_asked_for(record, monkeypatch):
    trace = dw.ARX(2, 2, memory=dw.Constant()).scan(*record)
    assert "odds" in trace.diagnose().find("drift or jump").advice
    monkeypatch.setattr(diagnose, "WORK", 100 * 4**4 - 1)
    monkeypatch.setattr(diagnose, "odds", None)  # not to be called
    found = trace.diagnose().find("drift or jump")
    assert "odds" not in found.advice


def test_poles_of_high_orders_are_not_sampled_for_minutes():
    rng = np.random.default_rng(1)
    for order, most in ((60, 3.0), (200, 3.0)):
        a = np.real(np.poly(rng.uniform(-0.9, 0.9, order)))[1:]
        found = dw.models.Model(Canonical(order), a, 1e-4 * np.eye(order))
        begin = time.process_time()
        assert found.poles_std.shape == (order,)
        assert time.process_time() - begin < most
        assert set(found.method) == ({"first order"} if order > 100 else {"sampled"})


def test_a_diagonal_prior_of_many_unknowns_is_factored_at_once():
    begin = time.process_time()
    U, D = ud.factor(np.diag(np.linspace(1.0, 2.0, 2000)))
    assert time.process_time() - begin < 1.0 and np.array_equal(U, np.eye(2000)) and D[-1] == 2.0
