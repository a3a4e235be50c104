"""The list of mutants fits the tree: every line is there once, every test is there; a changed line is noticed."""

import pytest

from scripts.mutants import Mutant, read, wrong


def test_every_mutant_has_its_line_and_its_test():
    found = read()
    assert len(found) >= 50 and wrong(found) == []
    assert len({one.name for one in found}) == len(found)
    areas = {one.file.split("/")[2] for one in found}
    assert areas >= {"engine", "estimators", "memory", "detect", "tracking"}


def test_a_mutant_changes_its_line_in_its_function_alone():
    source = "def one():\n    x = 1\n    return x\n\n\ndef two():\n    x = 1\n    return x\n"
    changed = Mutant("", "", "two", "x = 1", "x = 2", "").apply(source)
    assert changed == source[:40] + source[40:].replace("x = 1", "x = 2") and changed.count("x = 2") == 1


def test_lines_that_are_not_there_once_are_told():
    source = "def one():\n    x = 1\n    x = 1\n"
    for function, old, words in (
        ("", "x = 1", "2 times"),
        ("one", "y = 1", "0 times"),
        ("two", "x = 1", "no function"),
    ):
        with pytest.raises(LookupError, match=words):
            Mutant("", "", function, old, "x = 2", "").apply(source)
