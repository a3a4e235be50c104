"""The reproduction of a paper: few records here, the contract of its verdicts, its page, and its own oracles."""

import json
import re
import sys
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
from driftwise_studies.papers import clouds, counting, printed, radar_filters, records, reproduce, tests_1_to_4
from driftwise_studies.papers.verdict import Reproduction, Scaled, Section, Statement, Verdict
from oracle import dense, golden
from scipy import stats

import driftwise as dw
from driftwise.cli import main as cli
from driftwise.tracking import frames

KEYS = {"name", "value", "expected", "pass", "skipped", "source"}


def call(*args):
    """Run the command line and return its exit code."""
    before, sys.argv = sys.argv, ["driftwise", *map(str, args)]
    try:
        cli.main()
    except SystemExit as done:
        return done.code or 0
    finally:
        sys.argv = before
    return 0


def assert_cited(source):
    """A source names the paper's section or a page that is here."""
    for page in re.findall(r"\S+\.md", source):
        assert (Path(__file__).parents[2] / page).is_file(), source


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The whole command with few records: (exit code, what --json wrote, the page's folder)."""
    folder = tmp_path_factory.mktemp("reproduce")
    code = call("reproduce", "salut1979", "--seeds", 30, "--json", folder / "r.json", "--figures", folder / "page")
    return code, json.loads((folder / "r.json").read_text()), folder / "page"


def test_every_check_holds_and_the_exit_code_says_so(run):
    """30 records: tolerances are those of 300 times the square root of ten."""
    code, found, _ = run
    assert [row["name"] for row in found["verdicts"] if not row["pass"]] == []
    assert code == 0


def test_the_json_keeps_its_contract(run):
    _, found, _ = run
    assert found["name"] == "salut1979" and found["seeds"] == 30
    assert len(found["verdicts"]) > 30
    assert len({row["name"] for row in found["verdicts"]}) == len(found["verdicts"])
    for row in found["verdicts"]:
        assert set(row) == KEYS
        assert row["pass"] in (True, False)
        assert all(isinstance(row[key], str) and row[key] for key in ("name", "value", "expected", "source"))
        assert row["source"].startswith(("Salut 1979, ", "this package's "))
        assert_cited(row["source"])


def test_the_page_is_self_contained(run):
    page = (run[2] / "salut1979.html").read_text()
    assert "http" not in page and "<script" not in page and "@import" not in page
    sources = re.findall(r'src="([^"]{1,22})', page)
    assert sources and all(source.startswith("data:image/png;base64,") for source in sources)
    assert len(list(run[2].glob("*.png"))) == len(sources)
    assert "What is not reproduced" in page and "driftwise reproduce radar" in page


def test_unknown_names_and_too_few_records_are_refused(capsys):
    assert call("reproduce", "salut1980") == 1
    assert "there are: salut1979" in capsys.readouterr().err
    with pytest.raises(dw.InputError, match="at least 20"):
        reproduce("salut1979", 3)


def test_a_check_that_fails_is_an_exit_code(monkeypatch, capsys):
    said = [Statement(f"section {i}", "says it", "another thing") for i in range(3)]
    bad = [
        Verdict("one", "1", "2", False, "here", said[0]),
        Verdict("two", "", "", None, "here", said[1]),
        Verdict("three", "33 samples", "", True, "here", said[2]),
    ]
    found = Reproduction("x", "X", "", 10, [Section("part", verdicts=bad)])
    monkeypatch.setattr("driftwise_studies.papers.reproduce", lambda *args: found)
    assert call("reproduce", "x") == 1
    out = capsys.readouterr().out
    assert "1 of 3 findings confirmed, 1 not confirmed, 1 skipped; 1 statement of the paper does not hold" in out
    top = out[: out.index("\npart")]
    assert "section 2: says it" in top and "33 samples" in top and "section 0" not in top and "section 1" not in top


def test_verdicts_catch_a_filter_that_omits_the_correlation(monkeypatch):
    """Without S the estimate of test 1 goes to (.007, -.07, .83), and the paper's vector lies far outside."""
    monkeypatch.setattr(clouds.dw.models, "NoisePolynomial", lambda d, variance: dw.models.EquationError(variance))
    found = {verdict.name: verdict for verdict in tests_1_to_4.section(30).verdicts}
    assert found["test 1: mean of the estimate"].fails
    assert found["test 1: the paper's (0.18, -1.05, 1.83) is in the cloud"].fails


def test_tolerances_widen_like_standard_errors():
    assert Scaled(300).wide(0.1) == 0.1 == Scaled(1200).wide(0.1)
    assert Scaled(75).wide(0.1) == pytest.approx(0.2)
    assert Scaled(30).records(100) == 10


def test_a_small_cloud_is_wider():
    """Distances of a 21st vector from 20 others, 20 000 times: 99 % stay below Hotelling's limit."""
    rng, limit, inside = np.random.default_rng(6), tests_1_to_4.farthest(20), []
    for _ in range(20_000):
        points = rng.standard_normal((21, 3))
        gap = points[0] - points[1:].mean(axis=0)
        inside.append(gap @ np.linalg.solve(np.cov(points[1:].T), gap) < limit)
    assert np.mean(inside) == pytest.approx(0.99, abs=0.003)  # four standard errors


# --- the oracles of the reproduction against other oracles --------------------------------------------------


@pytest.mark.parametrize("brackets", printed.BRACKETS)
def test_the_printed_recursion_is_the_dense_one(brackets):
    rng = np.random.default_rng(0)
    y, u, st = rng.standard_normal(12), rng.standard_normal(12), dense.Structure(2, 1, True)
    noise = dense.Noise(np.zeros((7, 7)), np.zeros(7), 0.3)
    expected = dense.run(st, noise, np.zeros(7), np.eye(7), y, u)
    means, covariances, T = printed.run(2, y, 0.3, np.zeros(7), np.eye(7), u, brackets=brackets)
    golden.assert_close(means[-1], expected.s[-1], 1e-12)
    golden.assert_close(covariances[-1], expected.P[-1], 1e-12)
    golden.assert_close(T, expected.T, 1e-12)


def test_the_printed_recursion_keeps_its_arithmetic():
    y = np.array([1.0, 0.5, 0.25])
    means, _, _ = printed.run(1, y.astype(np.float32), np.float32(1), np.zeros(2, np.float32), np.eye(2, dtype="f4"))
    assert means[-1].dtype == np.float32
    exact = np.vectorize(lambda v: Decimal(float(v)), otypes=[object])
    means, _, _ = printed.run(1, exact(y), Decimal(1), exact(np.zeros(2)), exact(np.eye(2)))
    assert isinstance(means[-1][0], Decimal)
    assert printed.run_long(1, y, 1.0, np.zeros(2), np.eye(2))[0] == pytest.approx(means[-1].astype(float), abs=1e-15)


def test_canonical_noise_of_singer_is_golden():
    given, expected, _ = golden.case("G08")
    for i, case in enumerate(given["sets"]):
        d, variance = radar_filters.canonical_noise(
            *radar_filters.singer(case["alpha"], case["q"], case["dt"]), case["r"]
        )
        golden.assert_close(d, expected["d"][i], 1e-8)
        assert variance == pytest.approx(expected["var_v"][i], rel=1e-8)
        phi = np.exp(-case["alpha"] * case["dt"])
        golden.assert_close(radar_filters.NULL + phi * radar_filters.ALONG, expected["a"][i], 1e-12)


def test_fixed_filter_is_filterpys():
    filterpy = pytest.importorskip("filterpy.kalman")
    rng = np.random.default_rng(1)
    y = np.cumsum(rng.standard_normal((60, 2)), axis=0)
    y[[20, 21, 40]] = np.nan
    F, Q = radar_filters.constant_velocity(0.5, 2.0)
    prediction, variance = radar_filters.fixed(F, Q, 3.0, np.diag([3.0, 9.0]), y)
    for i in range(2):
        kf = filterpy.KalmanFilter(2, 1)
        kf.F, kf.Q, kf.H, kf.R, kf.P = F, Q, np.array([[1.0, 0.0]]), np.array([[3.0]]), np.diag([3.0, 9.0])
        kf.x = np.array([[y[0, i]], [0.0]])
        for t in range(1, len(y)):
            kf.predict()
            assert prediction[t, i] == pytest.approx(kf.x[0, 0], abs=1e-9)
            assert variance[t] == pytest.approx(kf.P[0, 0] + 3.0, rel=1e-9)
            if y[t, i] == y[t, i]:
                kf.update(y[t, i])


def test_east_north_on_the_ellipsoid():
    """A degree of latitude at 45 degrees is 111 132 m; one of longitude 78 847 m (less the sagitta of the chord)."""
    north = frames.east_north(np.array([44.995, 45.005]), np.array([7.0, 7.0]))[1]
    east = frames.east_north(np.array([45.0, 45.0]), np.array([7.0, 7.01]))[1]
    assert north == pytest.approx([0.0, 1111.32], abs=0.01)
    assert east[0] == pytest.approx(788.47, abs=0.01)


def test_ljung_box_is_statsmodels():
    diagnostic = pytest.importorskip("statsmodels.stats.diagnostic")
    e = np.random.default_rng(4).standard_normal((2, 200))
    expected = [diagnostic.acorr_ljungbox(row, [10]).lb_pvalue.iloc[0] for row in e]
    assert records.ljung_box(e) == pytest.approx(expected, rel=1e-9)


def test_records_follow_the_plain_recursion():
    v = np.random.default_rng(5).standard_normal((1, 30))
    y, _ = records.canonical(-records.PRINTED, *records.coloured(records.TRUE_D, v))
    again, _ = dw.simulate(-records.PRINTED[::-1], samples=30, d=records.TRUE_D[::-1], noise_std=0.0)
    assert not again.any()
    past = np.zeros(3)
    for t in range(30):  # y(t) = sum printed_k y(t - 3 + k) + v(t) + sum d_k v(t - 3 + k)
        lagged_y = [y[0, t - 3 + k] if t - 3 + k >= 0 else 0.0 for k in range(3)]
        lagged_v = [v[0, t - 3 + k] if t - 3 + k >= 0 else 0.0 for k in range(3)]
        assert y[0, t] == pytest.approx(v[0, t] + records.PRINTED @ lagged_y + records.TRUE_D @ lagged_v + past.sum())


def test_counting_numbers_count():
    counting.Counting.count = 0
    two, three = counting.Counting(2.0), counting.Counting(3.0)
    assert float(1.0 - two * three / 4.0) == pytest.approx(-0.5)
    assert counting.Counting.count == 3
    assert float(0.0 + two * 1.0) == 2.0
    assert counting.Counting.count == 3


def test_the_cloud_is_the_distribution_theory_gives():
    """Test 1, 100 records: squared Mahalanobis distances are about chi2 with 3 degrees (Kolmogorov-Smirnov, 0.1 %)."""
    y, x = records.paper_records(100)
    cloud = clouds.Cloud(clouds.TESTS[0], y, x)
    distances = [cloud.distance(vector) for vector in cloud.final]
    assert stats.kstest(distances, stats.chi2(3).cdf).pvalue > 1e-3
