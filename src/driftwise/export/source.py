"""NAME.h and NAME.c: what a control engineer calls, around the translated step."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..engine import recovery
from ..engine.errors import InputError
from ..engine.layout import layout_of
from ..engine.status import MEANING
from ..engine.translate.c99 import comment
from . import single
from .step import ControllerPrinter, step

KEEP = ("means", "std")
FEW = 8  # numbers of the start that are written one by one, the others being those of a fresh state


class Source:
    """The texts of one exported estimator.

    Parameters
    ----------
    est : Estimator
    state : the state it begins with
    name : what everything in the files begins with
    keep : "means" or "std": whether each update works out standard deviations too
    is_single : whether numbers are of 32 bits
    """

    def __init__(self, est, state, name: str, keep: str = "std", is_single: bool = False):
        if keep not in KEEP:
            raise InputError(f"keep must be one of {', '.join(KEEP)}, got {keep!r}")
        self.est, self.name, self.keep, self.is_single = est, name, keep, is_single
        self.begun = np.array(state)
        self.start = self.begun.reshape(1).view(np.float64)
        self.number = "float" if is_single else "double"
        self.inputs, self.outputs = est.model.inputs, est.outputs or 1
        self.columns, self.scratch = est.table_width(keep), max(est.scratch_size, 1)
        self.printer = ControllerPrinter(is_single)
        self.fresh = recovery.tail(est.start(), est.unknown_parts)
        self.entry, self.settings = step(single.settled(est) if is_single else est.policies, self.outputs)
        self.body = self.printer.text(self.entry)
        self.estimates = [*est.state_names, *est.names]

    # --- what there is to call -----------------------------------------------------------------------------

    @property
    def arguments(self) -> str:
        """What an update is given of a sample."""
        several = f"const {self.number} y[{self.outputs}]" if self.est.outputs else f"{self.number} y"
        inputs = f"const {self.number} u[{self.inputs}]" if self.inputs > 1 else f"{self.number} u"
        return ", ".join([several, *[inputs] * (self.inputs > 0), *[f"{self.number} time"] * self.est.takes_instants])

    def functions(self) -> Iterator[tuple[str, str, str]]:
        """Yield what each function is for, its head, and its body."""
        name, number, C = self.name, self.number, self.columns
        state = f"const struct {name}_state *state"
        which = ", int32_t output" if self.est.outputs else ""
        about = {field.name: field.about for field in self.est.sample_layout.fields}
        for field, place in self.est.columns.items():
            if field == "mixture" or place.start == place.stop:
                continue
            kind = "uint32_t" if field == "status" else number
            at = f"state->out[{place.start}]"
            text = "bits of the last sample, as update returns them" if field == "status" else about[field]
            if which and place.stop - place.start == self.outputs:
                at = f"(output >= 0 && output < {self.outputs}) ? state->out[{place.start} + output] : DW_NAN"
                if field == "status":
                    at = f"(output >= 0 && output < {self.outputs}) ? (uint32_t)state->out[{place.start} + output] : 0U"
            elif field == "status":
                at = f"(uint32_t){at}"
            given = which if place.stop - place.start == self.outputs else ""
            yield text, f"{kind} {name}_{field}({state}{given})", f"    return {at};"
        first, n, N = self.est.n_columns, len(self.est.state_names), len(self.estimates)
        parts = [("x", "state", 0, n), ("parameter", "parameter", n, N)]
        for word, what, begin, end in parts:
            for suffix, shift, text in (("", 0, "estimate of a"), ("_std", N, "standard deviation of a")):
                if end > begin and first + shift + end <= C:
                    place = f"state->out[{first + shift + begin} + i]"
                    known = f"(i >= 0 && i < {end - begin}) ? {place} : DW_NAN"
                    yield (
                        f"{text} {what}",
                        f"{number} {name}_{word}{suffix}({state}, int32_t i)",
                        f"    return {known};",
                    )

    # --- the files -----------------------------------------------------------------------------------------

    def header(self) -> str:
        """Return NAME.h."""
        name, upper, est = self.name, self.name.upper(), self.est
        doc = {field.name: field for field in layout_of(est.policies[0]).fields}
        places = [
            f" *   {place.start:4d}  {field}: {comment(doc[field].about)}" if field in doc else f" *   {place.start:4d}"
            for field, place in self._places().items()
        ]
        bits = [f"#define {upper}_{bit.name} {int(bit)}UL /* {text} */" for bit, text in MEANING.items()]
        n = len(est.state_names)
        named = [
            f"#define {upper}_{word} {i}"
            for words in (self.estimates[:n], self.estimates[n:])
            for i, word in enumerate(identifiers(words))
        ]
        calls = [f"{head}; /* {comment(text)} */" for text, head, _ in self.functions()]
        return HEADER.format(
            name=name, upper=upper, what=comment(repr(est)), inputs=self.inputs, outputs=self.outputs,
            number=self.number, row=self.start.size, columns=self.columns, scratch=self.scratch,
            arguments=self.arguments, bits="\n".join(bits), named="\n".join(named), calls="\n".join(calls),
            places="\n".join(places),
        )  # fmt: skip

    def _places(self) -> dict[str, slice]:
        """Return where in a row each field lies."""
        fields: Any = self.est.dtype.fields
        return {k: slice(at // 8, (at + kind.itemsize) // 8) for k, (kind, at) in fields.items() if kind.itemsize}

    def source(self) -> str:
        """Return NAME.c."""
        name, F, step_of = self.name, "F", self.entry
        width = self.inputs + self.est.takes_instants
        views = {
            "row": f"V1 row = {{state->row, {self.start.size}}};",
            "work": f"V1 work = {{state->work, {self.scratch}}};",
            "settings": (
                f"V1 settings = {{{f'(F *){name}_settings' if len(self.settings) else '0'}, {len(self.settings)}}};"
            ),
            "fresh": f"V1 fresh = {{(F *){name}_fresh, {self.fresh.size}}};",
            "y": f"V2 y_ = {{ys, 1, {self.outputs}}};",
            "u": f"V2 u_ = {{us, 1, {width}}};",
            "out": f"V2 out = {{state->out, 1, {self.columns}}};",
        }
        given = [param for param, _ in step_of.params]
        lines = [f"{F} ys[{self.outputs}];", f"{F} us[{max(width, 1)}];", *(views[param] for param in given)]
        lines += [f"ys[{i}] = y[{i}];" for i in range(self.outputs)] if self.est.outputs else ["ys[0] = y;"]
        lines += [f"us[{i}] = u[{i}];" for i in range(self.inputs)] if self.inputs > 1 else ["us[0] = u;"] * self.inputs
        lines += [f"us[{self.inputs}] = time;"] * self.est.takes_instants
        lines += [f"{self.printer.called(step_of)}({', '.join(f'{p}_' if p in 'yu' else p for p in given)});"]
        status = self.est.columns["status"].start
        several = " | ".join(f"(uint32_t)state->out[{status + i}]" for i in range(self.outputs))
        lines.append(f"return {several};")
        if "u" not in given:
            lines = [line for line in lines if not line.startswith((f"{F} us[", "us["))]
        tables = [("settings", self.settings), ("fresh", self.fresh)]
        other = np.flatnonzero(self.fresh[:-1].view(np.int64) != self.start.view(np.int64))
        begun = "start" if len(other) > FEW else "fresh"
        if begun == "start":
            tables, other = [*tables, ("start", self.start)], other[:0]
        constants = [
            f"static const F {name}_{word}[{len(table)}] = {{\n{self.printer.numbers(table)}\n}};\n"
            for word, table in tables
            if len(table)
        ]
        begin = [f"    state->row[{i}] = {self.printer.number(float(self.start[i]))};\n" for i in other]
        calls = [f"{head}\n{{\n{body}\n}}" for _, head, body in self.functions()]
        self.printer.need("DW_NAN")
        return SOURCE.format(
            name=name, what=comment(repr(self.est)), body=self.printer.text(step_of),
            constants="\n".join(constants), begun=begun, begin="".join(begin),
            row=self.start.size, columns=self.columns, scratch=self.scratch, arguments=self.arguments,
            nothing="0.0F" if self.is_single else "0.0", update="\n    ".join(lines), calls="\n\n".join(calls),
        )  # fmt: skip


def identifiers(words) -> list[str]:
    """Return words as parts of names in C, each another."""
    found: list[str] = []
    for word in words:
        text, count = re.sub(r"\W", "_", word, flags=re.ASCII).upper(), 1
        shown = text
        while shown in found:
            count += 1
            shown = f"{text}_{count}"
        found.append(shown)
    return found


HEADER = """\
/* {what}, exported by driftwise. README.md tells how to use it.
 *
 * Every sample: status = {name}_update(&state, ..), then ask. What is missing is given as NaN. */
#ifndef {upper}_H
#define {upper}_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {{
#endif

#define {upper}_INPUTS {inputs}
#define {upper}_OUTPUTS {outputs}

/* What happened at a sample: bits of the status. */
{bits}

/* What there is to ask for, by number. */
{named}

/* An estimator. It may be copied; several may work side by side. row holds all that is remembered, from these places:
{places}
 */
struct {name}_state {{
    {number} row[{row}];
    {number} out[{columns}];
    {number} work[{scratch}];
}};

/* Begin where the export began. */
void {name}_init(struct {name}_state *state);

/* Take one sample; return its status. */
uint32_t {name}_update(struct {name}_state *state, {arguments});

/* Of the last sample. A number that is not there is NaN. */
{calls}

#ifdef __cplusplus
}}
#endif

#endif
"""

SOURCE = """\
/* {what}, exported by driftwise from its kernels: do not edit.
 *
 * No library but a square root where the processor has none, no memory of its own. The bits are those of driftwise if
 * products are not fused with sums: -ffp-contract=off, which -std=c99 implies. */
#include "{name}.h"

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

{body}

{constants}
void {name}_init(struct {name}_state *state)
{{
    int32_t i;
    for (i = 0; i < {row}; i++) {{
        state->row[i] = {name}_{begun}[i];
    }}
{begin}    for (i = 0; i < {columns}; i++) {{
        state->out[i] = {nothing};
    }}
    for (i = 0; i < {scratch}; i++) {{
        state->work[i] = {nothing};
    }}
}}

uint32_t {name}_update(struct {name}_state *state, {arguments})
{{
    {update}
}}

{calls}
"""
