"""Estimators side by side: numbers by hand, pieces like the whole, the command and its page."""

import json
import math

import numpy as np
import pytest
from scipy.stats import norm, t

import driftwise as dw
from driftwise.analysis.forecast import forecast, mixture_density
from driftwise.cli import specs
from driftwise.engine.errors import CommandError, InputError


def entrants():
    return {"first": dw.ARX(1, 1), "second": dw.ARX(2, 2), "auto": dw.ARX(2, 2, memory=dw.AutoMemory())}


@pytest.fixture(scope="module")
def record():
    late = np.arange(900)[:, None] >= 500
    b = np.where(late, [3.0, 0.5], [1.0, 0.5])
    return dw.simulate([-1.5, 0.7], b, samples=900, noise_std=0.3, missing=0.05, seed=1)


def test_numbers_by_hand():
    """Mean and last value of six numbers with a known variance of one, two samples left out."""
    y = np.array([1.0, 3.0, 2.0, math.nan, 4.0, 3.0])
    mean = dw.ARX(0, (), (), offset=True, variance=1.0, P0=1e12)
    last = dw.AR(1, theta0=[-1.0], P0=1e-24, variance=1.0)
    found = dw.compare(y, None, {"mean": mean, "last": last}, settle=2)
    rows = {row.name: row for row in found.rows}
    assert (found.samples, found.measured, found.scored) == (6, 5, 3)
    of_mean = np.array([2.0 - 2.0, 4.0 - 2.0, 3.0 - 2.5])  # errors at samples 2, 4, 5
    var_mean = np.array([1 + 1 / 2, 1 + 1 / 3, 1 + 1 / 4])
    log = norm.logpdf(of_mean, scale=np.sqrt(var_mean))
    assert rows["mean"].rmse == pytest.approx(math.sqrt(np.mean(of_mean**2)))
    assert rows["mean"].fit == pytest.approx(100 * (1 - rows["mean"].rmse / np.std([2.0, 4.0, 3.0])))
    assert rows["mean"].nlpd == pytest.approx(-log.mean(), rel=1e-9)
    assert rows["mean"].nis == pytest.approx(np.mean(of_mean**2 / var_mean))
    of_last, var_last = np.array([2.0 - 3.0, 4.0 - 2.0, 3.0 - 4.0]), np.array([1.0, 2.0, 1.0])  # two steps over the gap
    log_last = norm.logpdf(of_last, scale=np.sqrt(var_last))
    assert rows["last"].nlpd == pytest.approx(-log_last.mean(), rel=1e-9)
    assert rows["last"].coverage == 1.0
    worse = min(found.rows, key=lambda row: -row.difference)
    apart = np.abs(log - log_last) * np.sign((log - log_last) * (log.mean() - log_last.mean()))
    assert worse.difference == pytest.approx(apart.mean())
    assert worse.difference_std == pytest.approx(apart.std() / math.sqrt(3))
    assert worse.is_tied and found.tied == [worse.name]
    assert "predict equally well" in found.words and "2 settle the priors, 1 of y missing" in found.words


def test_densities_are_those_of_the_books(record):
    y, u = record
    trace = dw.ARX(2, 2).scan(y, u)
    found, use = forecast(trace), np.isfinite(trace.innovation) & (np.arange(900) > 10)
    book = t.logpdf(trace.innovation, trace.dof, scale=np.sqrt(trace.variance))
    np.testing.assert_allclose(found.log_density[use], book[use], rtol=1e-9)
    np.testing.assert_array_equal(found.is_inside[use], abs(trace.innovation[use]) <= trace.band()[use])
    assert np.isnan(found.log_density[np.isnan(y)]).all() and not found.is_inside[np.isnan(y)].any()
    auto = dw.ARX(2, 2, memory=dw.AutoMemory()).scan(y, u)
    weight, offset, scale, dof = (part[use] for part in auto.mixture())
    e = auto.innovation[use]
    parts = weight * t.pdf((e[:, None] - offset) / scale, np.minimum(dof, 1e9)[:, None]) / scale
    np.testing.assert_allclose(mixture_density(e, weight, offset, scale, dof), np.log(parts.sum(axis=1)), rtol=1e-6)


@pytest.mark.parametrize("piece", [1, 70, 450])
def test_pieces_are_the_whole(record, piece):
    y, u = record[0][:450], record[1][:450]
    whole, parts = dw.compare(y, u, entrants()), dw.analysis.Comparison(entrants())
    for k in range(0, len(y), piece):
        parts.add(y[k : k + piece], u[k : k + piece])
    for a, b in zip(whole.rows, parts.rows):
        assert a.name == b.name and a.alarms == b.alarms and a.unknowns == b.unknowns
        for name in ("fit", "rmse", "nlpd", "nis", "coverage", "difference", "difference_std"):
            assert getattr(a, name) == pytest.approx(getattr(b, name), rel=1e-9, abs=1e-12), name
    assert whole.path[0].tolist() == parts.path[0].tolist()


def test_the_order_is_that_of_the_log_density(record):
    found = dw.compare(*record, entrants())
    assert [row.name for row in found.rows] == ["auto", "second", "first"], "it follows the jump"
    assert found.rows[0].alarms >= 1 and found.rows[1].alarms == 0
    assert found.best == "auto" and found.tied == []
    assert found.rows[0].nlpd < found.rows[1].nlpd < found.rows[2].nlpd
    assert found.rows[1].us_per_sample > 0
    time, log = found.path
    assert len(time) == found.scored
    np.testing.assert_allclose(log[-1], -found.scored * np.array([found.rows[k].nlpd for k in (2, 1, 0)]))
    json.dumps(found.as_dict(), allow_nan=False)
    assert str(found).splitlines()[1].startswith("auto")


def test_the_path_stays_short():
    rng = np.random.default_rng(0)
    found = dw.analysis.Comparison({"ar": dw.AR(1)})
    for _ in range(5):
        found.add(rng.standard_normal(1500))
    time, _ = found.path
    assert 1000 <= len(time) <= 2000
    assert np.ptp(np.diff(time)) == 0


def test_doors(record):
    with pytest.raises(InputError, match="must be a dict"):
        dw.compare(*record, [dw.ARX(2, 2)])
    with pytest.raises(InputError, match="at least one"):
        dw.compare(*record, {})
    with pytest.raises(InputError, match="same inputs"):
        dw.compare(*record, {"a": dw.ARX(1, 1), "b": dw.ARX(1, (1, 1))})
    with pytest.raises(InputError, match=r"estimators\['a'\] must be an estimator of one output"):
        dw.compare(*record, {"a": dw.ARXMIMO(2, 1)})
    with pytest.raises(InputError, match="no sample could be scored"):
        _ = dw.compare(record[0][:5], record[1][:5], {"a": dw.ARX(1, 1)}).rows


def test_specs():
    asked = ["last", "average", "arx:2,2/1,1@exponential:0.99", "ar:2", "joint:3,unknown@restart"]
    found = specs.estimators(asked, ("u", "v"), 0.5)
    assert list(found) == asked
    arx, joint = found["arx:2,2/1,1@exponential:0.99"], found["joint:3,unknown@restart"]
    assert arx.options["memory"] == dw.ExponentialForgetting(0.99) and arx.model.nb == (2, 1)
    assert isinstance(found["ar:2"].options["memory"], dw.AutoMemory) and found["ar:2"].model.inputs == 0
    assert joint.model.n == 3
    assert isinstance(joint.options["memory"], dw.RestartOnChange) and joint.dt == 0.5
    assert found["average"].names == ["arx:2,2/1,1@exponential:0.99", "ar:2", "joint:3,unknown@restart"]
    for wrong, why in (
        (["foo:1"], "is not known"), (["arx:2,2,1@"], "a memory is expected"), (["ar:1", "ar:1"], "given twice"),
        (["joint:x"], "joint:N,NOISE"), (["average", "last"], "something to average"), (["arx:2"], "SPEC arx:2: "),
    ):  # fmt: skip
        with pytest.raises(InputError, match=why):
            specs.estimators(wrong, ("u",), 1.0)


@pytest.fixture
def table(tmp_path, record):
    y, u = record
    lines = [f"{0.5 * k},{a},{'' if math.isnan(b) else b}" for k, (a, b) in enumerate(zip(u, y))]
    (tmp_path / "plant.csv").write_text("t,u,y\n" + "\n".join(lines) + "\n")
    return tmp_path / "plant.csv"


def test_the_command(call, table, tmp_path):
    asked = ("arx:2,2,1", "arx:2,2,1@constant", "last", "mean", "-o", "y", "-i", "u", "-t", "t")
    page, file = tmp_path / "c.html", tmp_path / "c.json"
    code, out, err = call("compare", table, *asked, "--report", page, "--json", file)
    assert (code, err) == (0, "")
    rows = json.loads(file.read_text())["rows"]
    assert [row["name"] for row in rows] == ["arx:2,2,1", "arx:2,2,1@constant", "last", "mean"]
    for word in (
        "behind best",
        "-log p",
        "arx:2,2,1 predicts best",
        "means of the first chunk were subtracted",
        str(page),
    ):
        assert word in out
    text = page.read_text("utf-8")
    assert "Who was ahead when?" in text and "arx:2,2,1@constant" in text and len(text) < 3e6
    chunked = tmp_path / "d.json"
    call("compare", table, *asked, "--from", "0", "--to", "300", "--json", chunked)
    assert json.loads(chunked.read_text())["samples"] == 601


def test_the_command_refuses(call, table):
    code, _, err = call("compare", table, "foo", "-o", "y")
    assert code == 2 and "SPEC 'foo' is not known" in err
    assert call("compare", table, "ar:2", "-o", "y", "--json", table)[0] == 2
    assert issubclass(CommandError, InputError)
