"""Numbers that are none are refused by every command, before anything is read or written."""

from itertools import chain

import pytest
import typer

from driftwise.cli.main import app


def options():
    """Yield the words of each option that takes a float, with what its command cannot do without."""
    found = typer.main.get_command(app)
    commands = {(name,): one for name, one in found.commands.items()}
    commands |= {("fleet", name): one for name, one in found.commands["fleet"].commands.items()}
    for words, command in commands.items():
        needed = [(p.opts[0], "x") if p.opts[0].startswith("-") else ("x",) for p in command.params if p.required]
        for param in command.params:
            if param.type.name.startswith("float") and not param.multiple:
                yield (*words, *chain(*needed), param.opts[0])


ASKED = list(options())


def test_all_commands_are_asked():
    assert {words[0] for words in ASKED} >= {"run", "validate", "export", "simulate", "track", "fleet"}


@pytest.mark.parametrize("words", ASKED, ids=" ".join)
def test_what_is_no_number_is_refused(call, words):
    code, out, complaint = call(*words, "nan")
    assert (code, out) == (2, "") and f"{words[-1]} must be" in complaint and "got nan" in complaint


@pytest.mark.parametrize("words", [words for words in ASKED if words[-1] == "--dt"], ids=" ".join)
@pytest.mark.parametrize("step", ["0", "-1", "inf"])
def test_time_does_not_stand_still(call, words, step):
    code, out, complaint = call(*words, step)
    assert (code, out) == (2, "") and "--dt must be a positive step of the clock" in complaint


@pytest.mark.parametrize(
    "words",
    [
        ("simulate", "-", "--a", "0.5,0.1", "--b", "1"),
        ("simulate", "-", "--a", "inf"),
        ("simulate", "-", "--noise", "pink"),
        ("simulate", "-", "--a", "5", "--samples", "500"),
        ("export", "arx:2,2@restart", "-i", "u", "--out", "x", "--name", "int"),
        ("export", "arx:2,2@restart", "-i", "u", "--out", "x", "--language", "ada"),
        ("export", "arx:2,2@auto", "-i", "u", "--out", "x", "--float"),
        ("export", "arx:2,2@auto", "-i", "u", "--out", "x", "--language", "st"),
        ("track", "--listen", "tcp://nowhere"),
    ],
    ids=" ".join,
)
def test_a_wrong_command_is_told_from_data_of_no_use(call, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, complaint = call(*words)
    assert (code, out) == (2, "") and complaint.count("\n") < 8 and not list(tmp_path.iterdir())
