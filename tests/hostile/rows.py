"""Faults that a hostile week found, tried again: `python -m tests.hostile.rows` prints each command and its answer.

A row is a command as it failed, what it must say now, and with which exit code; some are a few lines of Python.
"""

from __future__ import annotations

import contextlib
import gzip
import os
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

SMALL = "t,u,y\n" + "".join(f"{t},{(t * 7) % 5 - 2},{0.5 * ((t * 7 - 7) % 5 - 2)}\n" for t in range(60))
LINES = SMALL.splitlines(keepends=True)
PLOTS = "time,lat,lon,id\n" + "".join(f"{4 * i},{46 + 0.005 * i},{15 + 0.004 * i},A\n" for i in range(30))
RUN = "run t.csv -o y -i u --model arx:1,1,1"
USED = "import driftwise as dw, numpy as np; y = np.sin(np.arange(99.0)); u = np.cos(np.arange(99.0) ** 2); "
NUMBERS = "import numpy as np, pyarrow as pa, pyarrow.parquet as pq; t = np.arange(60.0); u = t * 7 % 5 - 2; "


class Row(NamedTuple):
    """A fault: its number, the command (`py:` Python, `sh:` a shell), what it must say, its code, and what it needs."""

    number: str
    fault: str
    command: str
    said: str
    code: int = 0
    make: Callable[[Path], object] = lambda folder: None


def text(**files: str | bytes) -> Callable[[Path], object]:
    """Return what writes files, by their names with _ for the dot."""

    def make(folder: Path):
        for name, content in files.items():
            path = folder / name.replace("_", ".")
            path.write_bytes(content if isinstance(content, bytes) else content.encode())

    return make


def python(code: str) -> Callable[[Path], object]:
    """Return what runs a few lines of Python in the folder."""
    return lambda folder: subprocess.run([sys.executable, "-c", code], cwd=folder, check=True)


def damaged(place: str, command: str) -> Callable[[Path], object]:
    """Return what runs a command, and then cuts a byte out of the middle of what it left at a place."""

    def make(folder: Path):
        text(t_csv=SMALL)(folder)
        environment = {**os.environ, "DRIFTWISE_CACHE": str(folder / "cache")}
        subprocess.run(
            [*DRIFTWISE, *shlex.split(command)], cwd=folder, check=True, capture_output=True, env=environment
        )
        for path in folder.glob(place):
            data = path.read_bytes()
            path.chmod(0o600)
            path.write_bytes(data[: len(data) // 2] + b"?" + data[len(data) // 2 + 1 :])

    return make


DRIFTWISE = [sys.executable, "-m", "driftwise"]
R = '"u" "y"\n' + "".join(f'"{i}" {(i * 7) % 5 - 2} {0.5 * ((i * 7 - 7) % 5 - 2)}\n' for i in range(60))
COMMAS = "t,u,y\n" + "".join(f"{i},{(i * 7) % 5 - 2},0,{5 * (i % 2)}\n" for i in range(60))
FAR = "d,u,y\n" + "".join(f"2024-01-{1 + t // 24:02}T{t % 24:02}:00:00,{line.split(',', 1)[1]}" for t, line in
                          enumerate(LINES[1:]))  # fmt: skip
WIDE = ",".join(f"c{i}" for i in range(20_000)) + "\n" + (",".join(["1"] * 20_000) + "\n") * 3
STEPS = "t,u,y\n" + "".join(f"{1_700_000_000_000 + 60_000 * t},{line.split(',', 1)[1]}" for t, line in
                            enumerate(LINES[1:]))  # fmt: skip
MINUS = SMALL.replace("-", "\u2212")
FLEET = "fleet run f.csv --by k -o y -i u -t t --out o"
KEYS = "t,k,u,y\n" + "".join(f"{t},=1+{t % 2},{(t * 7) % 5 - 2},{(t * 13) % 7}\n" for t in range(400))
DEEP = "[plant]\nF = " + "[" * 50_000
STATE = "from pathlib import Path; est = dw.AR(1); dw.save_state(est, est.scan(y).state, 's.json'); "

ROWS = [
    Row("1", "R's write.table: a name less than cells", RUN, "b1 0.5 \u00b1",
        make=text(t_csv=R)),
    Row("1", "decimal commas in comma-separated rows", RUN, "cells", 1, text(t_csv=COMMAS)),
    Row("2", "a NUL byte in a line that is followed", "sh: cat p.csv | driftwise track - --follow --report p.html",
        "report in p.html", make=text(p_csv=PLOTS.replace("46.05,", "46\x00.05,"))),
    Row("3", "a used estimator in another process", f"py: {USED}import pickle, subprocess, sys; est = dw.ARX(1, 1); "
        "est.scan(y, u); open('e', 'wb').write(pickle.dumps(est)); print(subprocess.run([sys.executable, '-c', "
        "'import pickle; print(pickle.load(open(\"e\", \"rb\")))'], capture_output=True, text=True))", "ARX(na=1)"),
    Row("4", "a date of the year 9999", "run t.csv -o y -i u -t d --model arx:1,1,1", "samples",
        make=text(t_csv=FAR.replace("2024-01-02T05", "9999-12-31T05"))),
    Row("4", "the same in Parquet", "run t.parquet -o y -i u -t d --model arx:1,1,1", "samples", make=python(
        NUMBERS + "import datetime; d = [datetime.datetime(2024, 1, 1) + datetime.timedelta(hours=i) for i in "
        "range(60)]; d[29] = datetime.datetime(9999, 12, 31); pq.write_table(pa.table({'d': pa.array(d, "
        "pa.timestamp('us')), 'u': u, 'y': u * .5}), 't.parquet')")),
    Row("5", "a full disk, and a report that was there", f"sh: ulimit -f 1; driftwise {RUN} --report r.html; "
        "code=$?; cat r.html; exit $code", "r.html: File too large", 1, text(t_csv=SMALL, r_html="<html>old</html>")),
    Row("6", "damaged compiled loops", f"sh: DRIFTWISE_CACHE=$PWD/cache driftwise {RUN}", "ARX 1,1,1",
        make=damaged("cache/**/*.so", RUN)),
    Row("7", "a pipe with a name", "sh: mkfifo p; cat t.csv > p & driftwise run p -o y -i u --model arx:1,1,1",
        "60 samples", make=text(t_csv=SMALL)),
    Row("8", "a name twice in Parquet", "run t.parquet -o y -i u --model arx:1,1,1", "60 samples", 0, python(
        NUMBERS + "pq.write_table(pa.Table.from_arrays([pa.array(u), pa.array(u), pa.array(u)], ['y', 'u', 'y']), "
        "'t.parquet')")),
    Row("9", "20 000 columns", "run t.csv", "", 1, text(t_csv=WIDE)),
    Row("9", "a header without end", "run t.csv -o y", "", 1, text(t_csv="a" * (1 << 19) + ",y\n1,2\n" * 9)),
    Row("9", "a bomb of gzip", "track p.csv.gz", "unpacks to more than", 1,
        lambda folder: (folder / "p.csv.gz").write_bytes(gzip.compress(b"0" * (200 << 20), 9))),
    Row("10", "latin-1 with a ragged row", RUN, "samples", make=text(
        t_csv=SMALL.replace("\n20,", "\nK\u00f6ln,\u00e4,1,2,3\n20,").encode("latin-1"))),
    Row("11", "a damaged part of the estimates", f"{FLEET} --resume", "is not as the run wrote it", 1, lambda folder: (
        text(f_csv=KEYS)(folder), damaged("o/estimates/*.parquet", FLEET + " -q")(folder))),
    Row("12", "formulas in what a spreadsheet opens", f"sh: driftwise {FLEET} -q; cat o/outliers.csv", "'=1+",
        make=text(f_csv=KEYS)),
    Row("12", "escapes in names of columns", "run t.csv -o y -i u\x1b[31m --model arx:1,1,1", "u\u241b[31m", make=text(
        t_csv=SMALL.replace("u", "u\x1b[31m", 1))),
    Row("13", "an order of ten thousand", "run t.csv -o y -i u --order 10000", "at most 200", 2, text(t_csv=SMALL)),
    Row("13", "settings nested without end", "run t.csv -o y --plant p.toml", "nested", 2,
        text(t_csv=SMALL, p_toml=DEEP)),
    Row("14", "a saved state with NaN", f"py: {USED}{STATE}import re; p = Path('s.json'); p.write_text(re.sub("
        "r'0x1[.]\\w+[+-][0-9]+', 'nan', p.read_text())); dw.load_state('s.json')", "InputError", 1),
    Row("14", "a saved state that is cut", f"py: {USED}{STATE}p = Path('s.json'); p.write_text(p.read_text()[:99]); "
        "dw.load_state('s.json')", "InputError", 1),
    Row("15", "Ctrl-C at once", f"int: {RUN}", "driftwise: stopped", 130, text(t_csv=SMALL)),
    Row("16", "the minus of typesetters", RUN, "60 samples", make=text(t_csv=MINUS)),
    Row("16", "milliseconds of Unix", "run t.csv -o y -i u -t t --model arx:1,1,1", "dt 60 s",
        make=text(t_csv=STEPS)),
    Row("17", "a report and results in one file", f"{RUN} --report f --json f", "would both write f", 2,
        text(t_csv=SMALL)),
    Row("17", "a terminal of 40 columns", f"sh: COLUMNS=40 driftwise {RUN} | wc -L", "40", make=text(t_csv=SMALL)),
    Row("18", "an input of 1e59", f"py: {USED}u[50] = 1e59; t = dw.Joint(2, inputs=1, noise=dw.models.OutputError())"
        ".scan(y, u); print('finite' if np.isfinite(t.state['x']).all() else 'NaN', (np.asarray(t.status, int) & 256)"
        ".any())", "finite"),
    Row("19", "records of fields as y", f"py: {USED}dw.AR(1).scan(np.zeros(9, [('a', float)]))", "InputError", 1),
    Row("19", "a header of 2000 characters", "run t.csv -o z", "no column 'z' for the output", 1,
        text(t_csv="q" * 2000 + ",y\n1,2\n2,3\n" * 9)),
    Row("doors", "covariance between poles", f"py: {USED}est = dw.ARX(2, 1); t = est.scan(y, u); "
        "print(est.model_of(t.state).poles_joint_covariance.shape)", "(4, 4)"),
    Row("doors", "residuals before the correction", f"py: {USED}"
        "print(dw.ARMAX(1, 1, 1, method='plr', residual='a priori').scan(y, u))",
        "Trace"),
    Row("doors", "a prior in the wrong order", f"py: {USED}dw.ARXMIMO(2, 1, 1, 1, theta0=np.zeros(6))",
        "of several outputs is given by name", 1),
    Row("doors", "the Brownian run length, inverted", "py: from driftwise.detect.brownian import *; "
        "h = brownian_threshold(1000.0, -0.5); print(round(brownian_run_length(-0.5, h)))", "1000"),
]  # fmt: skip


def tried(row: Row) -> tuple[list[str], str]:
    """Return what is wrong with what a row answers now, and the answer."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        row.make(folder)
        found = re.fullmatch(r"(?:(py|sh|int): )?(.*)", row.command, re.DOTALL)
        kind, command = found.groups() if found else (None, row.command)
        words: list[str] = {
            "py": [sys.executable, "-c", command],
            "sh": ["sh", "-c", command.replace("driftwise ", f"{shlex.join(DRIFTWISE)} ")],
        }.get(kind or "", [*DRIFTWISE, *shlex.split(command)])
        pipe: dict = dict(stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
        with subprocess.Popen(words, cwd=folder, stdin=subprocess.DEVNULL, **pipe) as process:
            if kind == "int":
                time.sleep(0.3)
                process.send_signal(signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                answer = process.communicate(timeout=120)[0]
            process.kill()
    flat = " ".join(answer.split())
    wrong = [f"exit code {process.returncode}"] * (process.returncode != row.code)
    wrong += [f"says nothing of {row.said!r}"] * (row.said not in flat)
    wrong += ["a traceback"] * ("Traceback" in answer and kind != "py")
    return wrong, answer


def main() -> int:
    asked, broken = set(sys.argv[1:]), 0
    for row in ROWS:
        if asked and row.number not in asked:
            continue
        wrong, answer = tried(row)
        broken += bool(wrong)
        lines = answer.strip().splitlines()
        shown = [line for line in lines if row.said in line] + lines[-1:] + [""]
        command = textwrap.shorten(row.command, 150).encode("unicode_escape").decode()
        print(f"{row.number:>5}  {row.fault}\n       $ {command}")
        print(f"       {shown[0].strip()[:160]}  [{'! ' * bool(wrong)}{'; '.join(wrong) or row.code}]", flush=True)
    print(f"{broken} of {len(ROWS)} are as they were")
    return int(broken > 0)


if __name__ == "__main__":
    sys.exit(main())
