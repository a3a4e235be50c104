"""NAME.st: an estimator as a FUNCTION_BLOCK of Structured Text (IEC 61131-3), for controllers in plants."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..engine import validation
from ..engine.dispatch import advance, flatten, open_row, open_scratch, read_all
from ..engine.errors import InputError
from ..engine.layout import layout_of
from ..engine.status import MEANING
from ..engine.translate.frame import Frame
from ..engine.translate.program import Program
from ..engine.translate.refusal import Refusal
from ..engine.translate.st_statements import Comment, Plain, Set, Test, about_something, lines
from ..engine.translate.st_tidy import reads, tidy, writes
from ..engine.translate.st_values import INFINITY, NAN, Region, Table, known, literal
from ..engine.translate.structured_text import (
    Names,
    Section,
    array_type,
    arrays_of,
    functions_of,
    infinite_settings,
    non_finite,
    variables,
)  # fmt: skip
from ..engine.translate.types import FLOAT, View
from ..engine.translate.unfold import Unfold

ESTIMATORS = ("ARX", "AR", "Regression", "Joint")
MEMORIES = ("Constant", "ExponentialForgetting", "RandomWalk", "RestartOnChange")
FLAGS = {"MISSING_OUTPUT": "is_missing", "REJECTED": "is_outlier", "JUMP": "has_jumped", "CAPPED": "is_capped",
         "LOST": "is_lost"}  # fmt: skip


def check(est) -> None:
    """Raise InputError, in one sentence, unless there is Structured Text for this estimator."""
    kind, memory = type(est).__name__, est.options.get("memory")
    if kind not in ESTIMATORS:
        raise InputError(f"Structured Text is written for {', '.join(ESTIMATORS)}, not for {kind}: export C instead")
    if memory is not None and type(memory).__name__ not in MEMORIES:
        raise InputError(
            f"Structured Text is written for the memories {', '.join(MEMORIES)}, not for {type(memory).__name__}: "
            "export C instead, or take one of them"
        )
    if est.starting is not None or est.options.get("disturbance") is not None:
        raise InputError("Structured Text is written for estimators without start= and disturbance=: export C instead")


def _step(kinds):
    """Return the kernel of one sample."""

    def step(row, y, u, out, spec, buffer):
        form, noise, memory, gate, scale, detector = read_all(kinds, (), spec)
        scratch = open_scratch(form, buffer)
        state = open_row(form, row)
        advance(form, noise, memory, gate, scale, detector, state, scratch, y, u, out, 0)

    return step


class FunctionBlock:
    """The text of one estimator as a FUNCTION_BLOCK.

    Parameters
    ----------
    est : Estimator
    state : the state it begins with; a fresh one if omitted
    name : of the block, and what the functions beside it begin with
    keep : "means" or "std": whether each sample works out standard deviations too

    Attributes
    ----------
    text : the file
    """

    def __init__(self, est, state=None, name: str = "estimator", keep: str = "std"):
        check(est)
        validation.one_of("keep", keep, ("means", "std"))
        state = np.asarray(est.start() if state is None else state)
        est._rows(state)  # one state, and of this estimator
        self.est, self.name, self.keep = est, _identifier(name), keep
        self.start = np.array(state).reshape(1).view(np.float64)
        self.k = est.model.inputs
        given = (
            "y",
            "y_valid",
            "reset",
            *(("u", "u_valid") if self.k else ()),
            "begun",
            "status",
            "k",
            *FLAGS.values(),
        )
        self.names = Names(self.name, given)
        self.unit = Unfold(self.names, {})
        try:
            self._unfold()
        except Refusal as refusal:
            raise InputError(f"there is no Structured Text of {est!r}: {refusal}; export C instead") from None
        self.text = "\n".join([*self._head(), *functions_of(self.unit), *self._block(), ""])

    def _unfold(self) -> None:
        """Unfold the step over rows of known size and policies that are known."""
        est, unit = self.est, self.unit
        types: list[Any] = [View(1), View(2), View(2), View(2), View(1), View(1)]
        entry = Program().function(_step(tuple(map(type, est.policies))), types)
        width, N = est.table_width(self.keep), est.model.N
        row, out = unit.region("row", self.start.size), unit.region("out", width)
        y, u = unit.region("y_now", 1), unit.region("u_now", self.k)
        settings = flatten(est.policies)
        spec, buffer = unit.region("setting", settings.size, list(settings)), unit.region("work", est.scratch_size)
        self.row, self.out, self.spec, self.buffer = row, out, spec, buffer
        unit.array(y, "y_now", 0, 1)
        if self.k:
            unit.array(u, "u_now", 0, self.k)
        self._name_outputs(out, width, N)
        self._name_state(row)
        shapes = [(row, (row.size,)), (y, (1, 1)), (u, (1, self.k)), (out, (1, width)), (spec, (spec.size,)),
                  (buffer, (buffer.size,))]  # fmt: skip
        tables = [Table(region, known(0), tuple(map(known, sizes))) for region, sizes in shapes]
        frame = Frame(entry)
        frame.values = {name: tables[i] for (name, _), i in zip(entry.params, entry.used)}
        unit.run(frame, entry.body)

    def _name_outputs(self, out: Region, width: int, N: int) -> None:
        """Name what a sample shows: numbers, then the estimates and their deviations."""
        columns = self.est.columns
        labels = {place.start: label for label, place in columns.items() if place.stop - place.start == 1}
        for at in range(self.est.n_columns):
            label = labels[at]
            found = self.unit.array(out, "status_bits" if label == "status" else label, at, 1)
            found.is_used = True
        for at, title in ((0, "parameters"), (N, "deviations")):
            if self.est.n_columns + at < width:
                self.unit.array(out, title, self.est.n_columns + at, N).is_used = True

    def _name_state(self, row: Region) -> None:
        """Name what is kept: single numbers of a view each, tables as arrays."""
        layout, at = layout_of(self.est.policies[0]), 0
        places = layout.slices(self.est.policies[0])
        for view, fields in layout.views.items():
            start, stop = places[fields[0].name].start, places[fields[-1].name].stop
            if all(not field.shape for field in fields):
                self.unit.array(row, view, start, stop - start, [field.name for field in fields])
            elif stop > start:
                self.unit.array(row, "estimate" if view in ("s", "theta") else view, start, stop - start)
            at = stop
        assert at == row.size

    @property
    def state_names(self) -> list[str]:
        """The variables that a state row is kept in, in its order."""
        return [name for array in self.row.arrays for name in array.labels or [array.name]]

    @property
    def output_names(self) -> list[str]:
        """Likewise those that show a sample."""
        return [array.name for array in self.out.arrays]

    def output_text(self, column: int) -> str:
        """Return how an instance named ``estimator`` shows a column of a sample."""
        array = next(a for a in self.out.arrays if a.start <= column < a.start + a.size)
        if array.name == "status_bits":
            return "DINT_TO_LREAL(estimator.status)"
        return f"estimator.{array.name}" + f"[{column - array.start}]" * (array.size > 1)

    # --- the text ------------------------------------------------------------------------------------------

    def _head(self) -> Iterator[str]:
        """Yield what stands before everything."""
        yield from lines([Comment(f"{self.name}: written by driftwise, do not edit. One call per sample.")])
        yield from lines([Comment(f"{self.est!r}")])
        yield ""

    def _block(self) -> Iterator[str]:
        """Yield the lines of the block."""
        unit, estimates = self.unit, ", ".join([*self.est.state_names, *self.est.names])
        body = about_something(tidy(unit.block, set()))
        head, tail = self._before(), self._after()
        read = reads(body) | writes([*head, *body])
        flags = [(flag, "BOOL", about) for flag, about in self._flags()]
        yield f"FUNCTION_BLOCK {self.name}"
        inputs = [("y", "LREAL", "the output, measured"), ("y_valid", "BOOL := TRUE", "FALSE: it is missing")]
        if self.k:
            many = f"[{', '.join(['TRUE'] * self.k)}]" if self.k > 1 else "TRUE"
            inputs.append(("u", array_type(self.k), "the inputs of this sample" if self.k > 1 else "the input"))
            inputs.append(("u_valid", f"{array_type(self.k, 'BOOL')} := {many}", "FALSE: it is missing"))
        yield from Section("VAR_INPUT", [*inputs, ("reset", "BOOL", "TRUE: begin anew with this sample")])
        outputs = Section("VAR_OUTPUT")
        for array in self.out.arrays:
            if array.name == "status_bits":
                continue
            about = {"parameters": f"estimates: {estimates}", "deviations": "and their standard deviations"}
            outputs.items.append((array.name, array_type(array.size), about.get(array.name, self._about(array.start))))
        outputs.items += [("status", "DINT", "what happened, one bit each"), *flags]
        yield from outputs
        yield from Section("VAR RETAIN", [("begun", "BOOL := FALSE", ""), *arrays_of(self.row, "", True).items])
        own = [
            *arrays_of(self.spec, "").items,
            *arrays_of(self.buffer, "").items,
            ("y_now", "LREAL", ""),
            ("status_bits", "LREAL", ""),
        ]
        own += [("u_now", array_type(self.k), "")] * bool(self.k) + [("k", "DINT", "")]
        own += list(variables({**unit.kinds, NAN: FLOAT, INFINITY: FLOAT}, read))
        yield from Section("VAR", own)
        yield ""
        yield from lines([*head, *body, *tail])
        yield "END_FUNCTION_BLOCK"

    def _about(self, column: int) -> str:
        """Return what a column of a sample is about."""
        names = {place.start: name for name, place in self.est.columns.items()}
        return next((f.about for f in self.est.sample_layout.fields if f.name == names.get(column)), "")

    def _flags(self) -> Iterator[tuple[str, str]]:
        """Yield the flags and what they mean."""
        for status, meaning in MEANING.items():
            if status.name in FLAGS:
                yield FLAGS[status.name], meaning

    def _before(self) -> list[Any]:
        """Return what comes before the step: the start, and the samples with what is missing marked."""
        block = [*non_finite({NAN}), *infinite_settings(self.spec)]
        block.append(Test("reset OR NOT begun", self._beginning()))
        block.append(Test("y_valid", [Set("y_now", "y")], [Set("y_now", NAN)]))
        for i in range(self.k):
            at = f"[{i}]" if self.k > 1 else ""
            block.append(Test(f"u_valid{at}", [Set(f"u_now{at}", f"u{at}")], [Set(f"u_now{at}", NAN)]))
        return block

    def _beginning(self) -> list[Any]:
        """Return the statements that set the state to where it begins."""
        block: list[Any] = []
        for array in self.row.arrays:
            numbers = [literal(FLOAT, value) for value in self.start[array.start : array.start + array.size]]
            if array.labels or array.size == 1:
                block += [Set(label, text) for label, text in zip(array.labels or [array.name], numbers)]
                continue
            common, count = Counter(numbers).most_common(1)[0]
            if count > 1:
                block += [Plain(f"FOR k := 0 TO {array.size - 1} DO {array.name}[k] := {common}; END_FOR")]
            block += [Set(f"{array.name}[{i}]", text) for i, text in enumerate(numbers) if count == 1 or text != common]
        return [*block, Set("begun", "TRUE")]

    def _after(self) -> list[Any]:
        """Return what comes after the step: the status as an integer, and its flags."""
        block: list[Any] = [Set("status", "TRUNC(status_bits)")]
        for status in MEANING:
            if status.name in FLAGS:
                block.append(Set(FLAGS[status.name], f"status{f' / {int(status)}' * (status > 1)} MOD 2 = 1"))
        return block


def _identifier(name: str) -> str:
    """Return a name that a block may have, or raise InputError."""
    is_good = name.isascii() and name.isidentifier() and "__" not in name and name[0] != "_" and name[-1] != "_"
    if not is_good or Names("").local(name) != name:
        raise InputError(f"name must be a word such as pump_1 (no keyword, no double underscore), got {name!r}")
    return name
