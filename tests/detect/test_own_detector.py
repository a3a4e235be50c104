"""A detector of a user's own: public by one line, saved, known to the command line."""

import copy
from typing import NamedTuple

import pytest

import driftwise as dw
from driftwise.cli.specs import detector
from driftwise.detect import registry
from driftwise.detect.registry import by_word, register
from driftwise.engine.errors import InputError
from driftwise.results import snapshot


@pytest.fixture(autouse=True)
def apart(monkeypatch):
    """What a test registers, it registers for itself."""
    entries = copy.copy(registry.ENTRIES)
    monkeypatch.setattr(registry, "ENTRIES", entries)
    monkeypatch.setattr(snapshot, "DETECTORS", entries)


def made():
    @register("long", "whatever takes long", "how long", is_whole=True)
    class Long(NamedTuple):
        false_alarms: str = "1000"
        length: int = 5

    return Long


def test_those_of_the_package_come_first():
    made()
    assert list(by_word()) == ["parameters", "level", "noise", "glr", "long"]


def test_a_registered_detector_is_saved_and_has_a_word():
    Long = made()
    assert detector("long:100,7") == Long("100", 7) and detector("long:100") == Long("100")
    with pytest.raises(InputError, match=r"SIZE is how long, a whole number"):
        detector("long:100,7.5")
    with pytest.raises(InputError, match=r"one SIZE is expected \(how long\)"):
        detector("long:100,7,8")
    assert snapshot._rich(snapshot._plain(Long("100", 7))) == Long("100", 7)


def test_two_detectors_of_one_name_are_refused():
    made()
    with pytest.raises(InputError, match=r"a detector PageHinkley already, in driftwise\.detect\.hinkley"):
        register()(NamedTuple("PageHinkley", [("h", float)]))
    assert dw.PageHinkley is registry.ENTRIES["PageHinkley"].kind
