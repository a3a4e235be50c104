"""Inputs that once broke a decoder, and some thousand new ones."""

import pytest
from draws import slow

from hostile.decoders import DECODERS
from hostile.fuzz import CORPUS, broken, fuzz

KEPT = sorted(path for path in CORPUS.glob("*/*") if path.parent.name in DECODERS)


@pytest.mark.parametrize("path", KEPT, ids=[f"{path.parent.name}-{path.name}" for path in KEPT])
def test_what_broke_a_decoder_is_refused(path):
    assert not broken(path.parent.name, path.read_bytes())


@pytest.mark.parametrize("inputs", [30, slow(5000)])
@pytest.mark.parametrize("name", DECODERS)
def test_altered_bytes_are_read_or_refused(name, inputs):
    found = fuzz(name, inputs, seed=20, is_kept=False)
    assert not {wrong: count for wrong, count in found.items() if wrong}
