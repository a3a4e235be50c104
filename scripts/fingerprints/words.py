"""What is said of runs, the command line included, and how it is compared."""

from __future__ import annotations

import contextlib
import html
import io
import re
import runpy
import sys
from pathlib import Path

import numpy as np

import driftwise as dw

from .numbers import MEMORIES
from .records import SAMPLES, motion, named_jump, plots, record


def csv(name, columns) -> str:
    """Write a table and return its name."""
    cells = ("" if isinstance(v, float) and np.isnan(v) else str(v) for row in zip(*columns.values()) for v in row)
    rows = zip(*[cells] * len(columns))
    Path(name).write_text("\n".join([",".join(columns), *map(",".join, rows)]) + "\n")
    return name


def plant(samples=SAMPLES, wild=False) -> str:
    """Write a record as a table with a clock and return its name."""
    y, u = record(samples=samples, wild=wild)
    return csv("plant.csv", {"t": (0.5 * np.arange(samples)).tolist(), "u": u.tolist(), "y": y.tolist()})


def said(*arguments) -> str:
    """Return what the command line prints for these arguments, and its pages and results, as text."""
    out, before, code = io.StringIO(), sys.argv, 0
    sys.argv = ["driftwise", *map(str, arguments)]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
            runpy.run_module("driftwise", run_name="__main__")
    except SystemExit as done:
        code = done.code
    finally:
        sys.argv = before
    pages = [bare(path.read_text()) for path in sorted(Path().rglob("*.html"))]
    return "\n".join(
        [f"exit code {code or 0}", out.getvalue(), *pages, *map(Path.read_text, Path().glob("found.json"))]
    )


def bare(page: str) -> str:
    """Return the text of a page without tags, scripts and drawings."""
    page = re.sub(r"<(script|style|svg)\b.*?</\1>", " ", page, flags=re.DOTALL)
    return html.unescape(re.sub(r"<[^>]*>", "\n", page))


def told(est, inputs=1, outputs=1, samples=SAMPLES, wild=False) -> str:
    """Return summary, verdicts and events of a run."""
    trace = est.scan(*record(inputs, outputs, samples, wild=wild))
    events = [f"{event.kind} at {event.sample}: {event.text}" for event in trace.events()]
    return "\n".join([repr(est), trace.summary().words, repr(trace.diagnose()), *events])


def refusals() -> str:
    """Return what is said of settings that cannot be."""
    cases = [
        lambda: dw.ARX(2, 2, memory=dw.ExponentialForgetting),
        lambda: dw.ARX(2, 2, memory=dw.ExponentialForgetting(1.5)),
        lambda: dw.Joint(2, memory=dw.memory.Window(20)),
        lambda: dw.JointMIMO((1, 1), memory=dw.AutoMemory()),
        lambda: dw.ContinuousJoint(1, memory=dw.ExponentialForgetting(0.9)),
        lambda: dw.AdaptiveGain(1.0, memory=dw.memory.FuzzyDrift()),
        lambda: dw.ARX(2, 2, gate=dw.InnovationGate(-1.0)),
        lambda: dw.ARX(2, 2, memory=dw.RestartOnChange(dw.PageHinkley)),
        lambda: dw.ARX(2, 2, memory=dw.RandomWalk()),
        lambda: dw.ARX(2, 2, scale=3.0),
        lambda: dw.ARX(2, 2, method="ml"),
        lambda: dw.Joint(2, noise=dw.models.NoisePolynomial((2.0, 0.0))),
        lambda: dw.Joint(0),
        lambda: dw.ARX(2, 2).scan([1.0]),
        lambda: dw.Joint(2, 1).scan([1.0, 2.0], [1.0]),
        lambda: dw.ARX(2, 2, memory=dw.memory.MultipleModel((0.1,), 2.0)),
        lambda: dw.OE().smooth([1.0], [1.0]),
        lambda: dw.AR(1).update(dw.AR(2).start(), 1.0),
    ]
    found = []
    for case in cases:
        try:
            case()
            found.append("taken")
        except dw.InputError as error:
            found.append(str(error))
    return "\n".join(found)


CART = """[plant]
states = ["position", "speed"]
A = [[0, 1], [0, 0]]
B = [0, 1]
[[disturbance]]
name = "push"
into = [0, 1]
prior_std = inf
[observer]
window = 20
noise_std = 0.05
hold = "zoh"
"""


def cart() -> str:
    """Return what is said of a cart whose equations are known."""
    Path("cart.toml").write_text(CART)
    _, y, u = motion()
    csv("cart.csv", {"t": (0.5 * np.arange(len(y))).tolist(), "pos": y.tolist(), "force": u.tolist()})
    return said("run", "cart.csv", "-o", "pos", "-i", "force", "-t", "t", "--plant", "cart.toml", *PAGES)


def pumps() -> str:
    """Return what is said of a fleet of pumps."""
    said("fleet", "simulate", "pumps", "--series", 20, "--samples", 50)
    columns = ("--by", "asset", "-o", "flow", "-i", "speed", "-t", "time")
    return said(
        "fleet", "run", "pumps", *columns, "--model", "joint:1", "--every", 0, "--out", "out", "--json", "found.json"
    )


PAGES = ("--report", "page.html", "--json", "found.json")
YU = ("-o", "y", "-i", "u", "-t", "t")
WORDS = {
    "run, joint": lambda: said("run", plant(), *YU, *PAGES),
    "run, arx, auto": lambda: said("run", plant(120), *YU, "--model", "arx:2,2,1", *PAGES),
    "run, arx, jumps": lambda: said("run", plant(), *YU, "--model", "arx:2,2", "--jumps", "parameters:1000", *PAGES),
    "run, found out": lambda: said("run", plant(120), *PAGES),
    "run, orders": lambda: said("run", plant(), *YU, "--order", "auto", "--orders", "1-3"),
    "run, plant known": cart,
    "run, smooth": lambda: said("run", plant(80), *YU, "--model", "arx:1,1", "--smooth", "all", *PAGES),
    "compare": lambda: said("compare", plant(), "arx:1,1", "arx:2,2", "ar:2", *YU, *PAGES),
    "track": lambda: said("track", csv("plots.csv", plots(24)), *PAGES),
    "fleet": pumps,
    "wrong commands": lambda: "".join(
        said("run", plant(), "-o", "y", *wrong) for wrong in (["-i", "v"], ["--noise", "pink"], ["--memory", "walk"])
    ),
    "help": lambda: "".join(said(*command, "--help") for command in ([], ["run"], ["fleet", "run"], ["track"])),
    "refusals": refusals,
    "joint": lambda: told(dw.Joint(2, 1)),
    "joint, jumps": lambda: told(dw.Joint(2, 1, memory=dw.RestartOnChange(), gate=dw.InnovationGate()), wild=True),
    "arx": lambda: told(dw.ARX(2, 2)),
    "arx, auto": lambda: told(dw.ARX(2, 2, memory=dw.AutoMemory()), samples=120),
    "arx, score": lambda: told(dw.ARX(2, 2, memory=named_jump())),
    "armax": lambda: told(dw.ARMAX(1, 1, 1, memory=dw.RandomWalk(1e-4))),
    "mimo": lambda: told(dw.JointMIMO((1, 1), 1), 1, 2),
    "arx mimo": lambda: told(dw.ARXMIMO(2, 1, memory=dw.ExponentialForgetting(0.97)), 1, 2),
    "gain": lambda: told(dw.AdaptiveGain(0.9), 0),
    "manoeuvre": lambda: told(dw.tracking.Manoeuvre(), 0),
    "compared": lambda: dw.compare(*record(wild=False), {"first": dw.ARX(1, 1), "none": dw.AR(2)}).words,
    "advised": lambda: repr(
        dw.analysis.advise_window(
            dw.Plant([[0, 1], [0, 0]], [0, 1], states=("position", "speed")),
            dt=0.1,
            noise_std=0.1,
            disturbances=dw.models.Polynomial([0, 1], np.inf),
            windows=[0.5, 1, 2],
            tolerance=[0.1, 0.1],
        )
    ),
    "restart": lambda: dw.detect.design_restart(1.0, 500).words,
    "hindsight": lambda: dw.ARX(1, 1).smooth(*record(samples=80)).words,
    "identifiability": lambda: dw.analysis.identifiability(*record(missing=0.0), order=2).words,
    "reprs": lambda: "\n".join(repr(memory()) for memory in MEMORIES.values()),
    "detectors": lambda: "\n".join(d.words for d in (dw.PageHinkley(), dw.detect.Parity("1 per 5000"))),
}

# What is called otherwise after the change of names: in words to be compared, the left is read as the right. (The ~
# is left out of the old names; it keeps them old where a tool renames all the others in this file.)
NAMES = """
N~ever=Constant  W~eighted=ExponentialForgetting  L~imitedGain=GainFloor  W~alk=RandomWalk  U~ntilJump=RestartOnChange
R~unLengths=BayesianChangePoint  A~uto=AutoMemory  I~nteracting=IMM  B~ank=MultipleModel  C~orrelation=AutocovarianceLS
I~nflate=CovarianceInflation  H~inkley=PageHinkley  S~core=ScoreCUSUM  V~arianceChange=VarianceCUSUM
G~ate=InnovationGate  U~nknownScale=InverseGamma  r~estart=response  t~ick=update_batch
"""
RENAMED = dict(pair.replace("~", "").split("=") for pair in NAMES.split())


def read_alike(text: str) -> str:
    """Return words as they are compared: one clause a line, new names for old, no times, no drawn lines."""
    text = re.sub(rf"\b({'|'.join(RENAMED)})\b", lambda found: RENAMED[found[0]], text)
    text = re.sub(
        r"(?<=Forgetting\()p(?=[=)])|\bp(?= is a weight per sample)", lambda found: found[0].replace("p", "lam"), text
    )
    text = re.sub(r"took \S+ s\b|\S+ (samples|rows)/s|\d+ MB of memory|(?<=seconds\": )[\d.]+", "..", text)
    text = re.sub(r"[\u2500-\u257f]+|driftwise \d\S*|\x1b\[[\d;]*m", " ", text)
    return re.sub(r"(?<=[.:;,}]) ", "\n", " ".join(text.split()))
