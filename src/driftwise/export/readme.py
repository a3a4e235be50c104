"""README.md of an export: how to use it, what it takes, how well it keeps to double precision."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from . import single
from .board import BOARDS, GCC, measure
from .host import Library
from .record import record
from .source import Source

MEASURED_ON = 300  # samples that run on a board
TRIED = 2000  # samples on which single precision is compared with double

DEVIATIONS = {  # of MISRA C:2012, by rule, as cppcheck numbers them
    "2.2": "a place 0 is added where the general step has a place",
    "2.5": "the header names all bits of a status, the compiler's macros all compilers",
    "8.9": "tables of constants stand at the top of the file",
    "10.3, 10.4, 10.8": "integers become numbers, truth values are 0 and 1, bits of a number are taken as an integer",
    "11.8": "settings are read through the type of view that the state has, whose pointer is not const",
    "12.1, 12.3": "brackets are those that C needs; sizes of a view are declared together",
    "15.5, 15.7": "a function returns where it is done; a chain of ifs may end without else",
    "17.7, 17.8": "what a call returns may be left; a copy of an argument is worked on",
    "18.4": "a view is a pointer and how far it reaches: part of it begins further on",
    "19.2": "a union shows the bits of a number (sign, exponent)",
    "21.2": "a compiler that has no square root of its own is told of the library's",
}


def readme(source: Source, folder) -> str:
    """Return the text; ``folder`` holds NAME.c and NAME.h and room to compile them."""
    est, name, upper = source.est, source.name, source.name.upper()
    words = {"y": "y", "u": "u", "time": "t"}
    given = ", ".join(words[part.split()[-1].split("[")[0]] for part in source.arguments.split(", "))
    begun = "at its start" if float(source.begun["samples"]) == 0 else f"after {int(source.begun['samples'])} samples"
    asked = f"{name}_parameter(&state, i)" if est.names else f"{name}_x(&state, i)"
    return README.format(
        name=name, what=repr(est), begun=begun, number=source.number, given=given, upper=upper, asked=asked,
        spread=asked.replace("(&", "_std(&"), costs=costs(source, folder), precision=precision(source, folder),
        estimates=", ".join(source.estimates) or "none",
        deviations="\n".join(f"* {rules}: {why}" for rules, why in DEVIATIONS.items()),
        std="" if source.keep == "std" else " (not in this export: `keep=\"std\"`)",
    )  # fmt: skip


def costs(source: Source, folder) -> str:
    """Return a table of bytes and instructions, or how to get one."""
    lines = [f"A state takes {state_bytes(source)} bytes (`sizeof(struct {source.name}_state)`)."]
    if shutil.which(GCC) is None:
        return "\n".join([*lines, "", HOW])
    rows = [measure(source, folder, board, MEASURED_ON).row for board in BOARDS]
    lines += ["", "| controller | code, bytes | state, bytes | stack, bytes | instructions an update | at most |"]
    return "\n".join([*lines, "|---|---|---|---|---|---|", *rows, "", MEASURED.format(samples=MEASURED_ON)])


def state_bytes(source: Source) -> int:
    """Return the size of a state."""
    return (source.start.size + source.columns + source.scratch) * (4 if source.is_single else 8)


def precision(source: Source, folder) -> str:
    """Return what is said of the numbers."""
    if not source.is_single:
        return "Numbers are doubles: the bits are those of driftwise on any machine whose arithmetic is IEEE 754's."
    error = errors(source, folder)
    return (
        f"Numbers are floats. Against the same estimator in double precision, over {TRIED} samples with gaps, outliers "
        f"and a jump: parameters differ by at most {error['estimates']:.1g} of their standard deviation, deviations by "
        f"{error['deviations']:.1g} of themselves, predictions by {error['predictions']:.1g} of the innovation's, and "
        f"the status of {error['status']} samples. Thresholds are those of single precision: an output beyond "
        f"{single.VALUES[1e60]:.0e} counts as absurd, and every output is taken to carry an error of "
        f"{single.SETTINGS['floor']:.0e} of itself.\n\nCounts end at 2^24 = 16.8 million samples: a memory that never "
        "forgets learns the noise no further from there. Take one that forgets, or begin anew now and then."
    )


def errors(source: Source, folder) -> dict[str, float]:
    """Return how far single precision is from double on the same samples, relative to deviations."""
    est, samples = source.est, record(source.est, source.begun, TRIED).astype(np.float32).astype(float)
    exact = Source(est, source.begun, f"{source.name}_double")
    for file, text in ((f"{exact.name}.c", exact.source()), (f"{exact.name}.h", exact.header())):
        (Path(folder) / file).write_text(text)
    a, b = Library(source, folder).run(samples).astype(float), Library(exact, folder).run(samples)
    N, first, (m, M) = len(source.estimates), est.n_columns, (a.shape[1], b.shape[1])
    at = {name: place.start for name, place in est.columns.items()}
    differ = int((a[:, at["status"]] != b[:, at["status"]]).sum())
    with np.errstate(invalid="ignore"):
        off = np.where(a == b[:, :m], 0.0, abs(a - b[:, :m]))[10 * N :]
    b = b[10 * N :]  # before, nothing is known
    spread = b[:, first + N : M]
    found = {
        "estimates": off[:, first : first + N] / spread,
        "deviations": off[:, first + N :] / spread[:, : m - first - N],
        "predictions": off[:, at["prediction"]] / np.sqrt(b[:, at["variance"]]),
    }
    return {name: float(np.max(value, initial=0.0)) for name, value in found.items()} | {"status": differ}


HOW = """\
Code, stack and instructions are written here where GCC for Arm and QEMU are installed (Debian: `apt-get install
gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm`). With another compiler: its map file for the code,
`-fstack-usage` or a painted stack for the stack, and the cycle counter of your controller around an update."""

MEASURED = """\
Built by GCC with `-std=c99 -O2 -fno-math-errno`; constants count as code. The stack is that of an update and all it
calls (GCC's graph of calls), without the compiler's own library of soft floating point. Instructions are QEMU's, mean
and largest of {samples} samples with gaps and outliers: not cycles."""

README = """\
# {name}

`{what}`, {begun}, exported by driftwise: `{name}.c` and `{name}.h`. Nothing is allocated, nothing is printed, no
variable but constants lives outside `struct {name}_state`; several may run side by side, and a copy is a snapshot.

```c
#include "{name}.h"

static struct {name}_state state;

{name}_init(&state);                                  /* once */
uint32_t status = {name}_update(&state, {given});     /* every sample; NaN: missing */
if (status & {upper}_JUMP) {{ .. }}
{number} value = {asked}, spread = {spread};
{number} expected = {name}_prediction(&state), its_variance = {name}_variance(&state);
```

To ask for (by number, `{name}.h` has names): {estimates}. Deviations are one standard deviation{std}; 95 % bands are
twice that where the noise is known or many samples are behind it. What is expected of the *next* sample: copy the
state, update the copy with y = NaN, and ask it. y and u are those that the estimator was tried on: a mean that was
subtracted there is subtracted here.

Compile with `-std=c99` (or `-ffp-contract=off`), and without `-ffast-math`: a product fused with a sum has other last
bits. No function is needed but a square root where the processor has none (`-lm`), and what compilers call by
themselves (`memcpy`, `memset`). `test_{name}.c` holds recorded samples and the bits that must come out:
`cc -std=c99 -O2 test_{name}.c {name}.c -lm && ./a.out` says OK, on your controller too. In a sketch for Arduino put
all but the test beside it and include `{name}.h`.

## What it takes

{costs}

## Numbers

{precision}

## MISRA C:2012

No dynamic memory, no recursion, no `goto`, integers of fixed width. What `cppcheck --addon=misra` finds is meant:

{deviations}
"""
