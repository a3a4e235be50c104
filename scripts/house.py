"""Print what the package is made of, measured: lines, circles, twins, time updates, moves between files.

Run: python scripts/house.py [--json FILE] [--static] (half a minute; --static leaves out what has to run, the trips).

Things are found by what they are (a class with `update` and `scan`, slices of the row of a form), by name only where
nothing else tells them; then the old name and the new one count alike, so that two states of the code compare.

How the moves of a trip are counted: every call of a named function of the package is written down with its file, in
order; a move is a call into another file than the call before it (returns, lambdas, comprehensions and bodies of
modules do not count). The trip is taken warm. One sample is followed into its kernels, uncompiled; in `driftwise run`
and in a fleet the loop over samples counts as one step, as it is there, compiled.
"""

from __future__ import annotations

import ast
import contextlib
import functools
import importlib
import io
import itertools
import json
import os
import re
import statistics
import sys
import tempfile
import tokenize
import tomllib
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "src" / "driftwise"

EXPERIMENTS = {"reproduce", "scoreboard"}  # papers and scores, where they are not a distribution of their own
KERNELS = {"kernel", "engine", "models", "detect", "memory"}
TIME_UPDATES = {"drift", "age", "drift_over", "time_update"}
ALONE = {"share", "reopen"}  # what families answer alone, each for its memories
ANSWERS = TIME_UPDATES | {"learn", "adapt", "respond", "on_alarm"}
CELLS = {"cells", "own", "memory_state"}  # the numbers that a memory keeps
SHARED = {"reading", "door", "base", "validation", "observing"}  # what all estimators have in common
TAKERS: dict[str, tuple] = {"Joint": (2, 1), "JointMIMO": ((2, 1), 1), "ContinuousJoint": (2, 1), "AdaptiveGain": ()}
MEMORIES: dict[tuple[str, ...], tuple] = {  # all names of each, and plain settings
    ("Constant", "Never"): (), ("RandomWalk", "Walk"): (1e-4,), ("Drift",): (1.0, 1e-4), ("AutoMemory", "Auto"): (),
    ("MultipleModel", "Bank"): (), ("IMM", "Interacting"): (), ("FuzzyDrift",): (), ("CovarianceMatching",): (),
    ("AuxiliaryFilter",): (), ("AutocovarianceLS", "Correlation"): (), ("LikelihoodDrift",): (),
    ("VariationalBayes",): (), ("RestartOnChange", "UntilJump"): (), ("GainFloor", "LimitedGain"): (100,),
    ("ExponentialForgetting", "Weighted", "Fade"): (0.99,), ("VariableForgetting",): (100,),
    ("DirectionalForgetting",): (0.99,), ("Window",): (50,), ("BayesianChangePoint", "RunLengths"): (1.0, 500),
}  # fmt: skip


class Fact(NamedTuple):
    """One row of the table, and what it counts, one by one."""

    name: str
    number: Any
    target: str = ""
    which: Any = ()


# --- reading the tree --------------------------------------------------------------------------------------


@functools.cache
def sources(root: Path = PACKAGE) -> dict[str, tuple[str, ast.Module]]:
    """Return text and syntax of every file, by its path inside the package."""
    paths = sorted(root.rglob("*.py"))
    return {p.relative_to(root).as_posix(): (text := p.read_text(), ast.parse(text)) for p in paths}


def own() -> dict[str, tuple[str, ast.Module]]:
    """Return the files without papers and scores."""
    return {path: both for path, both in sources().items() if folder(path) not in EXPERIMENTS}


def folder(path: str) -> str:
    """Return the first folder of a path, or its name at the top."""
    return path.split("/")[0]


@functools.cache
def each(*kinds: type) -> list[tuple[str, Any]]:
    """Return (path, node) of every node of these kinds."""
    return [(path, node) for path, (_, tree) in own().items() for node in ast.walk(tree) if isinstance(node, kinds)]


def docstring(node) -> Any:
    """Return the docstring of a module, class or function as it stands, if it has one."""
    first = node.body[0] if node.body else None
    value = first.value if isinstance(first, ast.Expr) else None
    return value if isinstance(value, ast.Constant) and isinstance(value.value, str) else None


OWNERS = ast.Module, ast.ClassDef, ast.FunctionDef


def is_dispatcher(node) -> bool:
    """Say whether a function chooses by the type of its first argument."""
    return any(ast.unparse(d) in ("choice", "dispatch", "question") for d in node.decorator_list)


def load(*names: str) -> Any:
    """Return what the package defines at the top of a file under the first of these names that there is."""
    files = sorted(own().items(), key=lambda item: folder(item[0]) not in KERNELS)  # a drift of live is no memory
    for name, (path, (_, tree)) in itertools.product(names, files):
        is_tree = "translate" in Path(path).parts  # a kernel's parts, which have names like those of memories
        if not is_tree and any(isinstance(node, OWNERS) and node.name == name for node in tree.body):
            return getattr(importlib.import_module(dotted(path)), name)
    raise LookupError(f"{PACKAGE} has no {' or '.join(names)}")


def dotted(path: str) -> str:
    """Return a module's name."""
    return ".".join([PACKAGE.name, *Path(path).with_suffix("").parts]).removesuffix(".__init__")


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


IDLE = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}


def code_lines(text: str, tree) -> int:
    """Return how many lines hold code: no blank, no comment, no docstring."""
    found: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in IDLE:
            found.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(tree):
        if isinstance(node, OWNERS) and (said := docstring(node)):
            found -= set(range(said.lineno, said.end_lineno + 1))
    return len(found)


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


def imports(root: Path = PACKAGE) -> dict[str, set[str]]:
    """Return which modules each module imports, also inside functions and through a lazy ``__init__``.

    The table of verbs (``results/verbs.py``) is left out: that the upper floors fill it is its purpose.
    """
    modules = {dotted(path): path for path in sources(root) if path != "results/verbs.py"}
    return {name: set(_imported(name, path, modules, root)) - {name} for name, path in modules.items()}


def _imported(name, path, modules, root):
    package = name.split(".") if path.endswith("__init__.py") else name.split(".")[:-1]
    for node in ast.walk(sources(root)[path][1]):
        if isinstance(node, ast.Import):
            yield from {alias.name for alias in node.names} & modules.keys()
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            for alias in node.names:
                found = {f"{base}.{alias.name}", _handed_on(base, alias.name, modules, root)}
                yield from found & modules.keys() or {base} & modules.keys()


def _handed_on(base, name, modules, root) -> str:
    """Return the module that a lazy package takes a name from: its ``_HOME`` says so."""
    for node in sources(root)[modules[base]][1].body if base in modules else ():
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "_HOME":
            return f"{base}.{ast.literal_eval(node.value).get(name, '')}"
    return ""


def circles(edges: dict[str, set[str]]) -> list[list[str]]:
    """Return the groups of modules that import each other, the largest first (Tarjan's strong components)."""
    number: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(v):
        number[v] = low[v] = len(number)
        stack.append(v)
        for w in sorted(edges[v] & edges.keys()):
            if w not in number:
                visit(w)
            if w in stack:
                low[v] = min(low[v], low[w])
        if low[v] == number[v]:
            at = stack.index(v)
            found.append(sorted(stack[at:]))
            del stack[at:]

    for v in edges:
        if v not in number:
            visit(v)
    return sorted((group for group in found if len(group) > 1), key=len, reverse=True)


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


# --- what has to run: policies taken, and trips ------------------------------------------------------------


@contextlib.contextmanager
def uncompiled():
    """Let every loop that is asked for meanwhile be the plain function that would have been compiled."""
    loops: Any = sys.modules[load("plain_driver").__module__]
    held, before = [loops.driver, loops.passage, loops.function], os.environ.get("DRIFTWISE_ENGINE", "c")
    for engine in ("python", before):
        for each_kind in held:
            each_kind.cache_clear()
        os.environ["DRIFTWISE_ENGINE"] = engine
        if engine == "python":
            yield


def taken() -> Fact:
    """How many memories each family takes: it is made with them, and takes three samples."""
    found: dict[str, list[str]] = {name: [] for name in TAKERS}
    for (name, settings), (names, numbers) in itertools.product(TAKERS.items(), MEMORIES.items()):
        memory = load(*names)(*numbers)
        with contextlib.suppress(ValueError, TypeError, KeyError):
            est = load(name)(*settings, memory=memory)
            one, u = [1.0, 0.5] if name == "JointMIMO" else 1.0, 0.5 if est.model.inputs else None
            state = est.start()
            for _ in range(3):
                state, _step = est.update(state, one, u)
            found[name].append(type(memory).__name__)
    counts = ", ".join(str(len(names)) for names in found.values())
    return Fact(f"memories that {', '.join(TAKERS)} take, of {len(MEMORIES)}", counts, "", found)


def second_names() -> Fact:
    """Types of kernels that are no public memory: what the tables of the memories' functions hold besides."""
    public = set(itertools.chain(*MEMORIES)) - {"Fade"}
    answers = [(path, n.name) for path, n in each(ast.FunctionDef) if is_dispatcher(n) and n.name in ANSWERS]
    tables = [getattr(importlib.import_module(dotted(path)), name).table for path, name in answers]
    found = {kind.__name__ for kind in itertools.chain(*tables)} - public
    odd = sorted(name for name in found if not name.endswith("Kernel"))
    counts = f"{len(odd)}; {len(found) - len(odd)}"
    return Fact("second names of memories; types that kernels see, called <Public>Kernel", counts, "0;", odd)


def moves(trip) -> list[tuple[str, str]]:
    """Return the moves between files of a trip, the second time."""
    trip()
    files: list[str] = []

    def look(frame, event, argument):
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(str(PACKAGE)) and not code.co_name.startswith("<"):
            files.append(code.co_filename)

    sys.setprofile(look)
    try:
        trip()
    finally:
        sys.setprofile(None)
    return [(a, b) for a, b in itertools.pairwise(files) if a != b]


def one(est, sample):
    """Return the trip of one more sample through `update`, after forty."""
    state = est.start()
    for i in range(40):
        state, _ = est.update(state, *sample(i))
    return lambda: est.update(state, *sample(40))


def report() -> None:
    """`driftwise run` of the flight that comes along, with a report, without a named clock."""
    entry = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]["driftwise"]
    module, name = entry.split(":")
    with tempfile.TemporaryDirectory() as out, contextlib.redirect_stdout(io.StringIO()):
        file, before = str(PACKAGE / "data" / "flight.csv"), sys.argv
        sys.argv = ["driftwise", "run", file, "--output", "ground_speed_mps", "--report", f"{out}/report.html"]
        try:
            getattr(importlib.import_module(module), name)()
        except SystemExit as done:
            if done.code:
                raise
        finally:
            sys.argv = before


def samples() -> list[Fact]:
    """Moves between files of one sample, followed into its kernels."""
    y, u = [0.3, 1.2, -0.7, 0.4, 1.0], [0.5, -1.0, 0.2]
    plots, sample = (lambda i: (4.0 * i, [200.0 * i, 9.0 * i])), (lambda i: (y[i % 5], u[i % 3]))
    joint, auto = load("Joint")(2, 1), load("ARX")(2, 2, memory=load("AutoMemory", "Auto")())
    what = "moves between files: "
    return [
        Fact(what + "one Joint.update", len(moves(one(joint, sample))), "<= 14"),
        Fact(what + "one sample of ARX with AutoMemory", len(moves(one(auto, sample)))),
        Fact(what + "one TrackEstimator.update", len(moves(one(load("TrackEstimator")(), plots)))),
    ]


def trips() -> list[Fact]:
    """Moves between files of a run with a report, and of a sample of a fleet; loops are compiled, one step each."""
    pair = load("Fleet")(load("ARX")(2, 2), ["a"])
    step = pair.update_batch
    what, opened = "moves between files: ", []
    sys.addaudithook(lambda event, given: opened.append(str(given[0])) if event == "open" else None)
    report()
    times = sum(file.endswith("flight.csv") for file in opened)
    ways = moves(report)
    return [
        Fact("times that driftwise run opens FILE, without a named clock", times, "1"),
        Fact(what + "driftwise run FILE --report, loops as one step", len(ways), "<= 500"),
        Fact(what + "the same, each counted once however often a search makes it", len(set(ways))),
        Fact(what + "one sample of a fleet, loops as one step", len(moves(lambda: step(None, [1.0], [0.5]))), "5"),
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
