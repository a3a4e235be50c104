"""The cards of an identification say what its words do, and no more."""

import re

import numpy as np

import driftwise as dw


def page(found, tmp_path) -> str:
    """Return the words of a report, without its scripts."""
    found.report(tmp_path / "page.html")
    text = re.sub(r"<(script|style)[^>]*>.*?</\1>", " ", (tmp_path / "page.html").read_text(), flags=re.S)
    return " ".join(re.sub(r"<[^>]+>", " ", text).split())


def test_a_mode_that_no_words_tell_stands_on_no_card(tmp_path):
    found = dw.identify({"return": np.random.default_rng(0).standard_normal(400)})
    assert not [claim for claim in found.claims if claim.kind in ("time constant", "pole")]
    assert "Slowest mode not known" in page(found, tmp_path)


def test_too_few_samples_for_a_change_are_not_none(tmp_path):
    y, u = dw.simulate([-0.8], [1.0], samples=120, noise_std=0.3, seed=1)
    found = dw.identify({"valve": u, "level": y})
    assert "Whether anything jumped cannot be said" in found.words
    assert "Changes not known" in page(found, tmp_path)


def test_a_change_is_dated_as_the_table_has_it_where_the_clock_starts_again(tmp_path):
    y, u = dw.simulate([-0.8], [1.0], samples=600, noise_std=0.3, seed=1)
    y[450:] += 20.0
    days = [str(day) for day in np.datetime64("2020-01-01") + np.arange(300)]
    found = dw.identify({"date": days + days, "valve": u, "level": y})
    assert "last 2020-05-30 of the second run" in page(found, tmp_path)
