"""What is said of a record does not depend on the unit of its numbers, however large or small they are."""

import re
import warnings

import numpy as np
import pytest
from typer.testing import CliRunner

from driftwise.cli.main import app

ROWS = 300
SIZES = [(98, 98), (-200, 0), (0, -300)]


def written(path, y_size, u_size):
    """Write a record of a gain that jumps, its columns in units of any size."""
    rng = np.random.default_rng(3)
    u = np.repeat(rng.choice([-1.0, 1.0], ROWS // 6), 6)
    y = np.zeros(ROWS)
    for k in range(1, ROWS):
        y[k] = 0.8 * y[k - 1] + (0.7 if k > 180 else 0.5) * u[k - 1] + 0.05 * rng.standard_normal()
    rows = (f"{k},{a * 2:g}e{u_size},{b + 4:.6f}e{y_size}" for k, (a, b) in enumerate(zip(u, y)))
    path.write_text("\n".join(["t,u,y", *rows]))
    return str(path)


def said(*args):
    """Return what a command prints, and the units that it says columns are counted in."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        done = CliRunner().invoke(app, [*args, "-o", "y", "-i", "u"])
    assert done.exit_code == 0, done.output
    words = " ".join(re.sub(r"took \S+ s", "", done.output).replace("\u2212", "-").split())
    tens = re.findall(r"'(.)' is counted in units of 1e(-?\d+)\.", words)
    words = re.sub(r"(note: |Beware: )?'.' is counted in units of \S+ ?|Beware: ", "", words)
    return words.strip(), {name: int(ten) for name, ten in tens}


@pytest.mark.parametrize(
    "command, sizes",
    [
        ("run", SIZES[:1]),
        ("validate --model arx:1,1,1", SIZES),
        ("run --model armax:1,1,1,1", SIZES),
    ],
)
def test_words_do_not_depend_on_units(tmp_path, command, sizes):
    name, *more = command.split()
    plain, _ = said(name, written(tmp_path / "p.csv", 0, 0), *more)
    for y_size, u_size in sizes:
        odd, tens = said(name, written(tmp_path / "p.csv", y_size, u_size), *more)
        assert tens == {n: size for n, size in (("y", y_size), ("u", u_size)) if size}
        assert odd == plain
