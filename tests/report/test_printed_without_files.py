"""Where no file can be opened any more, not even that of a module, what is wrong is still said."""

import builtins

from driftwise.report import printed


def test_a_sentence_without_a_library_for_terminals(monkeypatch, capsys):
    load = builtins.__import__

    def refused(name, *args, **kwargs):
        if name.partition(".")[0] == "rich":
            raise OSError(24, "Too many open files", "rich/__init__.py")
        return load(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", refused)
    printed.say("stopped by \x1b[31m the system", stderr=True)
    told = capsys.readouterr()
    assert not told.out
    assert told.err == "stopped by \N{SYMBOL FOR ESCAPE}[31m the system\n"
