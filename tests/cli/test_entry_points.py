"""What distributions bring is what importlib.metadata says of them."""

import sys
from importlib import metadata

import pytest

from driftwise.cli.entry_points import entry_points


@pytest.mark.parametrize("group", ["driftwise.commands", "console_scripts", "pytest11", "no such group"])
def test_entry_points_are_those_of_the_standard_library(group):
    expected = metadata.entry_points(group=group)
    assert entry_points(group) == {e.name: e.value for e in reversed(expected)}


def test_the_first_folder_of_the_path_wins(tmp_path, monkeypatch):
    for number in (1, 2):
        info = tmp_path / str(number) / "greeter-1.0.dist-info"
        info.mkdir(parents=True)
        text = f"[other]\nx = a:b\n\n[{__name__}]\n# said twice\ngreet = greeter{number}:hello\n[third]\ny = c:d\n"
        (info / "entry_points.txt").write_text(text)
        monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path / str(number)), str(tmp_path / "nowhere")])
    assert entry_points(__name__) == {"greet": "greeter1:hello"}
