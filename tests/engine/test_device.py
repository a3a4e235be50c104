"""A fleet on a GPU: in the simulator of CUDA, which must be chosen before numba is loaded, hence other processes."""

import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from oracle import ptx

import driftwise as dw
from driftwise.engine import compile
from driftwise.fleet import cuda as on_gpu

CASES = {
    "joint": dw.Joint(3),
    "arx": dw.ARX(2, 2),
    "auto": dw.ARX(2, 2, memory=dw.AutoMemory()),
}
SERIES, SAMPLES = 5, 60


def uncompiled(fleet):
    """Let a fleet of the processor run as Python."""
    crew = fleet.crew
    crew.loop = lambda columns: compile.plain_crew(crew.kinds, crew.sizes, crew.shapes(columns))
    return fleet


def story(fleet, inputs):
    """Take samples of any keys, some missing; series come, go, and have settings of their own; return what came out."""
    rng = np.random.default_rng(8)
    keys = rng.permutation(np.repeat(np.arange(SERIES), SAMPLES))
    y, u = rng.standard_normal(len(keys)), rng.standard_normal((len(keys), inputs))
    y[rng.random(len(keys)) < 0.1], u[rng.random(u.shape) < 0.05] = np.nan, np.nan
    shown = []

    def scan(part):
        shown.append(np.column_stack(fleet.scan(keys[part], y[part], u[part] if inputs else None)))

    for part in (slice(0, 100), slice(100, 101), slice(101, 200)):
        scan(part)
    fleet.drop([3])
    fleet.states["theta"][0] *= 0.5  # what is written into the states counts
    fleet.add([30])
    for part in (slice(200, 260), slice(260, None)):  # 3 begins afresh
        scan(part)
    there = np.flatnonzero(np.isin(keys, (1, 4)))[:1]
    shown.append(np.column_stack(fleet.update_batch(keys[there], y[there], u[there] if inputs else None)))
    return np.concatenate(shown), fleet.states.view(float).reshape(len(fleet), -1)


def simulate(path):
    """Run every story in the simulator and save what came out; as Python on the processor it is the same, every bit."""
    found = {}
    for name, estimator in CASES.items():
        fleet = dw.Fleet(estimator, range(SERIES), device="cuda")
        shown, rows = story(fleet, estimator.model.inputs)
        plain = story(uncompiled(dw.Fleet(estimator, range(SERIES), threads=1)), estimator.model.inputs)
        np.testing.assert_array_equal(shown, plain[0])
        np.testing.assert_array_equal(rows, plain[1])
        found |= {f"{name} shown": shown, f"{name} rows": rows}
    special = dw.Joint(3, P0=100.0)  # settings of one series
    fleets = [dw.Fleet(dw.Joint(3), ["a"], device="cuda"), uncompiled(dw.Fleet(dw.Joint(3), ["a"], threads=1))]
    for fleet in fleets:
        fleet.add(["b"], special)
        fleet.scan(["b", "a"] * 20, np.sin(np.arange(40.0)))
    np.testing.assert_array_equal(fleets[0].states, fleets[1].states)
    assert np.any(fleets[0].mean("a") != fleets[0].mean("b"))
    np.savez(path, **found)


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """What the simulator gave."""
    path = tmp_path_factory.mktemp("cuda") / "simulated.npz"
    paths = [str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")]  # the oracles
    environment = {**os.environ, "NUMBA_ENABLE_CUDASIM": "1", "PYTHONPATH": os.pathsep.join(paths)}
    done = subprocess.run([sys.executable, __file__, path], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return np.load(path)


def compare(simulated, name):
    """The compiled loop gives the same to 1e-12 of the largest number of its kind."""
    estimator = CASES[name]
    shown, rows = story(dw.Fleet(estimator, range(SERIES)), estimator.model.inputs)
    for found, expected in ((simulated[f"{name} shown"], shown), (simulated[f"{name} rows"], rows)):
        assert np.array_equal(np.isnan(found), np.isnan(expected))
        size = np.nanmax(abs(expected), axis=0)
        assert np.nanmax(abs(found - expected) / np.where(size > 0, size, 1)) <= 1e-12


@pytest.mark.parametrize("name", ["joint", "arx"])
def test_a_gpu_gives_the_numbers_of_the_processor(simulated, name):
    compare(simulated, name)


@pytest.mark.slow
def test_so_it_does_with_auto(simulated):
    compare(simulated, "auto")


@pytest.mark.slow
@pytest.mark.skipif(find_spec("numba_cuda") is None, reason="needs pip install numba-cuda[cu13]")
@pytest.mark.parametrize(("name", "tolerance"), [("joint", 0.0), ("arx", 0.0), ("auto", 1e-11)])
def test_the_code_compiled_for_a_gpu_gives_the_numbers_of_the_processor(name, tolerance, tmp_path):
    """The assembly, run instruction by instruction: all bits, but for log, exp, lgamma and powers in `AutoMemory`."""
    from driftwise.engine import device

    rng, fleet = np.random.default_rng(0), dw.Fleet(CASES[name], range(3), threads=1)
    crew, samples = fleet.crew, 120
    code = device.assembly(crew.kinds, crew.sizes, crew.shapes(4))
    assert "mul.f64" not in code and "add.f64" not in code  # without .rn the assembler may fuse them
    y, u = rng.standard_normal((samples, 1)), rng.standard_normal((samples, crew.inputs))
    y[rng.random(y.shape) < 0.1], u[rng.random(u.shape) < 0.1] = np.nan, np.nan
    at, upright, outs = rng.integers(0, 3, samples), np.ascontiguousarray(fleet._rows.T), np.empty((samples, 4))
    order, starts = np.argsort(at, kind="stable"), np.append(0, np.bincount(at).cumsum())
    ptx.launch(code, [upright, np.arange(3), starts, order, y, u, outs, fleet._specs, fleet._group[:3]], threads=64)
    for found, expected in ((outs, fleet.advance(at, y, u)), (upright.T, fleet._rows)):
        assert np.array_equal(np.isnan(found), np.isnan(expected))
        size = np.nanmax(abs(expected), axis=0)
        assert np.nanmax(abs(found - expected) / np.where(size > 0, size, 1)) <= tolerance
    assemble(code, tmp_path / "code.ptx")


def assemble(code, path):
    """Assemble it for an H100 and print the registers, if there is an assembler for this version of PTX."""
    path.write_text(code)
    if shutil.which("ptxas"):
        done = subprocess.run(
            ["ptxas", "-arch=sm_90", "-v", "-o", path.with_suffix(".cubin"), path], capture_output=True, text=True
        )
        assert done.returncode == 0 or "Unsupported .version" in done.stderr, done.stderr
        print(*(line for line in done.stderr.splitlines() if "spill" in line or "registers" in line), sep="\n")


def test_where_there_is_no_gpu_it_says_what_to_do(monkeypatch):
    monkeypatch.delenv("NUMBA_ENABLE_CUDASIM", raising=False)
    monkeypatch.setattr(on_gpu, "find_spec", lambda name: None)
    with pytest.raises(dw.InputError, match=r"pip install driftwise\[cuda\]"):
        dw.Fleet(dw.AR(1), device="cuda")
    with pytest.raises(dw.InputError, match="'cpu' or 'cuda', got 'gpu'"):
        dw.Fleet(dw.AR(1), device="gpu")
    with pytest.raises(dw.InputError, match="leave them out"):
        dw.Fleet(dw.AR(1), device="cuda", threads=2)


if __name__ == "__main__":
    simulate(sys.argv[1])
