"""Write the reference of the site from docstrings and the command line from its own help, and say what they lack.

python scripts/reference.py FOLDER     # a page for each public name, an index, command-line.md
python scripts/reference.py --check    # exit code 1 where a public name lacks an example, an argument, a shape or unit
"""

import importlib
import inspect
import re
import sys
from pathlib import Path
from typing import NamedTuple

ROOMS = {
    "": "At the top",
    "estimators": "Estimators",
    "memory": "Memories",
    "detect": "Detectors",
    "models": "Models and noise",
    "analysis": "Questions to a record",
    "results": "Results",
    "fleet": "Fleets",
    "tracking": "Tracks",
}


class Name(NamedTuple):
    """A public name: where it is said first, the thing, and every place it can be imported from."""

    path: str
    thing: object
    places: list[str]

    @property
    def kind(self) -> str:
        if hasattr(self.thing, "__metadata__"):  # an annotation, such as `PerParameter`
            return "mark"
        return "class" if inspect.isclass(self.thing) else "function"

    @property
    def first_line(self) -> str:
        if self.kind == "mark":
            return f"Marks a field of a policy that holds {self.thing.__metadata__[0]}."
        return " ".join((inspect.getdoc(self.thing) or "").partition("\n\n")[0].split())


def names() -> dict[str, list[Name]]:
    """Return the public names by room, each once, where it is said first."""
    found: dict[int, Name] = {}
    rooms: dict[str, list[Name]] = {room: [] for room in ROOMS}
    for room in ROOMS:
        package = ".".join(filter(None, ("driftwise", room)))
        module = importlib.import_module(package)
        for name in module.__all__:
            thing, path = getattr(module, name), f"{package}.{name}"
            if id(thing) in found:
                found[id(thing)].places.append(path)
            else:
                found[id(thing)] = Name(path, thing, [path])
                rooms[room].append(found[id(thing)])
    return rooms


# --- what a docstring must say -----------------------------------------------------------------------------

ARRAYS = {"y", "u", "z", "s", "e", "theta", "P", "Q", "R", "S", "F", "G", "H", "D", "A", "B", "E", "mean", "covariance"}
SIZED = re.compile(
    r"\((?:T|N|n|m|k|p|d|[0-9])[^()]*\)|\bshape\b|\btable\b|column|matrix|matrices|square|row|number|\b(?:float|int|series)\b"
)
UNITS = {  # what is said of an argument that has a unit
    "dt": r"[Ss]econds?\b|as (?:in|for)",
    "time": r"[Ss]econds?\b|instants?|clock|as (?:in|for)",
    "frequencies": r"rad/s|Hz",
    "noise_std": r"deviation",
    "y_scale": r"size|deviation|as (?:in|for)",
}


def arguments(thing) -> list[str]:
    """Return the names of the arguments that somebody gives."""
    try:
        given = inspect.signature(thing).parameters.values()
    except (TypeError, ValueError):
        return []
    fields = getattr(thing, "__dataclass_fields__", {})
    return [
        p.name
        for p in given
        if p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)
        and not p.name.startswith("_")
        and (p.name not in fields or fields[p.name].init)
    ]


def lacking(name: Name) -> list[str]:
    """Return what the docstring of a public name lacks: an example, an argument, a shape."""
    if name.kind == "mark":
        return []
    said = inspect.getdoc(name.thing) or ""
    lacks = [] if ">>> " in said else ["an example"]
    if is_asked_for(name):
        told = set(re.findall(r"\b\w+\b", said.partition("Examples\n")[0]))
        lacks += [f"argument {argument}" for argument in arguments(name.thing) if argument not in told]
    for argument, text in told_arguments(said):
        if argument in ARRAYS and not SIZED.search(text):
            lacks.append(f"the shape of {argument}")
        if argument in UNITS and not re.search(UNITS[argument], text):
            lacks.append(f"the unit of {argument}")
    return lacks


def is_asked_for(name: Name) -> bool:
    """Say whether somebody calls it: results are made by others, errors and statuses are caught."""
    return not re.search(r"Trace\b|Status$|Error$|Smoothed\w+$|Step$|^driftwise\.results\.[A-Z]", name.path)


def told_arguments(said: str) -> list[tuple[str, str]]:
    """Return the entries of the section of parameters, each with all that is said of it."""
    body = re.search(r"^Parameters\n-+\n(.*?)(?=^\w[\w ]*\n-{3,}\n|\Z)", said, re.S | re.M)
    entries = re.findall(r"^(\w[\w, *]*?) : (.*(?:\n(?:[ ].*|)$)*)", body[1], re.M) if body else []
    return [(name.strip(" *"), text) for names, text in entries for name in names.split(",")]


# --- pages -------------------------------------------------------------------------------------------------


def page(name: Name) -> str:
    """Return the page of a name."""
    short = name.path.rpartition(".")[2]
    module, source = getattr(name.thing, "__module__", ""), name.path
    lines = [f".. _{source}:", "", short, "=" * len(short), ""]
    if len(name.places) > 1:
        lines += ["Also ``" + "``, ``".join(name.places[1:]) + "``.", ""]
    lines += [f".. currentmodule:: {source.rpartition('.')[0]}", ""]
    if name.kind == "class":
        lines += [f".. autoclass:: {short}", "   :members:", "   :inherited-members: tuple, str, int, float, Exception"]
        lines += ["   :exclude-members: count, index" if issubclass(name.thing, tuple) else ""]
    elif name.kind == "function":
        lines += [f".. autofunction:: {short}"]
    else:
        return (
            "\n".join([*lines, f".. py:data:: {short}", "", f"   {name.first_line} :doc:`/contribute` uses it."]) + "\n"
        )
    lines += ["", f"Defined in ``{module}``."]
    return "\n".join(lines) + "\n"


def index(rooms: dict[str, list[Name]]) -> str:
    """Return the index of all names, room by room."""
    lines = ["Every public name", "=================", ""]
    lines += [
        f"{sum(map(len, rooms.values()))} names. What people type most is at the top (``import driftwise as dw``); the "
        "rest is where it belongs, ``dw.memory.Window`` say. Shapes are law: time comes first, ``y`` is (T,) "
        "or (T, p), ``u`` is (T,) or (T, k), NaN is a missing sample. Parameters and their bars are in the units "
        "of the data: :doc:`/conventions`.",
        "",
    ]
    for room, title in ROOMS.items():
        package = ".".join(filter(None, ("driftwise", room)))
        lines += [f"{title}", "-" * len(title), "", f"``{package}``", "", ".. list-table::", "   :widths: 30 70", ""]
        for name in sorted(rooms[room], key=lambda each: each.path.lower()):
            short = name.path.rpartition(".")[2]
            lines += [f"   * - :doc:`{short} <{name.path}>`", f"     - {name.first_line}"]
        lines += [""]
    lines += [".. toctree::", "   :hidden:", ""]
    lines += [f"   {name.path}" for room in rooms.values() for name in sorted(room, key=lambda each: each.path.lower())]
    return "\n".join(lines) + "\n"


def command_line() -> str:
    """Return the page of the command line, from its own help."""
    import typer

    from driftwise.cli.main import app

    lines = ["# The command line", "", "What `--help` says, of every command.", ""]
    for path, command in commands(typer.main.get_command(app)):
        lines += [f"## {path}", "", cell(command.help or "", paragraphs=True), ""]
        shown = [p for p in command.params if not getattr(p, "hidden", False) and p.name != "help"]
        if shown:
            lines += ["| argument | what it says |", "|---|---|"]
            for p in shown:
                is_option = p.param_type_name == "option"
                word = ", ".join([*p.opts, *p.secondary_opts]) if is_option else (p.metavar or p.name.upper())
                value = "" if not is_option or p.is_flag else f" {p.metavar or p.type.name.upper()}"
                lines += [f"| `{cell(word + value)}` | {cell(getattr(p, 'help', '') or '')} |"]
            lines += [""]
    return "\n".join(lines) + "\n"


def commands(command, path="driftwise"):
    """Yield (words, command) of each command that is not hidden, groups too."""
    inner = getattr(command, "commands", {})
    if path != "driftwise" and not inner:
        yield path, command
    for name in sorted(inner):
        if not inner[name].hidden:
            yield from commands(inner[name], f"{path} {name}")


def cell(text: str, paragraphs: bool = False) -> str:
    """Return a text for Markdown, in one line unless it has paragraphs."""
    text = inspect.cleandoc(text).replace("\b", "")
    if not paragraphs:
        return " ".join(text.split()).replace("|", "\\|")
    return text


def write(folder: Path) -> None:
    """Write all pages; those that are as they were keep their time, so that they are not built again."""
    rooms = names()
    pages = {f"{name.path}.rst": page(name) for room in rooms.values() for name in room}
    pages |= {"index.rst": index(rooms), "command-line.md": command_line()}
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        if old.name not in pages:
            old.unlink()
    for name, text in pages.items():
        path = folder / name
        if not path.exists() or path.read_text() != text:
            path.write_text(text)


def main(*options: str) -> int:
    """Write the pages, or say what is lacking."""
    if "--check" not in options:
        write(Path(options[0]))
        return 0
    lacks = {name.path: lacking(name) for room in names().values() for name in room}
    for path, what in lacks.items():
        if what:
            print(f"{path}: lacks {', '.join(what)}")
    print(f"{len(lacks)} public names, {sum(bool(what) for what in lacks.values())} lack something")
    return int(any(lacks.values()))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
