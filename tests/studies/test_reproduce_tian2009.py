"""`driftwise reproduce tian2009`: few records, the contract of the verdicts, checks that can fail."""

import re

import numpy as np
import pytest
from driftwise_studies.papers.tian import claims, coefficients, exactness, growth, headline, ours, prior, watchers
from driftwise_studies.papers.tian.listed import LISTED, LISTED_ERRORS
from driftwise_studies.papers.verdict import Statement
from test_reproduce_abid import assert_contract, command

from driftwise.estimators.algebraic_observer.theorem import Theorem
from driftwise.estimators.window_observer.gains import Design

CHECKS = [  # one for each line of the acceptance list
    "coefficients of the motor",
    "every equation is what long division",
    "kernels k(t, tau)",
    "on D1 = s^N",
    "variance of y^(m)",
    "the theorem as this package computes it",
    "windows of 50 and 500 samples",
    "estimates and deviations of five windows",
    "deviation of x3 in 0.5 s",
    "gains for position and speed",
    "a plant that grows like exp(3 t)",
    "a window of 8 s",
    "10 000 samples of a window",
    "a load torque of 1 N m",
    "what cannot be seen is refused",
    "twelve samples at irregular instants",
    "epsilon that follows from the deviations",
    "x3 of the theorem over least squares",
    "weights at the end of 1001 points",
    "two windows agree as chi-square says",
    "R +10 % is found",
    "a line of amplitude 500",
    "parameters of y''",
    "joint filter started",
    "x3 from 2 s on",
    "deviations mean what they say",
    "figure 1",
    "figure 4",
    "x3 at the paper's epsilon",
    "the table of priors",
    *(f"errors of the states: {name}" for name in LISTED),
    *(f"model errors: {case}" for case in LISTED_ERRORS),
]


@pytest.mark.slow
def test_the_paper_with_few_records(tmp_path):
    """The whole command: every check holds, the page is self-contained and lists what does not hold."""
    code, found = command("tian2009", tmp_path, 20, "--figures", tmp_path / "page")
    assert code == 0
    assert_contract(found, "tian2009", 20, CHECKS)
    page = (tmp_path / "page" / "tian2009.html").read_text()
    assert "http" not in page and "<script" not in page
    assert len(re.findall(r'src="data:image/png', page)) == 5
    count = sum(isinstance(one, Statement) for one in vars(claims).values())
    assert f"{count} statements of the paper do not hold" in page


# --- checks can fail -----------------------------------------------------------------------------------------


def test_checks_catch_the_printed_indices(monkeypatch):
    """A package that took k_q for the same whatever j is told so."""
    honest = Theorem.alpha

    def printed(self, mu, h):
        kept = self.k
        self.k = [kept[min(j, 1)] for j in range(len(kept))]
        try:
            return honest(self, mu, h)
        finally:
            self.k = kept

    monkeypatch.setattr(Theorem, "alpha", printed)
    assert [coefficients._motor().confirmed, coefficients._rule().confirmed] == [False, False]


def test_checks_catch_a_wrong_frequency(monkeypatch):
    honest = headline.theorem
    monkeypatch.setattr(headline, "theorem", lambda: honest((52.0,)))
    headline.found.cache_clear()
    one = headline.found(2)
    headline.found.cache_clear()
    assert not headline._states(one).confirmed and not headline._third(one).confirmed


def test_checks_catch_deviations_that_are_not(monkeypatch):
    """Deviations a tenth too small: told by the records and by the table of priors."""
    honest = vars(Design)["std"].fget
    monkeypatch.setattr(Design, "std", property(lambda self: 0.9 * honest(self)))
    found, errors = prior.table(2)
    assert not exactness._honest(20).confirmed and not prior._listed(found, errors).confirmed


def test_checks_catch_a_prior_that_does_nothing():
    assert not ours._same_kalman(ours.Compiled(watchers.window(np.inf, *exactness.MODES["6 modes"]))).confirmed


@pytest.mark.parametrize("hold, order", [("Euler", 1), ("FOH", 2)])
def test_naive_ways_have_the_order_they_should(hold, order, monkeypatch):
    """Half the step: errors fall by two, and by four (away from round-off)."""
    from driftwise_studies.papers.tian import motor

    errors = []
    for rate in (1000, 2000):
        monkeypatch.setattr(motor, "RATE", rate)
        monkeypatch.setattr(growth, "RATE", rate)
        monkeypatch.setattr(growth, "AT", (rate,))
        r = motor.records(seeds=range(1))
        errors.append(abs(growth.naive(r, hold)[0, 1] - r.x[rate, 1]))
    assert errors[0] / errors[1] == pytest.approx(2**order, rel=0.2)
