"""The tree of the package as `scripts/house.py` reads it: files, their syntax, what is defined where."""

from __future__ import annotations

import ast
import functools
import importlib
import io
import itertools
import tokenize
from pathlib import Path
from typing import Any, NamedTuple

from driftwise.engine.translate.bodies import parsed

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


@functools.cache
def sources(root: Path = PACKAGE) -> dict[str, tuple[str, ast.Module]]:
    """Return text and syntax of every file, by its path inside the package."""
    paths = sorted(root.rglob("*.py"))
    return {p.relative_to(root).as_posix(): (text := p.read_text(), parsed(text)) for p in paths}


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
