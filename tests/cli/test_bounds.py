"""Every number has a bound, and a sentence says so: no gigabytes, no traceback, no screens of what was given."""

import resource

import numpy as np
import pytest

import driftwise as dw
from driftwise.engine.bounds import MOST
from driftwise.engine.errors import InputError, brief


@pytest.fixture
def table(tmp_path):
    y, u = dw.simulate([-0.8], [1.0], samples=300, noise_std=0.1, seed=1)
    path = tmp_path / "table.csv"
    np.savetxt(path, np.column_stack([y, u]), "%.5f", ",", header="y,u", comments="")
    return path


@pytest.mark.parametrize(
    ("option", "said"),
    [
        ("--order=10000", "order is at most 200"),
        (f"--order={'9' * 5000}", "order is at most 200"),
        (f"--order={'x' * 5000}", "neither a whole number nor auto"),
        ("--orders=1-999999999999", "--orders must lie between 1 and 30"),
        (f"--orders=1-{'9' * 5000}", "--orders must lie between 1 and 30"),
        ("--model=arx:10000,2,1", "na is at most 1000"),
        (f"--model=arx:2,2,{'9' * 5000}", "nk is at most 1000"),
        ("--model=armax:1000,1000,1000,1", "3001 unknowns, and at most 2000"),
        ("--jumps=glr:10000,9999999999999", "window may be"),
        ("--chunk=99999999999", "--chunk is at most 100000000"),
        (f"--smooth={'9' * 5000}", "lag is at most"),
    ],
)
def test_a_number_beyond_its_bound_is_refused_in_a_sentence(table, call, option, said):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    code, out, complaint = call("run", table, "-o", "y", "-i", "u", option)
    assert (code, out) == (2, "") and said in complaint
    assert complaint.count("\n") == 1 and len(complaint) < 500
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < before + 200_000  # kB


def test_settings_of_a_file_too(table, tmp_path, call):
    plant = "A = [[0.0]]\nB = [[1.0]]\nC = [[1.0]]\n[[disturbance]]\non = [1.0]\ndegree = 100000\n"
    for text, said in (
        ("a = " + "[" * 50_000 + "]" * 50_000, "nested too deep"),
        ("[plant]\nA = [[" + "9" * 6000 + "]]\n", "is not a TOML file"),
        (f"[plant]\n{plant}[observer]\nwindow = 1.0\nnoise_std = 1.0\n", "degree"),
    ):
        path = tmp_path / "plant.toml"
        path.write_text(text)
        code, out, complaint = call("run", table, "-o", "y", "-i", "u", "--dt", "1", "--plant", path)
        assert (code in (1, 2), out) == (True, "") and said in complaint, complaint


def test_in_python_as_well():
    for make, said in (
        (lambda: dw.Joint(10_000), "order is at most 200"),
        (lambda: dw.ARX(2, 2, nk=5000), "nk is at most 1000"),
        (lambda: dw.ARX(1500, 1), "na is at most 1000"),
        (lambda: dw.Joint(200, 20), "4400 unknowns, and at most 2000 are taken"),
        (lambda: dw.ARX(1000, (1000, 500), memory=dw.Constant()), "2500 unknowns, and at most 2000"),
        (lambda: dw.JointMIMO((2,), 5000), "inputs is at most 1000|unknowns"),
    ):
        with pytest.raises(InputError, match=said):
            make()
    assert dw.ARX(2, 2, nk=MOST["nk"]).model.N == 4


# --- what messages repeat of the data --------------------------------------------------------------------------


def test_messages_do_not_repeat_screens_of_a_header(tmp_path, call):
    long = "h" * 2000
    path = tmp_path / "table.csv"
    path.write_text(f"{long},y\n" + "".join(f"{t % 7},{t % 5}\n" for t in range(100)))
    for options in (["-o", long[:-1]], ["-o", "z"], ["-o", "y", "-t", long], ["-o", "y", "-i", long]):
        _, out, complaint = call("run", path, *options)
        assert "hhh" in out + complaint or "z" in complaint
        assert max(map(len, (out + complaint).splitlines()), default=0) <= 1100
        assert long not in complaint
    many = ",".join(f"column {k}" for k in range(3000))
    path.write_text(f"{many}\n" + (",".join("1" * 3000) + "\n") * 9)
    _, _, complaint = call("run", path, "-o", "nowhere")
    assert "nowhere" in complaint and len(complaint) < 3000


def test_a_text_is_cut_where_it_quotes():
    text = f"column 'a' is {'b' * 200!r}, the file's name {'c' * 70!r} isn't \"{'d' * 90}\"; is it?"
    cut = brief(text)
    assert cut.startswith("column 'a' is 'bbb") and cut.endswith("is it?") and "c" * 70 in cut and "d" * 90 not in cut
    assert len(cut) < 330 and brief(cut) == cut and brief("it's fine, isn't it") == "it's fine, isn't it"
    assert (
        str(InputError(f"{'e' * 5000!r}")) == str(InputError(InputError(f"{'e' * 5000!r}")))
        and len(brief("f " * 9999)) <= 2500
    )
