"""NAME_test.st and README.md beside NAME.st: recorded samples with what must come out, and what one must know."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..engine.translate.st_statements import Comment, Set, Test, folded, lines
from ..engine.translate.st_values import literal
from ..engine.translate.structured_text import Section, array_type
from ..engine.translate.types import BOOL, FLOAT
from .record import answers, record
from .structured_text import FunctionBlock


def files(est, state, name: str, keep: str) -> dict[str, str]:
    """Return the texts of NAME.st, NAME_test.st and README.md."""
    block = FunctionBlock(est, state, name, keep)
    start = est.start() if state is None else np.asarray(state)
    samples = record(est, start)
    found = "\n".join([*test(block, samples, answers(est, start, keep, samples)), ""])
    return {f"{name}.st": block.text, f"{name}_test.st": found, "README.md": readme(block)}


def test(block: Any, samples: np.ndarray, expected: np.ndarray) -> Iterator[str]:
    """Yield the lines of the test block: one sample a call, and every number compared."""
    T, k, name = len(samples), block.k, block.name
    columns = [i for i in range(expected.shape[1]) if np.isfinite(expected[:, i]).all()]
    labels = [block.output_text(i) for i in columns]
    y, u, C = samples[:, 0], samples[:, 1 : 1 + k].ravel(), len(columns)
    yield from lines([Comment(f"{name}_test: {T} samples, one a call; no differences means that all bits are right.")])
    yield f"FUNCTION_BLOCK {name}_test"
    done = [("done", "BOOL", "all samples taken"), ("differences", "DINT", "numbers that are not as expected")]
    yield from Section("VAR_OUTPUT", [*done, ("first", "DINT := -1", "the first sample with one")])
    own = [("estimator", name, ""), ("k", "DINT := 0", ""), ("before", "DINT", "")]
    for title, numbers in (("y", y), ("u", u)):
        if len(numbers):
            bits = [literal(BOOL, not np.isnan(v)) for v in numbers]
            own.append((f"{title}_record", array_type(len(numbers), values=np.nan_to_num(numbers)), ""))
            own.append((f"{title}_measured", f"ARRAY[0..{len(bits) - 1}] OF BOOL := [{', '.join(bits)}]", ""))
    own += [("u_now", array_type(k), ""), ("u_is_measured", array_type(k, "BOOL"), "")] * (k > 1)
    own.append(("expected", array_type(T * C, values=expected[:, columns].ravel()), ""))
    yield from Section("VAR", own)
    yield f"IF k < {T} THEN"
    given = ["reset := k = 0", "y := y_record[k]", "y_valid := y_measured[k]"]
    if k == 1:
        given += ["u := u_record[k]", "u_valid := u_measured[k]"]
    for i in range(k if k > 1 else 0):
        at = f"[k * {k} + {i}]"
        yield from lines([Set(f"u_now[{i}]", f"u_record{at}"), Set(f"u_is_measured[{i}]", f"u_measured{at}")], "    ")
    given += ["u := u_now", "u_valid := u_is_measured"] * (k > 1)
    yield from folded(f"    estimator({', '.join(given)});")
    body: list[Any] = [Set("before", "differences")]
    for i, label in enumerate(labels):
        wrong = [Set("differences", "differences + 1")]
        body.append(Test(f"{label} <> expected[k * {C} + {i}]", wrong))
    body.append(Test("(differences > before) AND (before = 0)", [Set("first", "k")]))
    yield from lines([*body, Set("k", "k + 1")], "    ")
    yield "END_IF;"
    yield f"done := k >= {T};"
    yield "END_FUNCTION_BLOCK"


def readme(block: Any) -> str:
    """Return README.md."""
    arrays = sum(array.size for array in (*block.row.arrays, *block.buffer.arrays, *block.out.arrays))
    return README.format(
        name=block.name, what=repr(block.est), estimates=", ".join([*block.est.state_names, *block.est.names]),
        lines=block.text.count("\n"), kept=block.row.size, numbers=arrays, u=", u := valve" * bool(block.k),
        largest=literal(FLOAT, 1e308),
    )  # fmt: skip


README = """\
# {name}: Structured Text (IEC 61131-3)
`{what}` as a FUNCTION_BLOCK, written by driftwise. Its estimates: {estimates}.

| file | is |
|---|---|
| `{name}.st` | the block and the functions it calls, {lines} lines |
| `{name}_test.st` | a block that feeds it recorded samples, one a call, and counts what is not as expected |

```
VAR
    estimator : {name};
END_VAR
estimator(y := pressure, y_valid := sensor_is_well{u});
IF estimator.has_jumped THEN (* something has changed *) END_IF;
```

* **One call per sample**, in a task of fixed period. A sample that is missing is `y_valid := FALSE`; call the block all
  the same: time goes on. `reset := TRUE` begins anew, with the sample of that call.
* The {kept} numbers of the state are `RETAIN`; with scratch the block takes about {numbers} LREAL (8 bytes each).
* **LREAL must be a double of IEEE 754** (rounded to nearest, no fused multiply-add, subnormal numbers kept). Then every
  number is driftwise's, bit for bit.
* **No trap on overflow or on invalid operations.** There are no literals for infinity and not-a-number, so the block
  makes them: `INFINITE := {largest}`, times 10; `NOT_A_NUMBER := INFINITE - INFINITE`. They mark a missing sample and a
  limit that there is not. `x <> x` must be TRUE of not-a-number and any other comparison with it FALSE. It divides by
  zero nowhere on purpose. A controller that stops on such things must be told not to.
* `innovation` is not-a-number where y is missing (`is_missing`), and `dof` infinite where the noise is known: look at
  the flag before such a number goes to a screen or a bus.
* AND and OR may evaluate both sides; loops count within the arrays; nothing is allocated, no pointers, no methods.
* CODESYS, TwinCAT: paste declaration and body of each unit. OpenPLC, Beremiz: as it is. Siemens TIA: import as an
  external source, for a controller that knows LREAL (it may want the names of blocks in double quotes).
* **Run `{name}_test` on the controller once**: `done` and `differences = 0` say that its arithmetic is as wanted.
"""
