"""What exported estimators take on two controllers, and how far single precision is from double: prints two tables.

    python scripts/controllers.py [--write docs/export.md]

Needs gcc, GCC for Arm and QEMU (`make services`). ``--write`` puts the tables between the marks of that page.
"""

import re
import sys
import tempfile
from pathlib import Path

import driftwise as dw
from driftwise.export.board import BOARDS, measure
from driftwise.export.folder import source_of
from driftwise.export.readme import TRIED, errors

SAMPLES = 2000
TAKEN = {
    "`ARX(2, 2)`": dw.ARX(2, 2),
    "`ARX(2, 2, memory=ExponentialForgetting(0.99))`": dw.ARX(2, 2, memory=dw.ExponentialForgetting(0.99)),
    "`ARX(2, 2, memory=RestartOnChange())`": dw.ARX(2, 2, memory=dw.RestartOnChange()),
    "`ARX(2, 2, memory=AutoMemory())`": dw.ARX(2, 2, memory=dw.AutoMemory()),
    "`Joint(2)`": dw.Joint(2),
    "`Joint(2, 1)`": dw.Joint(2, 1),
}
SINGLE = {
    "`Constant()`": dw.Constant(),
    "`ExponentialForgetting(0.97)`": dw.ExponentialForgetting(0.97),
    "`GainFloor(40)`": dw.memory.GainFloor(40),
    "`VariableForgetting(50)`": dw.memory.VariableForgetting(50),
    "`DirectionalForgetting(0.95)`": dw.memory.DirectionalForgetting(0.95),
    "`RandomWalk(1e-4)`": dw.RandomWalk(1e-4),
    "`RestartOnChange()`": dw.RestartOnChange(),
}


def source(est, folder, is_single):
    """Return an estimator's C, written into a folder."""
    found = source_of(est, est.start(), "tried", is_single=is_single)
    (folder / "tried.c").write_text(found.source())
    (folder / "tried.h").write_text(found.header())
    return found


def taken():
    """Yield the lines of the table of costs."""
    yield "| estimator | controller | code, bytes | state, bytes | stack, bytes | instructions an update | at most |"
    yield "|---|---|---|---|---|---|---|"
    for name, est in TAKEN.items():
        for is_single in (False, True):
            for board in BOARDS:
                if is_single and (est.is_automatic or "M7" in board.title):
                    continue
                with tempfile.TemporaryDirectory() as folder:
                    cost = measure(source(est, Path(folder), is_single), folder, board, SAMPLES)
                yield f"| {name}{', float' if is_single else ''} {cost.row}"


def single():
    """Yield the lines of the table of errors."""
    yield f"| memory of `ARX(2, 2)` | parameters | deviations | predictions | other status, of {TRIED} |"
    yield "|---|---|---|---|---|"
    for name, est in {
        **{name: dw.ARX(2, 2, memory=memory) for name, memory in SINGLE.items()},
        "`Joint(2, 1)`": dw.Joint(2, 1),
        "`ARMAX(2, 2, 1)`": dw.ARMAX(2, 2, 1),
    }.items():
        with tempfile.TemporaryDirectory() as folder:
            found = errors(source(est, Path(folder), True), folder)
        errs = " | ".join(f"{found[key]:.0e}" for key in ("estimates", "deviations", "predictions"))
        yield f"| {name} | {errs} | {found['status']} |"


def main() -> None:
    """Print the tables, or write them into a page."""
    tables = {"taken": "\n".join(taken()), "single": "\n".join(single())}
    print("\n\n".join(tables.values()))
    if "--write" in sys.argv:
        page = Path(sys.argv[sys.argv.index("--write") + 1])
        text = page.read_text()
        for name, table in tables.items():
            mark, end = f"<!-- {name}: scripts/controllers.py -->", f"<!-- end of {name} -->"
            text = re.sub(f"{mark}.*?{end}", f"{mark}\n{table}\n{end}", text, flags=re.S)
        page.write_text(text)


if __name__ == "__main__":
    main()
