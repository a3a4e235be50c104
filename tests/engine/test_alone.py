"""One process at a time in a folder."""

import os

import pytest

from driftwise import InputError
from driftwise.engine.alone import alone


def test_a_folder_is_of_one_and_free_afterwards_though_a_child_still_holds_its_files(tmp_path, monkeypatch):
    """A process that is just being started holds a copy of every open file until it runs its program."""
    real, copies = os.open, []

    def opened(*given, **also):
        number = real(*given, **also)
        copies.append(os.dup(number))
        return number

    monkeypatch.setattr(os, "open", opened)
    with alone(tmp_path, "it is taken"), pytest.raises(InputError, match="it is taken"), alone(tmp_path, "it is taken"):
        pass
    with alone(tmp_path, "it is taken"):
        pass
    for number in copies:
        os.close(number)
