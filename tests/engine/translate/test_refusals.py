"""What kernels may not contain is refused with file, line, what stands there, and what to write instead."""

import warnings
from typing import NamedTuple

import numpy as np
import pytest
from in_c import translated

from driftwise.detect.watch import watch
from driftwise.engine import compile, dispatch
from driftwise.engine.translate.refusal import Refusal

SCOPE = {"np": np, "T": ((1.0, 2.0), (3.0, 4.0)), "other": lambda x: x}
CONSTRUCTS = {
    "x = [1.0, 2.0]": "a list",
    "x = {1: 2}": "a dict",
    "x = {1, 2}": "a set",
    "x = sum(v[i] for i in range(3))": "a generator",
    "x = [v[i] for i in range(3)]": "a list comprehension",
    "yield v[0]": "a generator",
    "x = lambda y: y": "a lambda",
    "def f(y): return y": "a function inside",
    "class A: pass": "a class inside",
    "try:\n        v[0] = 1.0\n    except ValueError:\n        pass": "try",
    "raise ValueError": "raise",
    "assert v[0] > 0": "assert",
    "with x: pass": "with",
    "import math": "import",
    "del x": "del",
    "global x1": "global",
    "x: float = 1.0": "a type",
    "x = f'{x}'": "a text",
    "x = (y := 1.0)": "an assignment inside",
    "match k:\n        case 1: pass": "match",
    "x = 'a'.upper()": "str.upper is not known to kernels",
    "x = max(v[0], key=abs)": "given by place",
    "x = max(*v)": "given by place",
    "x = g(v, x)": "g calls itself; write a loop",
    "x = plain(x)": "plain is not a kernel; mark it with @kernel",
    "x = np.sin(x)": "is not known to kernels",
    "x = sum(v)": "sum is not known to kernels",
    "print(x)": "print is not known to kernels",
    "v = 1.0": "v is a view of 1 dimension and later a float; take two names",
    "y = 1.0\n    y = v": "y is a float and later a view of 1 dimension; take two names",
    "y = v if x > 0 else 1.0": "one way gives a view of 1 dimension, the other a float",
    "x = v[x]": "an integer is wanted; write int(..)",
    "x = v[1.5]": "an integer is wanted; write int(..)",
    "x = x % 2.0": "% is for integers",
    "x = v * 2.0": "* is for numbers; what holds several is gone through in a loop",
    "x = -v": "a sign is for numbers",
    "x = v.sum()": "a view has a size and a shape, but no sum; write a loop",
    "x = v.T": "no T",
    "x = v[::2]": "a slice has no step here",
    "v[0:2] += 1.0": "a stretch here",
    "v[0:2] = v[1:3]": "a stretch is filled with one number",
    "x = v[0, 0]": "a view of 1 dimensions",
    "x = x is None": "is is not in the kernels' part of Python",
    "x = k in (1, 2)": "in is not in",
    "x = v @ v": "@ of matrices",
    "x = ~k": "~ is not in",
    "x = x or 1.0": "give back an operand",
    "x = nobody": "nobody is not known",
    "y += 1.0": "y is read above the line that gives it a value",
    "x = v.reshape(-1, 2)[0, 0]": "a size is not negative",
    "x = T[k]": "x is",
    "x = (v, x)[k]": "chosen by a number that is known",
    "x = int()": "int takes one argument here",
    "x = len(x)": "len is for views and tuples",
    "x = max(v)": "max is for numbers",
    "x = abs(v)": "abs is for numbers",
    "x = max()": "max takes one argument here",
    "for i in v: pass": "a loop counts through a range or takes the items of a tuple",
    "for i in range(3): pass\n    else: pass": "no else here",
    "for i in range(0, 3, k): pass": "the step of a range is a number that is known",
    "for y in (1.0, 2.0):\n        break": "a loop over a tuple is not left early",
    "a, b, c = 1.0, 2.0": "as many values as names",
    "if x > 0:\n        return x\n    if x < 0:\n        return v": "it returns a float and a view of 1 dimension",
}


def plain(x):
    return x


@pytest.mark.parametrize("line", CONSTRUCTS, ids=lambda line: line.split("\n")[0])
def test_a_construct_is_refused_in_a_sentence(line):
    scope = {**SCOPE, "plain": plain}
    text = f"def f(v, k, x):\n    g(v, x)\n\ndef g(v, x):\n    k = int(x)\n    {line}\n"
    scope["f"] = entry = dispatch.written(text, "f", scope)
    with pytest.raises(Refusal) as refusal:
        translated(entry, (1, int, float), [scope["g"]])
    said = str(refusal.value)
    where, _, words = said.partition(": ")
    assert CONSTRUCTS[line] in said
    assert where.startswith("<f number ") and int(where.split(", line ")[1]) in range(4, 10)
    assert "not understood" not in said and "Traceback" not in said and "Known(" not in said and "View(" not in said
    assert len(words) < 200


def test_parameters_are_plain():
    for text in ("def f(x=1.0): pass", "def f(*x): pass", "def f(x, *, y): pass"):
        with pytest.raises(Refusal, match="neither defaults nor stars"):
            translated(dispatch.written(text + "\n", "f", {}), (float,))
    with pytest.raises(Refusal, match="takes 1 arguments and is given 2"):
        translated(dispatch.written("def f(x): pass\n", "f", {}), (float, float))


def test_a_source_that_is_not_to_be_had():
    scope = {}
    exec("def f(x): pass", scope)
    with pytest.raises(Refusal, match="source of f is not to be had"):
        translated(scope["f"], (float,))
    with pytest.raises(Refusal, match="lambda"):
        translated(lambda x: x, (float,))


class Own(NamedTuple):
    """A detector of one's own, with what C has no word for."""

    threshold: float


@watch.on(Own)
def watch_own(detector, detector_state, z, slope):
    try:
        return 1.0 if abs(z) > detector.threshold else 0.0
    except ValueError:
        return 0.0


def test_a_policy_of_ones_own_is_named_and_runs_as_python(monkeypatch):
    monkeypatch.setenv("DRIFTWISE_ENGINE", "c")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        look = compile.watcher(Own)
    (said,) = [str(one.message) for one in caught]
    line = watch_own.__code__.co_firstlineno + 2
    assert (
        f"test_refusals.py, line {line}: try is not in the kernels' part of Python" in said and "plain Python" in said
    )
    outs = np.zeros((1, 3, 1))
    look(np.zeros((1, 1)), np.array([[0.5, -3.0, 2.5]]), np.zeros((1, 3, 0)), outs, np.array([2.0]))
    assert outs[0, :, 0].tolist() == [0.0, 1.0, 1.0]
