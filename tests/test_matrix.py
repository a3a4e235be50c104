"""Every model takes every memory that the table of refusals does not refuse, and each pair obeys all laws."""

import subprocess
import sys
from pathlib import Path

import pytest

import driftwise as dw
from driftwise import memory as policies
from driftwise.analysis.laws import example
from driftwise.analysis.matrix import MEMORIES, MODELS, YES, pairs, said, tried
from driftwise.estimators.common.refusals import REFUSED
from driftwise.memory.questions import MEMORIES as ANSWERING

TAKEN = [pair for pair in pairs() if said(*pair) == YES]
LEAST = {"AdaptiveGain": 14}  # all others: every memory


def test_the_matrix_has_every_memory_and_the_table_no_stranger():
    ours = {name for name in policies.__all__ if getattr(policies, name) in ANSWERING}
    assert ours == set(MEMORIES)  # whoever is exported was registered, too
    assert set(REFUSED) <= set(MODELS) and all(set(refused) <= ours for refused in REFUSED.values())


@pytest.mark.parametrize("model", MODELS)
def test_what_the_table_says_is_so(model):
    for memory in MEMORIES:
        found = tried(model, memory)
        assert found == YES if said(model, memory) == YES else said(model, memory) in found, memory
    assert sum(said(model, memory) == YES for memory in MEMORIES) >= LEAST.get(model, len(MEMORIES))


@pytest.mark.parametrize("model, memory", TAKEN, ids=map("-".join, TAKEN))
def test_every_pair_obeys_the_laws(model, memory):
    estimator = MODELS[model](MEMORIES[memory])
    dw.check_estimator(estimator, *example(estimator, samples=60))


def test_the_docs_print_the_matrix():
    script = Path(__file__).parents[1] / "scripts" / "matrix.py"
    run = subprocess.run([sys.executable, script, "--check"], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr


def test_a_refusal_tells_the_reason_and_what_was_said():
    with pytest.raises(dw.InputError, match=r"AdaptiveGain does not take RestartOnChange: what watches .* got Restart"):
        dw.AdaptiveGain(memory=dw.RestartOnChange())
    with pytest.raises(dw.InputError, match="were the brackets forgotten"):
        dw.AdaptiveGain(memory=dw.RestartOnChange)
