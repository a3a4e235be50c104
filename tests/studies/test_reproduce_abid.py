"""`driftwise reproduce abid2008` and `policies`: few records, the contract of the verdicts, checks that can fail."""

import json
import re

import numpy as np
import pytest
from driftwise_studies.papers.abid import automatic, claims, entrants, gain, likelihood, plain, ranking, surprises
from driftwise_studies.papers.abid.systems import RANKED, system
from driftwise_studies.papers.verdict import Scaled, Statement
from oracle import drifting, drifting_matching
from test_reproduce import KEYS, assert_cited, call

import driftwise as dw

PAPER = [  # one check at least for each line of the acceptance list
    "known Q, correct gain",
    "known Q, printed gain",
    "record by record",
    "the likelihood without log S",
    "gradient of the likelihood",
    "Loewner",
    "other units",
    "covariance matching, rule",
    "not clamped breaks down",
    "σ² told ten times too large",
    "σ² told ten times too small",
    "fuzzy is better than the auxiliary filter only with",
    "cannot separate Q",
    "the square wave",
    "steps over their standard deviations",
]
POLICIES = [
    *(f"error on {name} " for name in RANKED),
    *(f"bars and NIS on {name}" for name in RANKED if name != "a"),
    "geometric mean and worst",
    "AutoMemory, jumps",
    "louder noise is told",
    "louder noise does not",
    "a rest",
    "outputs missing, AutoMemory",
    "outliers, expect='both'",
    "outliers, expect='outliers'",
    "the peers' test: from",
    "the peers' test, tuned",
    "smoothing takes away",
    "the likelihood tells",
    "dated afterwards",
    "rank as studied before",
]


def command(name, folder, seeds, *more):
    """Run the whole command and return (exit code, what --json wrote)."""
    code = call("reproduce", name, "--seeds", seeds, "--json", folder / "r.json", *more)
    return code, json.loads((folder / "r.json").read_text())


def assert_contract(found, name, seeds, must):
    assert found["name"] == name and found["seeds"] == seeds
    assert [row["name"] for row in found["verdicts"] if not row["pass"]] == []
    names = [row["name"] for row in found["verdicts"]]
    assert len(set(names)) == len(names)
    for row in found["verdicts"]:
        assert set(row) == KEYS
        assert all(isinstance(row[key], str) and row[key] for key in ("name", "value", "expected", "source"))
        assert_cited(row["source"])
    assert [part for part in must if not any(part in one for one in names)] == []


@pytest.mark.slow
def test_the_paper_with_few_records(tmp_path):
    """The whole command: every check holds, the page is self-contained and lists what does not hold."""
    code, found = command("abid2008", tmp_path, 30, "--figures", tmp_path / "page")
    assert code == 0
    assert_contract(found, "abid2008", 30, PAPER)
    page = (tmp_path / "page" / "abid2008.html").read_text()
    assert "http" not in page and "<script" not in page
    assert len(re.findall(r'src="data:image/png', page)) == 3
    count = sum(isinstance(one, Statement) for one in vars(claims).values())
    assert f"{count} statements of the paper do not hold" in page


@pytest.mark.slow
def test_the_ranking_with_few_records(tmp_path):
    code, found = command("policies", tmp_path, 40, "--figures", tmp_path / "page")
    assert code == 0
    assert_contract(found, "policies", 40, POLICIES)


# --- the plain recursion against the oracle ------------------------------------------------------------------

PAIRS = {
    "known": (lambda s: plain.Known(s.q), lambda s: drifting.Known(s.q)),
    "fuzzy": (lambda s: plain.Fuzzy(), lambda s: drifting.Fuzzy()),
    "auxiliary": (lambda s: plain.Auxiliary(), lambda s: drifting_matching.Auxiliary()),
}


@pytest.mark.parametrize("printed", [False, True], ids=["correct", "printed"])
@pytest.mark.parametrize("rule", PAIRS)
def test_plain_recursion_is_the_oracles(rule, printed):
    s = system("a", 5)
    mine = plain.follow(s, PAIRS[rule][0](s), printed)
    units = drifting.MeanSquare(plain.FLOOR, True)
    other = drifting.run(PAIRS[rule][1](s), s.y, s.psi, s.phi, s.told, published=printed, ms=units)
    np.testing.assert_allclose(mine.e, other.eps, atol=1e-12)
    np.testing.assert_allclose(mine.filtered, other.theta_f, atol=1e-12)
    np.testing.assert_allclose(mine.q, other.q, atol=1e-14)


def test_likelihood_is_the_oracles():
    s = system("a", 3)
    one = likelihood.likelihood(s, s.q[0], s.sigma2)
    run = drifting.run(drifting.Known(s.q), s.y, s.psi, s.phi, s.told)
    e, S = run.eps[:, likelihood.SKIP :], run.S[:, likelihood.SKIP :]
    np.testing.assert_allclose(one.F, -0.5 * np.sum(np.log(2 * np.pi * S) + e**2 / S, axis=1), rtol=1e-12)
    np.testing.assert_allclose(one.printed, -0.5 * np.sum(e**2 / S, axis=1), rtol=1e-12)


# --- checks can fail -----------------------------------------------------------------------------------------


def test_checks_catch_the_printed_gain(monkeypatch):
    """A package that had the paper's gain would be told so by three checks of the gain."""
    honest = plain.follow
    monkeypatch.setattr(gain, "scores", lambda seeds: swapped(honest, seeds))
    failed = {verdict.name for verdict in gain.section(30).verdicts if verdict.fails}
    assert "known Q, printed gain: innovations are correlated and P is too small" in failed
    assert sum("record by record" in name for name in failed) == 2


def swapped(follow, seeds):
    """The scores of `example`, known Q only, with the two gains exchanged."""
    from driftwise_studies.papers.abid import example

    return {
        (size, printed, example.KNOWN): example.score(follow(s, plain.Known(s.q), not printed), s.theta)
        for size in example.SIZES
        for s in [system("a", seeds, q=size)]
        for printed in (False, True)
    }


def test_checks_catch_a_default_that_forgets(monkeypatch):
    """`AutoMemory` replaced by plain forgetting fails on error, bars and jumps."""
    ranking.line.cache_clear()
    slow = [
        one._replace(memory=lambda phi: dw.ExponentialForgetting(0.98)) if one.name == "AutoMemory" else one
        for one in entrants.ENTRANTS
    ]
    monkeypatch.setattr(ranking, "ENTRANTS", slow)
    failed = [verdict.name for verdict in automatic.section(20).verdicts if verdict.fails]
    ranking.line.cache_clear()
    for part in ("error on a", "error on d", "geometric mean", "bars and NIS on c", "AutoMemory, jumps"):
        assert any(part in name for name in failed), part


def test_detection_counts_what_it_says():
    jump = int(dw.Status.JUMP)
    status = np.zeros((3, 600), int)
    status[0, [205, 402]] = jump  # both seen, after 5 and 2
    status[1, [219, 420]] = jump  # the first seen, the second one sample too late: false
    share, delay, false = automatic.detection(status, (200, 400))
    assert share == pytest.approx(3 / 6) and delay == pytest.approx((5 + 19 + 2) / 3) and false == pytest.approx(1 / 3)


def test_bounds_widen_only_with_fewer_records():
    assert automatic.slack(Scaled(200, 200), 0.04) == 0 == automatic.slack(Scaled(900, 200), 0.04)
    assert automatic.slack(Scaled(50, 200), 0.04) == pytest.approx(0.04)


def test_the_peers_level_is_theirs():
    """y[-1], the reference's last estimate and its error are printed beside the peers' numbers."""
    verdict, table = surprises._level()
    assert verdict.confirmed and len(table.rows) == len(surprises.STARTS) + 1
