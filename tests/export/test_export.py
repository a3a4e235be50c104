"""Estimators as C: the same bits as the estimator's own, by strict compilers, and a sentence where there is none."""

import ctypes
import re
import shutil
import subprocess

import numpy as np
import pytest

import driftwise as dw
from driftwise.engine import compile
from driftwise.engine.dispatch import written
from driftwise.export import host
from driftwise.export.folder import source_of
from driftwise.export.host import Library
from driftwise.export.readme import errors
from driftwise.export.record import record
from driftwise.export.single import KINDS

STRICT = ("-Wall", "-Wextra", "-Werror", "-pedantic", "-Wfloat-conversion", "-Wdouble-promotion")
C = [name for name in ("gcc", "clang") if shutil.which(name)]
LEVELS = dict(zip(C, ("-O1", "-O0")))  # some of gcc's warnings need its optimisation, none of clang's does
needs_gcc = pytest.mark.skipif(not C, reason="no gcc and no clang: WHAT IS EXPORTED WAS NOT COMPILED")
PLANT = dw.Plant([[0, 1], [-2, -0.5]], [0, 1], [1, 0])
CASES = {
    "arx": dw.ARX(2, 2),
    "ar": dw.AR(2),
    "two_inputs": dw.ARX(2, (2, 1), (1, 0), offset=True, gate=dw.InnovationGate(4.0)),
    "restart": dw.ARX(2, 2, memory=dw.RestartOnChange()),
    "automatic": dw.ARX(2, 2, memory=dw.AutoMemory()),
    "instruments": dw.ARX(2, 2, method="iv"),
    "regression": dw.Regression(["slope", "an odd name", "an-odd-name"], memory=dw.ExponentialForgetting(0.98)),
    "armax": dw.ARMAX(2, 2, 1),
    "joint": dw.Joint(2, 1),
    "polynomial": dw.Joint(2, 1, noise=dw.models.UnknownPolynomial()),
    "several": dw.ARXMIMO(2, 1),
    "joint_mimo": dw.JointMIMO((2, 1), inputs=2),
    "continuous": dw.ContinuousJoint(2, inputs=1),
    "observer": dw.WindowObserver(PLANT, 2.0, dt=0.1, hold="zoh", noise_std=0.1),
    "state_space": dw.StateSpace([[1, 1], [0, 1]], [[0.5], [1]], H=np.eye(2), Q=[0, 0.1], R=[1.0, 2.0], P0=10.0),
}
FLOATS = {
    "constant": dw.Constant(),
    "exponential": dw.ExponentialForgetting(0.97),
    "gain": dw.memory.GainFloor(40),
    "variable": dw.memory.VariableForgetting(50),
    "directional": dw.memory.DirectionalForgetting(0.95),
    "walk": dw.RandomWalk(1e-4),
    "restart": dw.RestartOnChange(),
    "level": dw.RestartOnChange(dw.PageHinkley(threshold=3.0), settle=12),
}


@pytest.fixture(scope="module", autouse=True)
def no_board():
    """Boards have tests of their own; bits are the same at any level of optimisation, and -O0 compiles fastest."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("driftwise.export.readme.GCC", "")
        patch.setattr(host, "FLAGS", tuple(flag.replace("-O2", "-O0") for flag in host.FLAGS))
        yield


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """Return the folder that a case is exported to, once for all who read it."""
    made = tmp_path_factory.mktemp("exported")

    def export(name):
        if not (made / name).exists():
            CASES[name].export(made / name, name=name)
        return made / name

    return export


def run(*command, folder):
    """Run a command that must succeed; return what it prints."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def sources(est, folder, state=None, **options):
    """Write an estimator's C; return what it was made of."""
    source = source_of(est, est.start() if state is None else state, "pump", **options)
    (folder / "pump.c").write_text(source.source())
    (folder / "pump.h").write_text(source.header())
    return source


def library(est, folder, state=None, **options):
    """Return an estimator's C on this machine."""
    return Library(sources(est, folder, state, **options), folder)


@needs_gcc
@pytest.mark.parametrize("name", CASES)
def test_its_test_finds_the_bits_of_the_estimator(name, exported, tmp_path):
    folder = exported(name)
    assert {file.name for file in folder.iterdir()} == {f"{name}.c", f"{name}.h", f"test_{name}.c", "README.md"}
    assert re.findall(r"#include.*", (folder / f"{name}.c").read_text()) == [f'#include "{name}.h"']
    files = folder / f"test_{name}.c", folder / f"{name}.c"
    for cc, level in LEVELS.items():
        run(cc, "-std=c99", level, *STRICT, *files, "-lm", folder=tmp_path)
        assert run("./a.out", folder=tmp_path) == "OK\n"


@needs_gcc
@pytest.mark.parametrize("name", ["arx", "automatic", "joint_mimo"])
def test_it_is_cplusplus_too(name, exported, tmp_path):
    folder, sketch = exported(name), tmp_path / "sketch.cpp"
    sketch.write_text(f'#include "{name}.h"\nstruct {name}_state s;\nvoid go() {{ {name}_init(&s); }}\n')
    for cc in ("g++", "clang++"):
        if shutil.which(cc):
            run(cc, "-x", "c++", "-std=c++17", *STRICT, "-fsyntax-only", f"-I{folder}", folder / f"{name}.c", sketch,
                folder=tmp_path)  # fmt: skip


@needs_gcc
@pytest.mark.parametrize("name", ["arx", "restart", "joint"])
def test_it_goes_on_from_a_state_as_the_estimator_does(name, tmp_path, monkeypatch):
    monkeypatch.setenv("DRIFTWISE_ENGINE", "python")
    est, samples = CASES[name], record(CASES[name], CASES[name].start(), 400)
    state = est.scan(samples[:300, 0], samples[:300, 1]).state
    made = library(est, tmp_path, state)
    shown = made.run(samples[300:])
    for out, sample in zip(shown, samples[300:]):
        state, step = est.update(state, *sample)
        np.testing.assert_array_equal(out[:4], [step.prediction, step.innovation, step.variance, step.status])
    np.testing.assert_array_equal(made.row, state.reshape(1).view(float))


@needs_gcc
@pytest.mark.parametrize("name", ["forgets", "clock"])
def test_a_state_beyond_every_number_begins_afresh_and_says_so(name, tmp_path, monkeypatch):
    """At the sample, and with the bits, at which the estimator does."""
    monkeypatch.setenv("DRIFTWISE_ENGINE", "python")
    forgets = dw.ARX(2, 2, memory=dw.ExponentialForgetting(0.05))
    est = forgets if name == "forgets" else CASES["continuous"]
    samples = record(est, est.start(), 160)
    state, made = est.start(), library(est, tmp_path)
    if name == "forgets":  # what it makes of these is infinite
        samples[50:150, :2] = 1e45
    else:
        state["theta"] = np.nan
        made = library(est, tmp_path, state)
    shown = made.run(samples)
    said = []
    with np.errstate(all="ignore"):
        for sample in samples:
            state, step = est.update(state, *sample[:2], **({"time": sample[2]} if est.takes_instants else {}))
            said.append([step.prediction, step.innovation, step.variance, step.status])
    np.testing.assert_array_equal(shown[:, :4], said)
    np.testing.assert_array_equal(made.row, state.reshape(1).view(float))
    assert (shown[:, 3].astype(int) & dw.Status.LOST).any() and np.isfinite(shown[-1]).all()


@needs_gcc
def test_a_copy_is_a_snapshot_and_what_is_asked_is_there(tmp_path):
    est = CASES["restart"]
    made, samples = library(est, tmp_path), record(est, est.start(), 300)
    shown = made.run(samples)
    kept = made.state.copy()
    made.run(samples[::-1])
    made.state[:] = kept
    ask = ctypes.CDLL(str(made.path))
    for function in ("prediction", "variance", "parameter", "parameter_std"):
        getattr(ask, f"pump_{function}").restype = ctypes.c_double
    assert ask.pump_prediction(made.place) == shown[-1, 0] and ask.pump_variance(made.place) == shown[-1, 2]
    assert ask.pump_status(made.place) == shown[-1, 3]
    first, N = est.n_columns, len(est.names)
    assert [ask.pump_parameter(made.place, i) for i in range(N)] == shown[-1, first : first + N].tolist()
    assert [ask.pump_parameter_std(made.place, i) for i in range(N)] == shown[-1, first + N :].tolist()
    assert np.isnan([ask.pump_parameter(made.place, i) for i in (-1, N)]).all()
    text = (tmp_path / "pump.h").read_text()
    assert "#define PUMP_A1 0" in text and "#define PUMP_B2 3" in text and "#define PUMP_JUMP 32UL" in text


@needs_gcc
def test_nothing_is_kept_outside_a_state_and_no_library_is_called(exported, tmp_path):
    file = exported("automatic") / "automatic.c"
    run(C[0], "-std=c99", "-O0", "-fno-math-errno", "-c", file, "-o", "pump.o", folder=tmp_path)
    symbols = run("nm", "pump.o", folder=tmp_path)
    assert not re.findall(r" [bBdDcC] ", symbols)
    assert set(re.findall(r" U (\w+)", symbols)) <= {"memset", "memcpy", "sqrt"}
    assert {name for name in re.findall(r" T (\w+)", symbols) if not name.startswith("automatic_")} == set()


def test_means_alone_cost_less():
    est = CASES["arx"]
    whole, less = (source_of(est, est.start(), "pump", keep) for keep in ("std", "means"))
    assert "_std" in whole.header() and "_std" not in less.header() and less.columns == whole.columns - 4
    assert (
        "#define PUMP_AN_ODD_NAME_2 2" in source_of(CASES["regression"], CASES["regression"].start(), "pump").header()
    )


# --- single precision ------------------------------------------------------------------------------------------


@needs_gcc
@pytest.mark.parametrize("name", FLOATS)
def test_single_precision_is_close_to_double(name, tmp_path):
    for est in (dw.ARX(2, 2, memory=FLOATS[name]), *([dw.Joint(2, 1)] if name == "constant" else [])):
        source = sources(est, tmp_path, is_single=True)
        assert {type(policy).__name__ for policy in est.policies} <= KINDS
        found = errors(source, tmp_path)
        assert found["estimates"] < 1e-4 and found["deviations"] < 1e-5 and found["predictions"] < 1e-5
        assert found["status"] <= 1


@needs_gcc
def test_single_precision_scales_with_its_data(tmp_path):
    """Units are powers of two: every bit stays, as long as no number leaves the range."""
    est = dw.ARX(2, 2, memory=dw.ExponentialForgetting(0.98))
    samples = record(est, est.start(), 300)
    shown = library(est, tmp_path, is_single=True).run(samples)
    for power in (-20, 12):
        unit = 2.0**power
        other = est.replace(y_scale=unit, u_scale=unit)
        scaled = library(other, tmp_path, is_single=True).run(samples * unit)
        np.testing.assert_array_equal(scaled[:, 0], shown[:, 0] * unit)
        np.testing.assert_array_equal(scaled[:, est.n_columns :], shown[:, est.n_columns :])


@needs_gcc
@pytest.mark.parametrize("est", [dw.ARX(2, 2), dw.Joint(2, 1)], ids=["arx", "joint"])
def test_single_precision_takes_what_is_absurd_for_missing(est, tmp_path):
    made, samples = library(est, tmp_path, is_single=True), record(est, est.start(), 200)
    samples[50:60, 0], samples[70, 0], samples[71, 1] = np.nan, np.inf, -1e30
    samples[150, 0] = 8e8  # large, and yet a number
    shown = made.run(samples)
    status = shown[:, est.columns["status"].start].astype(int)
    assert status[70] & dw.Status.BAD_VALUE and status[71] & dw.Status.BAD_VALUE
    assert np.isfinite(shown[:, 0]).all() and np.isfinite(shown[:, est.n_columns :]).all()


@needs_gcc
def test_single_precision_begins_afresh_where_it_is_no_number_any_more(tmp_path):
    est = dw.ARX(2, 2)
    state = est.start()
    state["theta"] = np.nan
    shown = library(est, tmp_path, state, is_single=True).run(record(est, state, 60))
    status = shown[:, est.columns["status"].start].astype(int)
    assert np.flatnonzero(status & dw.Status.LOST).tolist() == [0] and np.isfinite(shown[-1]).all()


@needs_gcc
def test_single_precision_has_no_number_of_double(tmp_path):
    for est in (dw.ARX(2, 2, memory=dw.RestartOnChange()), dw.Joint(2, 1), dw.ARMAX(2, 2, 1)):
        est.export(tmp_path, name="pump", precision="single")
        for cc, level in LEVELS.items():
            run(cc, "-std=c99", level, *STRICT, "test_pump.c", "pump.c", "-lm", folder=tmp_path)
            assert run("./a.out", folder=tmp_path) == "OK\n"
        assert not re.search(
            r"\d\.\d+(e[-+]?\d+)?[^\dFe]", re.sub(r"/\*.*?\*/", "", (tmp_path / "pump.c").read_text(), flags=re.S)
        )


# --- what is refused -------------------------------------------------------------------------------------------

ARX = CASES["arx"]
REFUSED = {
    "needs a host": lambda folder: dw.ModelAverage([dw.ARX(1, 1)]).export(folder),
    "first samples needs a host": lambda folder: dw.ARX(2, 2, start="algebraic").export(folder),
    "one state is exported": lambda folder: ARX.export(folder, ARX.start(3)),
    "another estimator": lambda folder: ARX.export(folder, dw.ARX(3, 3).start()),
    "language": lambda folder: ARX.export(folder, language="fortran"),
    "name must be a name in C": lambda folder: ARX.export(folder, name="int"),
    "name must be": lambda folder: ARX.export(folder, name="my pump"),
    "precision": lambda folder: ARX.export(folder, precision="half"),
    "keep must be": lambda folder: ARX.export(folder, keep="covariance"),
    "AutoMemory is not exported in single": lambda folder: CASES["automatic"].export(folder, precision="single"),
    "wide as the noise": lambda folder: dw.Joint(2, 1, P0=1e9).export(folder, precision="single"),
}


@pytest.mark.parametrize("words", REFUSED)
def test_it_is_refused_in_a_sentence(words, tmp_path):
    with pytest.raises(dw.InputError, match=re.escape(words)) as refusal:
        REFUSED[words](tmp_path / "made")
    assert "\n" not in str(refusal.value) and not (tmp_path / "made").exists()


def test_a_step_that_cannot_be_translated_is_named(tmp_path, monkeypatch):
    from driftwise.engine.dispatch import advance

    kind = type(ARX.policies[0])
    step = written("def step(form, n, m, g, s, d, state, scratch, y, u, out, t):\n    out[t, 0] = [1.0][0]", "step", {})
    monkeypatch.setitem(advance.table, kind, step)
    with pytest.raises(dw.InputError, match=r"cannot be translated: .*a list is not in the kernels' part of Python"):
        ARX.export(tmp_path)


# --- the command -----------------------------------------------------------------------------------------------


def test_the_command_exports_a_spec_and_a_state(call, tmp_path):
    code, out, _ = call("export", "arx:2,2@restart", "-i", "heater", "--out", tmp_path / "a", "--name", "pump")
    assert code == 0 and "pump.h" in out and "RestartOnChange" in (tmp_path / "a" / "README.md").read_text()
    est = dw.ARX(1, 1)
    state = est.start()
    state["theta"] = 0.125, 7.0
    dw.save_state(est, state, tmp_path / "state.json")
    assert call("export", tmp_path / "state.json", "--out", tmp_path / "b")[0] == 0
    assert re.search(r"= 0\.125;\s+state->row\[\d+\] = 7\.0;", (tmp_path / "b" / "driftwise.c").read_text())


def test_the_command_refuses_in_a_sentence(call, tmp_path):
    (tmp_path / "file").touch()
    for words, given in {
        "which column is it": ("arx:2,2", "--out", tmp_path),
        "there is no file": ("gone.json", "--out", tmp_path),
        "this is a file": ("ar:2", "--out", tmp_path / "file"),
        "not exported in single": ("ar:2@auto", "--out", tmp_path / "c", "--float"),
    }.items():
        code, _, err = call("export", *given)
        assert code in (1, 2) and words in err, (given, err)
    assert not (tmp_path / "c").exists()


def test_compiled_loops_are_not_needed(tmp_path, monkeypatch):
    monkeypatch.setattr(compile, "_load", None)
    ARX.export(tmp_path)
