"""The same bits on machines that are not here: ARM in an emulator, Windows in wine; others pass as C."""

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from replay import MAIN

from driftwise.engine.compilers import _COMMON, _GCC, MEMORY, compilers

pytestmark = [
    pytest.mark.service,
    pytest.mark.skipif(not compilers(), reason="no C compiler: OTHER MACHINES WERE NOT TRIED"),
]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Return loops in C, each with what it was given, and what this machine made of it."""
    folder = tmp_path_factory.mktemp("recorded")
    script = Path(__file__).with_name("replay.py")
    subprocess.run([sys.executable, str(script), str(folder)], check=True, env={**os.environ, "DRIFTWISE_CC": ""})
    found = sorted(path for path in folder.glob("*.c") if path.with_suffix(".given").exists())
    assert len(found) >= 10
    return found


def replayed(sources, compiler: list[str], runner: list[str], tmp_path) -> None:
    """Compile and run every loop, and compare the digests of all that it wrote."""
    for source in sources:
        program, made = tmp_path / f"{source.stem}.exe", tmp_path / f"{source.stem}.made"
        subprocess.run([*compiler, *_COMMON, *_GCC, str(source), "-o", str(program)], check=True)
        given = shutil.copy(source.with_suffix(".given"), tmp_path)
        line = [*runner, program.name if runner else str(program), Path(given).name, made.name]
        env = {**os.environ, "WINEDEBUG": "-all", "WINEPREFIX": str(tmp_path.parent / "wine")}
        subprocess.run(line, check=True, cwd=tmp_path, env=env, stderr=subprocess.DEVNULL, timeout=300)
        ours, theirs = (
            hashlib.sha256(path.read_bytes()).hexdigest()[:16] for path in (source.with_suffix(".made"), made)
        )
        print(f"{source.stem}: {ours} here, {theirs} there")
        assert ours == theirs, source.stem


def needs(*programs: str) -> None:
    missing = [name for name in programs if shutil.which(name) is None]
    if missing:
        pytest.skip(f"{' and '.join(missing)} not installed (make services): THIS MACHINE WAS NOT TRIED")


def test_arm_of_64_bits(recorded, tmp_path):
    needs("aarch64-linux-gnu-gcc", "qemu-aarch64")
    replayed(recorded, ["aarch64-linux-gnu-gcc", "-static"], ["qemu-aarch64"], tmp_path)


def test_windows(recorded, tmp_path):
    needs("x86_64-w64-mingw32-gcc", "wine")
    replayed(recorded, ["x86_64-w64-mingw32-gcc", "-static"], ["wine"], tmp_path)


TARGETS = {
    "macOS on ARM": ["-target", "arm64-apple-macos11"],
    "macOS on Intel": ["-target", "x86_64-apple-macos11"],
    "Windows, Microsoft's compiler": ["-target", "x86_64-pc-windows-msvc", "-fms-compatibility", "-fms-extensions"],
    "Windows on ARM": ["-target", "aarch64-pc-windows-msvc", "-fms-compatibility"],
    "Linux on RISC-V": ["-target", "riscv64-linux-gnu"],
    "Linux on POWER": ["-target", "powerpc64le-linux-gnu"],
}


@pytest.mark.parametrize("target", TARGETS.values(), ids=TARGETS)
def test_what_is_never_run_passes_as_c(recorded, tmp_path, target):
    """Without a header of that system: the C asks for none."""
    needs("clang")
    from driftwise.engine.caller import SOURCE

    texts = [source.read_text().removesuffix(MAIN) for source in recorded] + [SOURCE.read_text()]
    for text in texts:
        source = tmp_path / "loop.c"
        source.write_text(text + MEMORY)
        line = ["clang", "-std=c99", "-nostdinc", "-fsyntax-only", "-Werror", "-Wno-unused", *target, str(source)]
        done = subprocess.run(line, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr[:2000]
