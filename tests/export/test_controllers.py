"""Estimators on two controllers in QEMU: the bits of this machine, over ten thousand samples with gaps and outliers."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

import driftwise as dw
from driftwise.export.board import BOARDS, GCC, QEMU, measure, trial
from driftwise.export.folder import source_of
from driftwise.export.readme import DEVIATIONS

pytestmark = pytest.mark.service
SAMPLES = 10_000
HERE = Path(__file__).parent
EXACT = (str(HERE / "ieee_addition.c"), "-Wl,--wrap=__aeabi_dadd", "-Wl,--wrap=__aeabi_dsub")
CASES = {
    "arx": (dw.ARX(2, 2), False),
    "joint": (dw.Joint(2), False),
    "restart": (dw.ARX(2, 2, memory=dw.RestartOnChange()), False),
    "automatic": (dw.ARX(2, 2, memory=dw.AutoMemory()), False),
    "arx_float": (dw.ARX(2, 2), True),
    "restart_float": (dw.ARX(2, 2, memory=dw.RestartOnChange()), True),
}


@pytest.fixture(autouse=True)
def tools():
    """Skip, loudly, where the programs are not installed."""
    missing = [name for name in (GCC, QEMU, "gcc", "cppcheck") if shutil.which(name) is None]
    if missing:
        pytest.skip(f"no {', '.join(missing)} (see the Makefile): CONTROLLERS WERE NOT TESTED")


@pytest.fixture
def no_board(monkeypatch):
    """Let an export write its files alone."""
    monkeypatch.setattr("driftwise.export.readme.GCC", "")


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: board.machine)
@pytest.mark.parametrize("name", CASES)
def test_a_controller_gives_the_same_bits(name, board, tmp_path, no_board):
    est, is_single = CASES[name]
    est.export(tmp_path, name=name, precision="single" if is_single else "double")
    source = source_of(est, est.start(), name, is_single=is_single)
    (tmp_path / "here.c").write_text(trial(source, SAMPLES))
    command = ["gcc", "-std=c99", "-O2", "here.c", f"{name}.c", "-lm", "-o", "here"]
    subprocess.run(command, cwd=tmp_path, check=True)
    here = subprocess.run(["./here"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout.split()[1]
    cost = measure(source, tmp_path, board, SAMPLES, also=EXACT)
    print(f"\n{name}: {cost.row}")
    assert cost.hash == here
    # and the bits of the estimator itself: what the test that goes with an export holds
    test = (tmp_path / f"test_{name}.c").read_text()
    assert measure(source, tmp_path, board, main=test, also=EXACT).output == "OK\n"


def test_sums_that_stand_in_for_those_of_the_compiler_are_those_of_this_machine(tmp_path):
    """GCC's library rounds some of them wrongly on controllers without double arithmetic."""
    files = [HERE / "sums.c", HERE / "ieee_addition.c"]
    subprocess.run(["gcc", "-std=c99", "-O2", *files, "-o", "sums"], cwd=tmp_path, check=True)
    assert subprocess.run(["./sums"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout == "0\n"


@pytest.mark.parametrize("name", ["joint", "automatic", "arx_float"])
def test_misra_finds_what_the_readme_says(name, tmp_path, no_board):
    est, is_single = CASES[name]
    est.export(tmp_path, name=name, precision="single" if is_single else "double")
    command = ["cppcheck", "--addon=misra", "--std=c99", "--quiet", f"{name}.c"]
    said = subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True).stderr
    found = set(re.findall(r"misra-c2012-([\d.]+)\]", said))
    assert found and found <= {rule for rules in DEVIATIONS for rule in rules.split(", ")}
    assert not re.findall(r": (?:error|warning):.*", said)


@pytest.mark.parametrize("target", ["x86_64-pc-windows-msvc", "aarch64-pc-windows-msvc", "arm64-apple-macos11"])
def test_compilers_that_are_not_here_take_it(target, tmp_path, no_board):
    """As a compiler with none of GNU's constructs would, where it is Microsoft's."""
    if shutil.which("clang") is None:
        pytest.skip("no clang: EXPORTS WERE NOT CHECKED FOR OTHER SYSTEMS")
    CASES["automatic"][0].export(tmp_path, name="pump")
    how = ["-fms-compatibility", "-U__GNUC__", "-U__clang__"] if "windows" in target else []
    command = ["clang", f"--target={target}", "-std=c99", "-ffreestanding", "-fsyntax-only", "-Wall", "-Werror", *how]
    subprocess.run([*command, "-pedantic", "pump.c"], cwd=tmp_path, check=True)


def test_the_readme_tells_what_it_takes(tmp_path):
    dw.ARX(1, 1).export(tmp_path, name="pump")
    text = (tmp_path / "README.md").read_text()
    assert all(
        re.search(rf"\| {re.escape(board.title)} \| \d+ \| \d+ \| \d+ \| [\d ]+ \| [\d ]+ \|", text) for board in BOARDS
    )
