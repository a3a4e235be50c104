"""Plants in formulas that nobody should write: words that execute elsewhere, sizes, depths, numbers, names."""

from __future__ import annotations

import ast

from driftwise.models import formula_kernels, formulas
from driftwise.models.derivatives import FUNCTIONS

HONEST = """\
[states]
a = {std = 1}
[inputs]
u = {}
[outputs]
y = {}
[parameters]
p = {start = 2}
[tables]
curve = {x = [0, 1, 3], y = [1, 4, 5]}
[formulas]
da = "-p * a + u"
y = "curve(a) * p"
"""
EXECUTING = [
    "__import__('os').system('touch pwned')", "().__class__.__base__.__subclasses__()", "open('/etc/passwd')",
    "(lambda: a)()", "[a for a in (1,)][0]", "f'{a}'", "(a := 1)", "a.real", "a[0]", "eval('a')", "exec('a')",
    "math.__dict__", "np.load('x')", "numpy.exp.__globals__", "print(a)", "exp(*[a])", "exp(x=a)", "'a' * 9",
    "a if a else p", "a and p", "not a", "a == p", "a < p < u", "1j * a", "yield a", "await a", "...", "None", "True",
    "a; p", "a\n p", "plant", "theta", "t1", "values", "x_0", "divided(a, 0)", "root(a)", "table_value(a)",
    "plant.points", "slopes", "x[9]", "lambda", "\u2028a", "a#", "\\", "a\x00", "exp", "curve", "curve(curve)",
]  # fmt: skip
SIZES = [
    "(" * 150 + "a" + ")" * 150, "(" * 9000 + "a" + ")" * 9000, "-" * 5000 + "a", "+".join(["a"] * 3000),
    "*".join(["a*u"] * 400), "exp(" * 90 + "a" + ")" * 90, "a" + " if a < p else a" * 300, "9" * 5000 + " * a",
    "1e999 * a", "a ** 1e999", "a ** 10 ** 9", "2 ** 2 ** 2 ** 2 ** 9 * a", "a ** -400", "a ** 16 ** 16", "0 ** a",
    "a / 0", "a / (1 - 1)", "log(-1) * a", "a ** 0.5 ** 1e-9", "1e-400 * a", "a" * 100_000, "a" + " " * 100_000,
    "0x" + "f" * 3000 + " * a", "1_0 * a", "min(" * 60 + "a" + ", u)" * 60,
]  # fmt: skip
NAMES = [
    "lambda", "__class__", "__import__", "exec", "x", "\u00b5", "\ufb01", "\u212b", "\U0001d51e", "a b", "", "1a",
    "da", "exp", "pi", "t", "a" * 10_000, "\u202epmup", "plant", "u", "None", "\u0430", "_", "print",
]  # fmt: skip
LINES = [
    "a = 5", "a = {std = inf}", "a = {std = nan}", "a = {std = -1}", "a = {std = true}", "a = {std = '1'}",
    "a = {std = 1" + "0" * 400 + "}", "a = {std = 1, start = 1e308}", "a = {std = 1, walk = inf}",
    "a = {std = 1e-320}", "a = {std = 1, unit = 5}", "a = {std = 1, unit = ['m']}", "a = {std = 1, about = {}}",
    "a = {std = 1, unit = '" + "m" * 9999 + "^99999999'}", "a = {std = 1, unit = 'm^1e9'}", "a = [1]", "a = {}",
]  # fmt: skip
TABLES = [
    "x = '123', y = '456'", "x = 1, y = 2", "x = [], y = []", "x = [0, inf], y = [0, 1]", "x = [0, 1], y = [0, nan]",
    "x = [0, 1" + "0" * 400 + "], y = [0, 1]", "x = [0, 1e-320], y = [0, 1e308]", "x = [true, 2], y = [1, 2]",
    "x = ['0', '1'], y = [1, 2]", "x = [[0], [1]], y = [1, 2]", f"x = {list(range(200_000))}, y = {[0] * 200_000}",
]  # fmt: skip
WHOLE = [
    "states = 5\n" + HONEST.split("[inputs]")[1], "tables = 5\n" + HONEST.replace("[tables]\n", "[inputs.v]\n"),
    HONEST.replace("[formulas]", "[[formulas]]"), "a = " + "[" * 5000, "a = " + "{b=" * 5000,
    "\n[" + "a." * 5000 + "a]",
    "name = [1]\n" + HONEST, "time = 'never'\n" + HONEST, "\n\0", "\n", "\ufeff" + HONEST, HONEST.replace("\n", "\r\n"),
    HONEST.replace("[inputs]", "".join(f"s{i} = {{std = 1}}\n" for i in range(3000)) + "[inputs]"),
    HONEST.replace("[outputs]", "".join(f"v{i} = {{}}\n" for i in range(5000)) + "[outputs]"),
    HONEST + "".join(f'w{i} = "exp(a) * {i}"\n' for i in range(20_000)),
    HONEST + "".join(f'w{i} = "w{i - 1} * w{i - 1}"\n' if i else 'w0 = "a * u * p"\n' for i in range(900)),
]  # fmt: skip


def written() -> dict[str, str]:
    """Return plants by what is odd about them."""
    found = {f"formula {text[:30]!r}": HONEST.replace("-p * a + u", _escaped(text)) for text in EXECUTING + SIZES}
    for name in NAMES:
        found[f"name {name[:20]!r}"] = HONEST.replace("p = {", f'"{name}" = {{').replace("-p", f"-{name}")
    found |= {f"state {line[:30]!r}": HONEST.replace("a = {std = 1}", line) for line in LINES}
    found |= {f"table {line[:30]!r}": HONEST.replace("x = [0, 1, 3], y = [1, 4, 5]", line) for line in TABLES}
    return found | {f"plant {number}": text for number, text in enumerate(WHOLE)}


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\x00", "\\u0000")


def take(text: str) -> formulas.Formulas:
    """Read a plant, and see that what would be compiled of it is arithmetic."""
    plant = formulas.read(text if "\n" in text else text + "\n")
    for which in ("states", "outputs"):
        if strange := _strange(formula_kernels._source(plant, which)):
            raise AssertionError(f"compiled: {strange}")
    return plant


NODES = (
    ast.Module, ast.FunctionDef, ast.arguments, ast.arg, ast.Assign, ast.Name, ast.Load, ast.Store, ast.Constant,
    ast.BinOp, ast.UnaryOp, ast.USub, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.IfExp, ast.Compare, ast.Lt, ast.LtE,
    ast.Gt, ast.GtE, ast.Call, ast.Subscript, ast.Tuple, ast.Attribute,
)  # fmt: skip
CALLED = {*FUNCTIONS, "pow", "divided", "root", "signum", "hyperbolic_tangent", "table_value", "table_slope"}


def _strange(source: str) -> str:
    """Return what of a source is no arithmetic on its own arguments."""
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, NODES):
            return ast.dump(node)[:200]
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") not in CALLED:
            return ast.unparse(node)[:200]
        if isinstance(node, ast.Attribute) and ast.unparse(node) not in ("plant.constants", "plant.points"):
            return ast.unparse(node)[:200]
        if isinstance(node, ast.Constant) and not isinstance(node.value, int | float):
            return ast.unparse(node)[:200]
    return ""
