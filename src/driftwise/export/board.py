"""What an export takes on a controller: built by GCC for Arm, run in QEMU, where these are installed."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..engine.errors import InputError

GCC, QEMU = "arm-none-eabi-gcc", "qemu-system-arm"
FLAGS = ("-std=c99", "-O2", "-mthumb", "-mfloat-abi=hard", "-fno-math-errno", "-ffunction-sections")


@dataclass(frozen=True)
class Board:
    """A controller that QEMU knows."""

    title: str
    machine: str
    cpu: tuple[str, ...]


BOARDS = (
    Board("Cortex-M7 (FPU: double)", "mps2-an500", ("-mcpu=cortex-m7", "-mfpu=fpv5-d16")),
    Board("Cortex-M4F (FPU: float)", "mps2-an386", ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16")),
)


@dataclass
class Cost:
    """Bytes of code, constants included, of a state and of the deepest stack; instructions of an update if it was run.

    ``hash`` is that of all states and columns of the samples that were run, ``output`` what the run printed.
    """

    board: str
    code: int
    ram: int
    stack: int
    mean: float | None = None
    most: int | None = None
    hash: str = ""
    output: str = ""

    @property
    def row(self) -> str:
        """A line of the table in the documents."""
        instructions = "" if self.mean is None else f"{self.mean:,.0f} | {self.most:,}".replace(",", " ")
        return f"| {self.board} | {self.code} | {self.ram} | {self.stack} | {instructions or '- | -'} |"


def measure(
    source: Any, folder, board: Board, samples: int = 1000, main: str | None = None, also: tuple[str, ...] = ()
) -> Cost:
    """Return what NAME.c of a folder costs; where QEMU is, it runs so many samples, or another ``main``.

    ``also`` are further files and words of the linker's.
    """
    if shutil.which(GCC) is None:
        raise InputError(f"{GCC} is not installed: code, stack and instructions are not known")
    name, place = source.name, Path(folder)
    work = place / "build"
    work.mkdir(exist_ok=True)
    command = [GCC, *FLAGS, *board.cpu]
    made = work / f"{name}.o"
    _run([*command, "-fstack-usage", "-fcallgraph-info=su", "-c", str(place / f"{name}.c"), "-o", str(made)])
    size = _run([GCC.replace("gcc", "size"), str(made)]).splitlines()[-1].split()
    ram = (source.start.size + source.columns + source.scratch) * (4 if source.is_single else 8)
    cost = Cost(board.title, int(size[0]), ram, deepest(made.with_suffix(".ci").read_text(), f"{name}_update"))
    if shutil.which(QEMU) is None:
        return cost
    (work / "main.c").write_text(trial(source, samples) if main is None else main)
    (work / "board.c").write_text(START)
    (work / "board.ld").write_text(SCRIPT)
    image = work / "board.elf"
    link = ["--specs=rdimon.specs", "-T", str(work / "board.ld"), "-Wl,--gc-sections"]
    files = [str(work / "main.c"), str(work / "board.c"), str(made), *also]
    _run([*command, "-DON_BOARD", f"-I{place}", *link, *files, "-lm", "-o", str(image)])
    cost.output = _run(
        [QEMU, "-M", board.machine, "-nographic", "-monitor", "none", "-serial", "none", "-icount", "shift=0",
         "-semihosting-config", "enable=on,target=native", "-kernel", str(image)]
    )  # fmt: skip
    if found := re.search(r"hash (\w+) mean (\S+) most (\d+)", cost.output):
        cost.hash, cost.mean, cost.most = found[1], float(found[2]), int(found[3])
    return cost


def _run(command: list[str]) -> str:
    """Return what a program prints."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    if done.returncode:
        raise InputError(f"{' '.join(command)} failed: {(done.stderr or done.stdout).strip()}")
    return done.stdout


def deepest(graph: str, entry: str) -> int:
    """Return the bytes of stack that a function and what it calls take at most, from GCC's graph of calls."""
    own = {title: int(size) for title, size in re.findall(r'node: { title: "([^"]+)".*?\\n(\d+) bytes', graph)}
    calls: dict[str, set[str]] = {}
    for a, b in re.findall(r'edge: { sourcename: "([^"]+)" targetname: "([^"]+)"', graph):
        calls.setdefault(a, set()).add(b)

    def below(title: str) -> int:
        return own.get(title, 0) + max(map(below, calls.get(title, ())), default=0)

    return max(below(title) for title in own if title.split(":")[-1] == entry)


def trial(source: Any, samples: int) -> str:
    """Return a program that runs samples with gaps and outliers and prints a hash of all states and outputs.

    On a board it also counts instructions: QEMU's clock ticks once an instruction, SysTick once in 40 of them.
    """
    p, k = source.outputs, source.inputs
    arguments = ["y" if source.est.outputs else "y[0]"] + (["u"] if k > 1 else ["u[0]"] * k)
    arguments += [f"({source.number})t"] * source.est.takes_instants
    return TRIAL.format(
        name=source.name, p=p, k=max(k, 1), samples=samples, arguments=", ".join(arguments), number=source.number,
        word="uint32_t" if source.is_single else "uint64_t", row=source.start.size, columns=source.columns,
    )  # fmt: skip


TRIAL = """\
#include "{name}.h"

#include <stdio.h>
#include <string.h>

#if defined(ON_BOARD)
#define SYSTICK ((volatile uint32_t *)0xE000E010)
static void start_clock(void)
{{
    SYSTICK[1] = 0xFFFFFF;
    SYSTICK[2] = 0;
    SYSTICK[0] = 5;
}}
static uint32_t ticks(void) {{ return SYSTICK[2]; }}
#else
static void start_clock(void) {{}}
static uint32_t ticks(void) {{ return 0; }}
#endif

static struct {name}_state state;
static uint64_t hash = 14695981039346656037ULL;

static void add({number} x)
{{
    {word} word = 0;
    unsigned i;
    if (x == x) {{
        memcpy(&word, &x, sizeof word);
    }} else {{
        word = 1;
    }}
    for (i = 0; i < sizeof word; i++) {{
        hash = (hash ^ (word >> (8 * i) & 255)) * 1099511628211ULL;
    }}
}}

static uint32_t seed = 1;
static {number} noise(void)
{{
    seed = seed * 1664525u + 1013904223u;
    return ({number})((int32_t)(seed >> 8) - 8388608) / ({number})8388608;
}}

int main(void)
{{
    static {number} y[{p}], u[{k}], past[2][{p}], last;
    uint64_t total = 0;
    uint32_t most = 0;
    int t, i;
    {number} none = 0;
    none = none / none;
    {name}_init(&state);
    start_clock();
    for (t = 0; t < {samples}; t++) {{
        uint32_t begun, took;
        {number} gain = t < {samples} / 2 ? ({number})1 : ({number})2;
        for (i = 0; i < {p}; i++) {{
            {number} now = (past[0][i] * 6 - past[1][i] * 3) / 5 + gain * last + noise() / 8;
            past[1][i] = past[0][i];
            past[0][i] = now;
            y[i] = t % 11 == 10 ? none : t % 50 == 25 ? now + 20 : now;
        }}
        last = 0;
        for (i = 0; i < {k}; i++) {{
            u[i] = noise();
            last += u[i];
        }}
        if (t % 23 == 17) {{
            u[0] = none;
        }}
        begun = ticks();
        (void){name}_update(&state, {arguments});
        took = (begun - ticks()) & 0xFFFFFF;
        total += took;
        most = took > most ? took : most;
        for (i = 0; i < {row}; i++) {{
            add(state.row[i]);
        }}
        for (i = 0; i < {columns}; i++) {{
            add(state.out[i]);
        }}
    }}
    printf("hash %08lx%08lx mean %.0f most %lu\\n", (unsigned long)(hash >> 32), (unsigned long)(hash & 0xFFFFFFFFUL),
           (double)total * 40 / {samples}, (unsigned long)most * 40);
    return 0;
}}
"""

START = """\
#include <stdint.h>

extern uint32_t stack_top;
extern void _start(void);
void reset(void);
static void stop(void) { for (;;) {} }

__attribute__((section(".vectors"), used)) void *const vectors[16] = {
    &stack_top, (void *)reset, (void *)stop, (void *)stop, (void *)stop, (void *)stop, (void *)stop
};

void reset(void)
{
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20; /* the floating-point unit */
    __asm__ volatile ("dsb\\nisb");
    _start();
}
"""

SCRIPT = """\
ENTRY(reset)
MEMORY { CODE (rx) : ORIGIN = 0x00000000, LENGTH = 4M  DATA (rwx) : ORIGIN = 0x20000000, LENGTH = 4M }
SECTIONS {
    .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) KEEP(*(.init)) KEEP(*(.fini)) . = ALIGN(8);
              __exidx_start = .; *(.ARM.exidx*) __exidx_end = .;
              __init_array_start = .; KEEP(*(.init_array*)) __init_array_end = .;
              __preinit_array_start = .; __preinit_array_end = .;
              __fini_array_start = .; KEEP(*(.fini_array*)) __fini_array_end = .; } > CODE
    .data : { *(.data*) } > DATA
    .bss : { __bss_start__ = .; *(.bss*) *(COMMON) . = ALIGN(8); __bss_end__ = .; end = .; __end__ = .; } > DATA
    stack_top = ORIGIN(DATA) + LENGTH(DATA);
    __stack = stack_top;
}
"""
