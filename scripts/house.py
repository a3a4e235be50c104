"""Print what the package is made of, measured: lines, circles, twins, time updates, moves between files.

Run: python scripts/house.py [--json FILE] [--static] (half a minute; --static leaves out what has to run, the trips).

Things are found by what they are (a class with `update` and `scan`, slices of the row of a form), by name only where
nothing else tells them; then the old name and the new one count alike, so that two states of the code compare.

How the moves of a trip are counted: `house_trips.py`.
"""

from __future__ import annotations

import ast
import json
import re
import statistics
import sys
import tomllib
from collections import Counter
from pathlib import Path

from house_tree import (
    ALONE,
    CELLS,
    EXPERIMENTS,
    KERNELS,
    MEMORIES,
    OWNERS,
    ROOT,
    SHARED,
    TIME_UPDATES,
    Fact,
    circles,
    code_lines,
    docstring,
    each,
    folder,
    imports,
    is_dispatcher,
    own,
    sources,
)
from house_trips import samples, second_names, taken, trips, uncompiled

# --- size --------------------------------------------------------------------------------------------------


def size() -> list[Fact]:
    """Lines, files and the median file; what of it are experiments."""
    lines = {path: text.count("\n") for path, (text, _) in sources().items()}
    papers = sum(n for path, n in lines.items() if folder(path) in EXPERIMENTS)
    studies = sum(p.read_text().count("\n") for p in (ROOT / "studies").rglob("*.py"))
    counts = f"{sum(lines.values())} / {len(lines)} / {statistics.median(lines.values()):.0f}"
    return [
        Fact("lines / files / median lines of a file", counts),
        Fact("of these, papers' experiments and scoreboard inside the wheel", papers, "0"),
        Fact("lines in studies/, moved there, listed apart", studies),
    ]


def code() -> Fact:
    """Lines of code of the package, experiments apart."""
    by: Counter = Counter()
    for path, (text, tree) in own().items():
        by[folder(path)] += code_lines(text, tree)
    return Fact("lines of code: no blanks, comments, docstrings, experiments", by.total(), "<= 37000", dict(by))


def docstrings() -> Fact:
    """Lines of the docstrings of public classes, their public methods, and public functions."""
    found: dict[str, int] = {}
    for path, (_, tree) in own().items():
        for node in (n for n in tree.body if isinstance(n, OWNERS) and not n.name.startswith("_")):
            inner = [n for n in node.body if isinstance(n, ast.FunctionDef) and isinstance(node, ast.ClassDef)]
            for thing, name in [(node, node.name), *((n, f"{node.name}.{n.name}") for n in inner)]:
                if not thing.name.startswith("_") and (said := docstring(thing)):
                    found[f"{path} {name}"] = said.end_lineno - said.lineno + 1
    counts = f"{sum(found.values())} of {len(found)}, {statistics.mean(found.values()):.2f} each"
    return Fact("lines of public docstrings", counts, "not shorter each", found)


# --- imports -----------------------------------------------------------------------------------------------


def floors() -> list[Fact]:
    """Circles, and exceptions in the contract."""
    found = circles(imports())
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    excused = [line for contract in contracts for line in contract.get("ignore_imports", ())]
    return [
        Fact("import circles: modules in each", " + ".join(str(len(c)) for c in found) or "0", "0", found),
        Fact("exceptions in the import contract", len(excused), "0", excused),
    ]


# --- policies and rows -------------------------------------------------------------------------------------


def dispatchers() -> Fact:
    """Dispatchers that mean: the time update, by the memory."""
    names = [node.name for _, node in each(ast.FunctionDef) if is_dispatcher(node)]
    main, alone = ([name for name in names if name in group] for group in (TIME_UPDATES, ALONE))
    counts = f"{len(main)} + {len(alone)}"
    return Fact("dispatchers that mean time update + those of one family", counts, "1 + 0", main + alone)


def naming(names: set[str]) -> list[str]:
    """Return the files that have one of these names in their code, also as a text in a table."""
    found = {path for path, node in each(ast.Name, ast.Attribute, ast.alias, ast.ClassDef, ast.Constant)
             if {getattr(node, field, None) for field in ("id", "attr", "name")} & names
             or (isinstance(getattr(node, "value", None), str) and node.value in names)}  # fmt: skip
    return sorted(found)


def touched() -> Fact:
    """Files that know a memory by name: what adding one touches, and who uses it."""
    files = {names[0]: naming({*names, f"{names[0]}Kernel"}) for names in MEMORIES}
    example = files["ExponentialForgetting"]
    counts = f"{len(example)}; {statistics.median(map(len, files.values())):.0f}"
    return Fact("files that name exponential forgetting; median of all memories", counts, "; <= 2", example)


def hand_rows() -> list[Fact]:
    """State rows, and files of memories, whose numbers are cut by hand: slices of the row a form is opened on."""

    def is_cut(node, names) -> bool:
        return isinstance(node.slice, ast.Slice) and ast.unparse(node.value) in names

    rows = []
    for path, node in each(ast.FunctionDef):
        if [argument.arg for argument in node.args.args] == ["form", "row"]:
            subscripts = [n for n in ast.walk(node) if isinstance(n, ast.Subscript)]
            if any(is_cut(n, {"row"}) for n in subscripts):
                rows.append(f"{path} {node.name}")
    cells = {path for path, node in each(ast.Subscript) if folder(path) == "memory" and is_cut(node, CELLS)}
    return [
        Fact("state rows cut by hand", len(rows), "0", rows),
        Fact("memories' files that cut their numbers by hand", len(cells), "0", sorted(cells)),
    ]


# --- what says the same ------------------------------------------------------------------------------------


def runners() -> list[Fact]:
    """Classes that define both `update` and `scan` themselves, but protocols; classes of traces and their bases."""
    found, kinds = [], {}
    for path, node in each(ast.ClassDef):
        bases = {ast.unparse(base) for base in node.bases}
        if {getattr(n, "name", "") for n in node.body} >= {"update", "scan"} and "Protocol" not in bases:
            found.append(f"{path} {node.name}")
        if re.fullmatch(r"\w*Trace(MIMO)?", node.name):
            kinds[node.name] = bases, node.end_lineno - node.lineno + 1
    base = [name for name, (bases, _) in kinds.items() if not bases & kinds.keys()]
    counts = f"{len(kinds)}, {sum(n for _, n in kinds.values())}"
    return [
        Fact("runner sets: classes with update and scan of their own", len(found), "1", found),
        Fact("trace classes, their lines", counts, "", {name: n for name, (_, n) in kinds.items()}),
        Fact("base traces", len(base), "1", base),
    ]


def twins() -> Fact:
    """Modules that say for several outputs what another says for one; recursions of their own are none."""
    found = {}
    for path, (text, _) in own().items():
        file = Path(path)
        is_again = file.parent.name.endswith("mimo") and file.stem in SHARED
        if "mimo" in file.stem or file.stem in ("noise_many", "equations") or is_again:
            found[path] = text.count("\n")
    return Fact("one-output / several-output twin modules, lines", f"{len(found)}, {sum(found.values())}", "0", found)


def asked() -> Fact:
    """Questions about the kind of an estimator, or of what it holds, above the floor of estimators."""
    found: dict[str, list[str]] = {"hasattr": [], "getattr": [], "isinstance": []}
    for path, node in each(ast.Call):
        name = ast.unparse(node.func)
        if name in found and folder(path) not in KERNELS | {"estimators"} and node.args:
            if re.search(r"\b_?(est|estimator)\b", ast.unparse(node.args[0])):
                found[name].append(f"{path}:{node.lineno}")
    counts = " + ".join(str(len(places)) for places in found.values())
    return Fact("hasattr + getattr + isinstance of estimators above their floor", counts, "0 + 0 + 0", found)


def words() -> list[Fact]:
    """Functions without a name, and files with a sentence that something jumped (text that is no docstring)."""
    nameless = Counter(path for path, node in each(ast.FunctionDef) if node.name == "_")
    said = {id(docstring(node)) for _, node in each(*OWNERS)}
    jumped = Counter(path for path, node in each(ast.Constant)
                     if isinstance(node.value, str) and id(node) not in said and folder(path) not in KERNELS
                     and re.search(r"\bjumped\b.* | .*\bjumped\b", node.value))  # fmt: skip
    return [
        Fact("functions called _", nameless.total(), "0", dict(nameless)),
        Fact("files that word a jump", len(jumped), "1", dict(jumped)),
    ]


# --- the table ---------------------------------------------------------------------------------------------


def table(facts: list[Fact]) -> str:
    """Return the facts as a markdown table, and below it what they count."""
    lines = ["| fact | number | target |", "|---|---|---|"]
    lines += [f"| {fact.name} | {fact.number} | {fact.target} |" for fact in facts]
    for name, _, _, which in facts:
        if which and name != docstrings().name:
            lines += ["", f"**{name}**", ""]
            lines += [f"- {k}: {v}" for k, v in which.items()] if isinstance(which, dict) else [f"- {w}" for w in which]
    return "\n".join(lines)


def main() -> None:
    """Print the table; with ``--json FILE`` write it there as well, public docstrings one by one."""
    sys.path.insert(0, str(ROOT / "src"))
    facts = [*size(), code(), docstrings(), *floors(), dispatchers(), touched(), *hand_rows(), *runners(), twins(),
             asked(), *words()]  # fmt: skip
    if "--static" not in sys.argv:
        with uncompiled():
            facts += [taken(), second_names(), *samples()]
        facts += trips()
    print(table(facts))
    if "--json" in sys.argv:
        found = json.dumps([fact._asdict() for fact in facts], indent=1)
        Path(sys.argv[sys.argv.index("--json") + 1]).write_text(found + "\n")


if __name__ == "__main__":
    main()
