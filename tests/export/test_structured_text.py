"""Structured Text: the interpreted block gives the bits of the estimator, and its test says so."""

import re

import numpy as np
import pytest
from st_interpreter import Parser, instance

import driftwise as dw
from driftwise.detect import GLR, PageHinkley, ScoreCUSUM
from driftwise.engine import compile
from driftwise.engine.elementary import exp, log
from driftwise.engine.errors import InputError
from driftwise.export.record import record
from driftwise.export.structured_text import FunctionBlock
from driftwise.memory import CovarianceInflation, GainReset

RESTART = dw.RestartOnChange()
NAMED = dw.RestartOnChange(detector=ScoreCUSUM(), response=CovarianceInflation(only_named=True))
ESTIMATORS = {
    "arx": dw.ARX(2, 2),
    "arx restart": dw.ARX(2, [2, 1], nk=[1, 0], memory=RESTART, gate=dw.InnovationGate(4.0)),
    "arx gain reset": dw.ARX(2, 2, memory=dw.RestartOnChange(response=GainReset(10.0))),
    "arx page hinkley": dw.ARX(2, 2, memory=dw.RestartOnChange(detector=PageHinkley())),
    "arx glr": dw.ARX(1, 1, memory=dw.RestartOnChange(detector=GLR())),
    "arx exponential": dw.ARX(2, 2, offset=True, memory=dw.ExponentialForgetting(0.95)),
    "arx hold": dw.ARX(2, 2, missing="hold", variance=0.01),
    "arx skip": dw.ARX(2, 2, missing="skip"),
    "ar": dw.AR(2),
    "joint": dw.Joint(2),
    "joint restart": dw.Joint(2, 2, direct=True, memory=RESTART),
    "joint walk": dw.Joint(3, memory=dw.RandomWalk(1e-5), gate=dw.InnovationGate(4.0)),
    "joint without inputs": dw.Joint(1, 0),
    "regression": dw.Regression(2),
    "regression exponential": dw.Regression(2, offset=True, memory=dw.ExponentialForgetting(0.98)),
    "regression walk": dw.Regression(["slope", "other"], memory=dw.RandomWalk(matched=(0.5, 100))),
    "regression restart": dw.Regression(2, memory=NAMED),
}


def arguments(sample):
    """Return a sample as the block takes it: what is missing is zero, and said to be missing."""
    y, *u = [float(v) for v in np.nan_to_num(sample)]
    is_well, *u_well = [bool(v == v) for v in sample]
    given = dict(y=y, y_valid=is_well)
    if u:
        given |= dict(u=u[0], u_valid=u_well[0]) if len(u) == 1 else dict(u=u, u_valid=u_well)
    return given


def same(a, b):
    return np.array_equal(a, b, equal_nan=True) and np.array_equal(np.signbit(a[a == a]), np.signbit(b[b == b]))


@pytest.mark.parametrize("title", ESTIMATORS)
def test_bits_of_the_estimator(title):
    """Every output and the whole state after every sample: gaps, outliers, a jump, a value that no sensor gives."""
    est = ESTIMATORS[title]
    samples = record(est, est.start(), 300)
    samples[100:112, 0], samples[150, 0] = np.nan, 1e70
    block, keep = FunctionBlock(est, name="trial"), "std"
    unit = instance(block.text, name="trial")
    rows, outs = est._rows(est.start()), np.empty((1, 1, est.table_width(keep)))
    drive, jumps = compile.plain_driver(*map(type, est.policies)), 0
    for t, sample in enumerate(samples):
        with np.errstate(all="ignore"):
            drive(rows, sample[:1].reshape(1, 1, 1), sample[1:].reshape(1, 1, -1), outs, est.spec, est.scratch())
        unit(**arguments(sample))
        assert same(unit.numbers(block.state_names), rows[0]), t
        assert same(unit.numbers(block.output_names), outs[0, 0]), t
        assert unit["status"] == outs[0, 0, est.columns["status"]] and unit["is_missing"] == bool(unit["status"] & 1)
        jumps += unit["has_jumped"]
    assert jumps > 0 or title not in ("arx gain reset", "arx glr", "joint restart")


def test_begins_with_the_state_of_a_run_and_anew():
    est = dw.ARX(2, 2, memory=RESTART)
    samples = record(est, est.start(), 80)
    numbers = est._rows(est.start())[0] + np.arange(est.dtype.itemsize // 8) / 7
    state = numbers.view(est.dtype)[0]
    block = FunctionBlock(est, state, "trial", keep="means")
    unit, fresh = (instance(block.text, name="trial") for _ in range(2))
    assert block.output_names[-1] == "parameters"
    for sample in samples[:40]:
        unit(**arguments(sample))
    for t, sample in enumerate(samples[40:]):
        unit(reset=t == 0, **arguments(sample))
        fresh(**arguments(sample))
        assert same(unit.numbers(block.state_names), fresh.numbers(block.state_names))


def test_elementary_functions():
    parser = Parser(FunctionBlock(dw.ARX(2, 2, memory=RESTART), name="trial").text)
    rng = np.random.default_rng(0)
    for x in [*10.0 ** rng.uniform(-323, 308, 300), *rng.uniform(0.3, 3.0, 300), 0.5, 1.0, 2.0, 5e-324, 1.7e308]:
        assert parser.call("trial_log", x=float(x)) == log(float(x))
    for x in [*rng.uniform(-745, 0, 300), 0.0, -1e-9, -800.0]:
        assert parser.call("trial_exp", x=float(x)) == exp(float(x))


@pytest.mark.parametrize("title", ["arx", "joint restart"])
def test_the_test_that_goes_with_it(title, tmp_path):
    """It says that all is well, and where not: another estimator's answers."""
    files = ESTIMATORS[title].export(tmp_path, language="st", name="pump")
    assert [file.name for file in files] == ["pump.st", "pump_test.st", "README.md"]
    text, trial, about = (file.read_text() for file in files)
    for changed, is_well in ((text, True), (re.sub(r"prediction := (\w+);", r"prediction := 1.5 * \1;", text), False)):
        unit = instance(changed, trial, name="pump_test")
        for _ in range(101):
            assert not unit["done"] or _ == 100
            unit()
        assert unit["done"] and (unit["differences"] == 0) == is_well and (unit["first"] == -1) == is_well
    assert "FUNCTION_BLOCK" in about and "pump_test" in about
    assert max(map(len, text.splitlines())) <= 140


@pytest.mark.slow
def test_another_parser_takes_it():
    """The grammar of blark, which is TwinCAT's; it takes its time."""
    blark = pytest.importorskip("blark.parse")
    assert blark.parse_source_code(FunctionBlock(dw.Joint(1, 0), name="trial").text).exception is None


def test_refusals(tmp_path):
    for est, said in (
        (dw.ARX(2, 2, memory=dw.AutoMemory()), "memories Constant, .* not for AutoMemory"),
        (dw.JointMIMO(2, 1, 2), "not for JointMIMO: export C"),
    ):
        with pytest.raises(InputError, match=said):
            est.export(tmp_path, language="st")
    for name in ("VAR", "two__bars", "_front", "behind_", "1st"):
        with pytest.raises(InputError, match="name must be"):
            dw.ARX(1, 1).export(tmp_path, language="st", name=name)
    with pytest.raises(InputError, match="double precision"):
        dw.ARX(1, 1).export(tmp_path, language="st", precision="single")
    assert not list(tmp_path.iterdir())


def test_the_command_writes_what_the_library_does(call, tmp_path):
    st = "--language", "st", "--name", "pump", "--out"
    code, said, _ = call("export", "arx:2,2@restart", "-i", "valve", *st, tmp_path / "spec")
    assert code == 0 and "pump_test.st" in said
    est = dw.ARX(2, (2,), memory=RESTART, u_scale=[1.0])
    state = est.start()
    state["theta"] = 0.125, 7.0, 0.0, 0.0
    dw.save_state(est, state, tmp_path / "state.json")
    assert call("export", tmp_path / "state.json", *st, tmp_path / "state")[0] == 0
    for folder, given in (("spec", (est, None)), ("state", dw.load_state(tmp_path / "state.json"))):
        for file in given[0].export(tmp_path / "library", given[1], language="st", name="pump"):
            assert (tmp_path / folder / file.name).read_bytes() == file.read_bytes()
    assert "estimate[1] := 7.0;" in (tmp_path / "state" / "pump.st").read_text()


def test_the_command_refuses_in_a_sentence(call, tmp_path):
    for words, given in {
        "--float has no meaning with --language st": ("ar:2@constant", "--float", "--language", "st"),
        "language must be one of c, st": ("ar:2@constant", "--language", "lisp"),
        "not for AutoMemory: export C": ("ar:2@auto", "--language", "st"),
    }.items():
        code, _, err = call("export", *given, "--out", tmp_path / "made")
        assert code in (1, 2) and words in err
    assert not (tmp_path / "made").exists()
