"""What an identification claims: its words are the texts of its claims, each a number to hold against the truth."""

import json
import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

import driftwise as dw
from driftwise.analysis.claims import _is_seen
from driftwise.results.claims import KINDS, Claim, told
from driftwise.results.whiteness import Whiteness


def plant(samples=900, seed=1):
    """Return heater and temperature of a plant of first order: time constant 4.48 samples, gain 5."""
    rng = np.random.default_rng(seed)
    u, y = np.repeat(rng.choice([0.0, 1.0, 2.0], samples // 4), 4), np.zeros(samples)
    for t in range(1, samples):
        y[t] = 0.8 * y[t - 1] + 1.0 * u[t - 1] + 0.2 * rng.standard_normal()
    return u, y + 20


@pytest.fixture(scope="module")
def found():
    u, y = plant()
    return dw.identify({"heater_V": u, "temperature [degC]": y})


def of(found, kind):
    return [claim for claim in found.claims if claim.kind == kind]


def test_the_words_are_the_texts_of_the_claims_and_nothing_else(found):
    assert found.words == told(claim for claim in found.claims if claim.kind != "table")
    assert found.words.startswith(found.answer) and found.words.endswith(found.table_words)
    assert all(claim.kind in KINDS and claim.text.endswith((".", ")")) for claim in found.claims)


def test_a_claim_can_be_held_against_the_truth(found):
    (gain,), (tau,) = of(found, "gain"), of(found, "time constant")
    assert gain.subject == "heater_V" and gain.interval[0] < 5.0 < gain.interval[1]
    assert tau.interval[0] < -1 / np.log(0.8) < tau.interval[1] and tau.interval[0] < tau.value < tau.interval[1]
    columns = {claim.subject: claim.value for claim in of(found, "column")}
    assert columns["output"] == "temperature [degC]" and columns["inputs"] == ("heater_V",)
    assert [claim.value for claim in of(found, "model choice")] == [found.chosen.name]
    (none,) = of(found, "change")
    assert none.subject == "none" and none.value["gain"]["heater_V"] < 0.5 and none.value["noise"] < 3


def test_the_results_of_the_command_carry_them(tmp_path, capsys):
    from driftwise.cli.main import app

    u, y = plant()
    file, result = tmp_path / "plant.csv", tmp_path / "r.json"
    file.write_text("heater_V,temperature [degC]\n" + "".join(f"{a:g},{b:.5g}\n" for a, b in zip(u, y)))
    app(["run", str(file), "--json", str(result)], standalone_mode=False)
    said = " ".join(capsys.readouterr().out.split())
    claims = json.loads(result.read_text())["claims"]
    assert {"column", "gain", "change", "forecast", "model choice"} <= {claim["kind"] for claim in claims}
    for claim in claims:
        assert " ".join(claim["text"].split()) in said


def test_a_claim_of_no_kind_is_refused():
    with pytest.raises(ValueError, match="a claim is of column"):
        Claim("weather", "here", "It rains.")


def test_gains_are_those_since_the_last_jump_without_outliers():
    """A level that jumps, and samples far away: the whole record would give another gain, and a wider interval."""
    rng = np.random.default_rng(3)
    u, y = plant()
    y[450:] += 30.0
    y += np.where(rng.random(len(y)) < 0.01, 20.0, 0.0)
    found = dw.identify({"heater_V": u, "temperature [degC]": y})
    (gain,) = of(found, "gain")
    assert gain.interval[0] < 5.0 < gain.interval[1] and gain.interval[1] - gain.interval[0] < 1.0
    assert any(abs(claim.value - 450) < 5 for claim in of(found, "change"))


def test_a_gain_that_jumps_about_an_input_far_from_zero_is_called_a_gain():
    """From zero it would be a level as well: what jumps is the slope about where the input is."""
    rng = np.random.default_rng(2)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0], 225), 4)
    y = np.zeros(len(u))
    for t in range(1, len(u)):
        y[t] = 0.8 * y[t - 1] + (1.0 if t < 450 else 2.0) * u[t - 1] + 0.2 * rng.standard_normal()
    found = dw.identify({"heater_V": u + 200.0, "temperature [degC]": y + 20})
    (change,) = of(found, "change")
    assert change.subject.startswith("the gain from heater_V doubled") and abs(change.value - 450) < 10


def test_a_gain_that_is_not_known_is_not_told():
    rng = np.random.default_rng(1)
    u, y = plant()
    found = dw.identify({"heater_V": u, "valve_V": rng.standard_normal(len(u)), "temperature [degC]": y},
                        output="temperature [degC]", input=["heater_V", "valve_V"])  # fmt: skip
    told = {claim.subject: claim for claim in of(found, "gain")}
    assert told["valve_V"].value is None and "not known" in told["valve_V"].text
    assert told["heater_V"].value == pytest.approx(5.0, abs=0.5)


def test_the_most_likely_and_the_simplest_are_not_confused(found):
    import dataclasses

    best = found.chosen._replace(evidence=0.0)
    other = next(rival for rival in found.rivals if rival is not found.chosen)._replace(evidence=-0.4)
    slow = other._replace(evidence=-9.0)
    for chosen, subject in ((best, "most likely"), (other, "as likely"), (slow, "follows")):
        said = dataclasses.replace(found, rivals=[best, other], chosen=chosen).claims
        (choice,) = [claim for claim in said if claim.kind == "model choice"]
        assert choice.subject == subject and choice.odds == pytest.approx(math.exp(chosen.evidence))
        assert best.name in choice.text and ("simplest" in choice.text) == (chosen is other)


@pytest.mark.parametrize("after", [1.0, 0.5])
def test_an_answer_whose_end_was_not_seen_has_no_gain_in_any_sentence(after, tmp_path):
    """A tank integrates its valve: no gain, no time; a change of it is told as a share of what it was."""
    rng = np.random.default_rng(1)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0], 150), 6)
    rate = np.where(np.arange(900) < 400, 0.2, 0.2 * after)
    y = np.cumsum(rate * u) + 0.3 * rng.standard_normal(900)
    found = dw.identify({"valve_V": u, "level [cm]": np.concatenate([[0.0], y[:-1]])})
    assert [claim.value for claim in of(found, "gain")] == [None] and not of(found, "time constant")
    assert "the plant may integrate" in of(found, "gain")[0].text
    told = [claim.subject for claim in of(found, "change") if "the gain" in claim.subject]
    assert len(told) == (after < 1) and all("of what it was" in one for one in told)
    page = re.sub("<[^>]*>", " ", found.report(tmp_path / "page.html").read_text(encoding="utf-8"))
    assert re.search(r"Steady-state gain\s+not known\s+may integrate", page)


def test_a_gain_that_is_not_known_falls_to_a_share_of_what_it_was(found):
    """From one number to another, while no sentence dares to say the number, was no answer."""
    from driftwise.analysis.change_log import Change, where_known
    from driftwise.analysis.effects import UNKNOWN, Effect

    change = Change(9, 9.0, (8, 9), (8.0, 9.0), 1e9, "the gain from u fell from 2 to 1", 0, "the gain from u halved")
    known = Effect(1.0, 0.1, (0.8, 1.2), None, None)
    assert where_known(change, (known,)) is change and where_known(change, ()) is change
    assert where_known(change, (UNKNOWN,)).moved == "the gain from u halved"
    assert where_known(change, (known._replace(interval=(0.1, 1.9)),)).moved == "the gain from u halved"


def test_a_forecast_of_all_models_is_relied_on_where_the_likeliest_alone_is_not(found):
    import dataclasses

    poor = found.chosen._replace(rmse=2 * max(found.judged.values()))
    text = dataclasses.replace(found, chosen=poor).claims[0].text
    assert text.startswith("The forecast of all") and f"not so {poor.name}" in text and "last value" in text


def test_no_gain_of_an_equation_whose_errors_are_not_white():
    from driftwise.analysis.effects import Effect, Effects

    found = Effects((Effect(1.0, 0.1, (0.8, 1.2), None, None),))
    assert found.of[0].is_known and not found.unknown().of[0].is_known and not found.unknown().is_endless
    assert found.unending().is_endless


def test_a_gain_that_is_claimed_is_not_taken_back_by_another_sentence():
    """An ARX whose level wanders has a pole at one; the response beside a slow noise knows the gain all the same."""
    rng = np.random.default_rng(2)
    u, y = plant()
    found = dw.identify({"heater_V": u, "temperature [degC]": y + np.cumsum(0.3 * rng.standard_normal(len(y)))})
    assert any(claim.value is not None for claim in of(found, "gain"))
    assert "cannot be told from 1" not in found.words


def test_what_follows_one_change_of_the_noise_begins_where_it_ended():
    rng = np.random.default_rng(5)
    u, y = plant()
    size = np.select([np.arange(900) < 300, np.arange(900) < 600], [3.0, 1.0], 0.2)
    found = dw.identify({"heater_V": u, "temperature [degC]": y + size * rng.standard_normal(900)})
    told = [claim.subject.split() for claim in of(found, "change") if "the noise" in claim.subject]
    assert len(told) == 2 and told[0][-1] == told[1][-3]  # fell from .. to ..


def test_a_plant_that_runs_away_has_no_gain_in_any_sentence():
    """A pole outside of the unit circle, held near by steps of its input: what it does in the end is not told."""
    rng, y = np.random.default_rng(4), np.zeros(600)
    u = np.zeros(600)
    for t in range(1, 600):
        y[t] = 1.08 * y[t - 1] + 0.5 * u[t - 1] + 0.02 * rng.standard_normal()
        u[t] = -0.5 * y[t] + 0.2 * rng.choice([-1.0, 1.0])
    found = dw.identify({"valve_V": u, "level [cm]": y})
    assert "is unstable" in found.words and not of(found, "time constant")
    assert [claim.value for claim in of(found, "gain")] == [None]


def test_an_answer_that_is_over_before_the_next_sample_has_no_time_below_it():
    """The line from sample to sample would say 0.008 s of a clock of 0.1 s."""
    rng = np.random.default_rng(3)
    u = np.repeat(rng.choice([-1.0, 0.0, 1.0], 40), 10)
    y = lfilter([0.6, 0.4], [1.0], u) + 0.01 * rng.standard_normal(400)
    found = dw.identify({"time_s": 0.1 * np.arange(400), "heater_V": u, "temperature [degC]": y})
    (claim,) = of(found, "time constant")
    assert claim.text.endswith("is done within the sampling time of 0.1 s.") and claim.interval == (0.0, 0.1)


@pytest.mark.parametrize(
    "pole, std, statistic, is_told",
    [
        (0.8 * np.exp(0.9j), 0.05, 20.0, True),
        (0.8 * np.exp(0.9j), 0.05, 200.0, False),  # something is left to predict: another model, other modes
        (0.99 * np.exp(0.9j), 0.02, 200.0, True),  # but what hardly dies out stands out of any
        (-0.1, 0.2, 20.0, False),
        (0.1, 0.2, 20.0, True),  # its interval says how little is known
    ],
)
def test_a_mode_is_told_of_a_model_that_leaves_nothing_or_where_it_lasts(pole, std, statistic, is_told):
    summary = SimpleNamespace(whiteness=Whiteness(statistic, 20, 0.5, True), observed=300)
    assert _is_seen(complex(pole), std, SimpleNamespace(summary=summary)) == is_told
