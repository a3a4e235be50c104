"""Write docs/constants.txt: every number that was chosen, of all that decides what is answered, a line each.

python scripts/constants.py            # rewrites it
python scripts/constants.py --check    # exit code 1 where the code has other numbers

The history of the file is that of the choices: `git log -p docs/constants.txt`. Numbers that name places in a state or
kinds are no choices, and are left out; so are the names and units of the vocabulary.
"""

import ast
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
SOURCE, PAGE = ROOT / "src" / "driftwise", ROOT / "docs" / "constants.txt"
DECIDE = "analysis", "detect", "estimators", "memory", "models", "tables", "tracking"
HEAD = "Numbers that were chosen, from src/driftwise; written by scripts/constants.py\n"


def counts(names: list[str], value: ast.expr) -> bool:
    """Return whether names are given successive whole numbers: places, or kinds."""
    parts = value.elts if isinstance(value, ast.Tuple) else [value]
    whole = [n.value for n in parts if isinstance(n, ast.Constant) and type(n.value) is int]
    ranged = isinstance(value, ast.Call) and ast.unparse(value.func) == "range"
    return len(names) > 1 and (ranged or (len(whole) > 1 and whole == [*range(whole[0], whole[0] + len(whole))]))


def chosen(module: ast.Module) -> list[str]:
    """Return the lines of a module that give names to chosen numbers."""
    lines = []
    for node in module.body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        names = [n.id for target in targets for n in ast.walk(target) if isinstance(n, ast.Name)]
        kinds = {type(n.value) for n in ast.walk(node.value) if isinstance(n, ast.Constant)}
        is_number = bool(kinds & {int, float}) and str not in kinds
        if is_number and all(name.isupper() for name in names) and not counts(names, node.value):
            lines.append(f"{', '.join(names)} = {ast.unparse(node.value)}")
    return lines


def page() -> str:
    """Return the page as the code has it now."""
    parts = [HEAD]
    for part in DECIDE:
        for path in sorted((SOURCE / part).rglob("*.py")):
            if lines := chosen(ast.parse(path.read_text(encoding="utf-8"))):
                parts.append(
                    "\n".join([path.relative_to(SOURCE).as_posix(), *(f"    {line}" for line in lines)]) + "\n"
                )
    return "\n".join(parts)


if __name__ == "__main__":
    if "--check" in sys.argv:
        sys.exit(PAGE.read_text(encoding="utf-8") != page() and f"{PAGE.name} is old: python scripts/constants.py")
    PAGE.write_text(page(), encoding="utf-8")
