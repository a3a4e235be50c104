"""`driftwise fleet`: pumps with known faults in, their names out, on the terminal, on a page and as files."""

import csv
import json
import shutil
import subprocess
import sys
import time

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from browser import PROGRAM, Browser

import driftwise as dw
from driftwise.cli import demo_fleet
from driftwise.cli.fleet import FleetRunJob
from driftwise.fleet.fleet_run import former_run
from driftwise.fleet.outliers import outliers
from driftwise.report.fleet_page import write
from driftwise.report.fleet_report import FleetReport, lead

PUMPS = ["--by", "asset", "--output", "flow", "--input", "speed", "--time", "time"]
QUICK = ["--model", "joint:1", "--every", "0"]  # compiled by other tests as well


@pytest.fixture(scope="module")
def pumps(tmp_path_factory):
    """The folder of a fleet, and what is wrong with whom."""
    folder = tmp_path_factory.mktemp("fleet") / "pumps"
    found = demo_fleet.write_fleet(folder, 60, 200, seed=1)
    return folder, {pump.name: pump.fault for pump in found}


@pytest.fixture(scope="module")
def finished(pumps):
    """The folder of a run, what it printed, and what it wrote as JSON."""
    out, found = (pumps[0].parent / name for name in ("results", "found.json"))
    words = "fleet", "run", pumps[0], *PUMPS, *QUICK, "--out", out, "--json", found
    done = subprocess.run([sys.executable, "-m", "driftwise", *map(str, words)], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    return out, done.stdout, json.loads(found.read_text())


@pytest.fixture
def results(finished, tmp_path):
    """The same, in a folder of one's own."""
    folder, printed, found = finished
    return shutil.copytree(folder, tmp_path / "results"), printed, found


def test_simulated_pumps_are_a_long_table_and_their_faults_are_told(call, tmp_path):
    code, out, _ = call("fleet", "simulate", tmp_path / "pumps", "--series", 20, "--samples", 60)
    assert code == 0 and "its speed never moves" in out and "driftwise fleet run" in out
    table = pq.read_table(tmp_path / "pumps").to_pandas()
    assert list(table) == ["time", "asset", "speed", "flow"] and table.asset.nunique() == 20
    with open(tmp_path / "pumps" / demo_fleet.TRUTH) as file:
        truth = {row["asset"]: row["fault"] for row in csv.DictReader(file)}
    assert set(truth.values()) == set(demo_fleet.FAULTS)
    stuck = next(name for name, fault in truth.items() if fault == "stuck")
    assert table[table.asset == stuck].speed.nunique() == 1
    order = table.groupby("asset", observed=True).time.apply(lambda t: (np.diff(t) > np.timedelta64(0)).all())
    assert {name for name, is_in_order in order.items() if not is_in_order} == {
        name for name, fault in truth.items() if fault == "bad data"
    }
    code, _, complaint = call("fleet", "simulate", tmp_path / "few", "--series", 5)
    assert code == 1 and "--series must be at least 18" in complaint


def test_a_simulated_fleet_replaces_the_one_before_and_nothing_of_yours(call, monkeypatch, tmp_path):
    monkeypatch.setattr(demo_fleet, "ROWS", 500)
    for series in (40, 20):
        assert call("fleet", "simulate", tmp_path / "pumps", "--series", series, "--samples", 50)[0] == 0
    assert pq.read_table(tmp_path / "pumps", columns=["asset"]).num_rows < 1200
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "part-0000.parquet").write_bytes(b"mine")
    code, _, complaint = call("fleet", "simulate", tmp_path / "mine", "--series", 20, "--samples", 50)
    assert code == 1 and "holds data already (part-0000.parquet)" in complaint
    assert (tmp_path / "mine" / "part-0000.parquet").read_bytes() == b"mine"


def test_what_is_wrong_is_found_and_told(pumps, results):
    out, printed, found = results
    faults = pumps[1]
    with open(out / "outliers.csv") as file:
        named = [(row["key"], row["kind"]) for row in csv.DictReader(file)]
    for fault, kind in (("stuck", "untaught"), ("bad data", "data"), ("other make", "differs")):
        for name in (name for name, what in faults.items() if what == fault):
            assert (name, kind) in named, f"{name}: {fault}"
    flat = " ".join(printed.split())
    assert f"{found['need_a_look']} of 60 series need a look." in flat and "60 series \u00b7 " in flat
    assert "speed never moved: what it does cannot be learnt" in flat
    assert "2026-01-01 to 2026-01-01 03:19:00" in flat and "joint:1, memory constant" in flat
    assert {worst["key"] for worst in found["worst"]} <= set(faults)
    assert found["kinds"]["untaught"] == 1 and found["rows"] == pq.read_table(pumps[0]).num_rows
    assert {q["what"] for q in found["quality"]} >= {"late rows", "rows that came twice", "missing outputs"}
    final, events = pq.read_table(out / "final.parquet"), pq.read_table(out / "events.parquet")
    assert final.num_rows == 60
    first, last = (str(final[name].to_pandas()[0]) for name in ("first_time", "last_time"))
    assert (first, last) == ("2026-01-01 00:00:00+00:00", "2026-01-01 03:19:00+00:00")
    assert final["last_jump"].null_count == 60 - np.count_nonzero(final["jumps"].to_numpy())
    assert str(events["time"].type) == "timestamp[us, tz=UTC]"


def test_the_summary_can_be_told_again(call, pumps, tmp_path):
    out = tmp_path / "results"
    code, printed, complaint = call("fleet", "run", pumps[0], *PUMPS, *QUICK, "--out", out)
    assert (code, complaint) == (0, "")
    (out / "summary.html").unlink()
    (out / "summary.html").mkdir()
    code, _, complaint = call("fleet", "show", out)
    assert code == 1 and "page and names cannot be written into" in " ".join(complaint.split())
    (out / "summary.html").rmdir()
    code, again, complaint = call("fleet", "show", out)
    assert (code, complaint) == (0, "")
    start = printed.index("what  ")
    assert again[again.index("what  ") :] == printed[start:]
    assert again.split()[:16] == printed.split()[:16], "name, size, times and model"
    assert (out / "summary.html").exists()
    code, _, complaint = call("fleet", "run", pumps[0], *PUMPS, *QUICK, "--out", out)
    assert code == 1 and "--resume" in complaint and "--replace" in complaint
    code, again, _ = call("fleet", "run", pumps[0], *PUMPS, *QUICK, "--out", out, "--resume")
    assert code == 0 and "nothing was left to run" in again
    assert call("fleet", "run", pumps[0], *PUMPS, *QUICK, "--out", out, "--replace", "--quiet") == (0, "", "")


def test_the_page_stands_alone_and_draws_all(results, tmp_path):
    out, _, _ = results
    text = (out / "summary.html").read_text()
    assert "src=" not in text.split("</style>")[0] and 'href="http' not in text
    assert len(text) < 3e6
    if PROGRAM is None:
        pytest.skip("no Chromium on the PATH: THE PAGE WAS NOT LOOKED AT")
    browser = Browser(tmp_path / "profile")
    try:
        phone = {"width": 400, "height": 800, "deviceScaleFactor": 1, "mobile": True}
        browser.call("Emulation.setDeviceMetricsOverride", **phone)
        browser.call("Page.navigate", url=(out / "summary.html").as_uri())
        seen = browser.run(
            "new Promise(done => setTimeout(() => done({plots: Bokeh.documents[0].roots().length, "
            "shown: document.querySelectorAll('.plot').length, wide: document.documentElement.scrollWidth}), 1500))"
        )
        said = [m["params"] for m in browser.said if m.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded")]
    finally:
        browser.close()
    assert not said and seen["plots"] == seen["shown"] >= 5
    assert seen["wide"] <= 400, "a phone need not scroll sideways"


def test_keys_and_names_are_shown_as_they_are_and_no_markup(call, tmp_path):
    rng, T = np.random.default_rng(2), 60
    keys = np.tile(["<b>x</b>", "a&b", *map(str, range(10))], T)
    u = rng.choice([-1.0, 1.0], len(keys))
    table = {"who": keys, "u": np.where(keys == "<b>x</b>", 0.0, u), "y": rng.standard_normal(len(keys))}
    pq.write_table(pa.table(table), tmp_path / "t.parquet")
    code, _, complaint = call(
        "fleet", "run", tmp_path / "t.parquet", "--by", "who", "-o", "y", "-i", "u", *QUICK, "--out", tmp_path / "r",
        "--quiet",
    )  # fmt: skip
    assert (code, complaint) == (0, "")
    text = (tmp_path / "r" / "summary.html").read_text()
    assert "&lt;b&gt;x&lt;/b&gt;" in text and "<b>x</b>" not in text.split("</main>")[0]


@pytest.mark.parametrize("dt", [None, 60])
def test_gaps_in_the_clock_are_told_with_the_step_that_fills_them(call, tmp_path, dt):
    T = 80
    minutes = np.delete(np.arange(T), [40, 41, 42, 60])
    stamps = np.repeat(np.datetime64("2026-03-01") + minutes.astype("timedelta64[m]"), 2)
    y = np.random.default_rng(4).standard_normal(len(stamps))
    table = pa.table({"who": ["a", "b"] * len(minutes), "t": stamps.astype("datetime64[ms]"), "y": y})
    pq.write_table(table, tmp_path / "t.parquet")
    fills = ["--every", 1, *([] if dt is None else ["--dt", dt])]
    args = [
        tmp_path / "t.parquet",
        "--by",
        "who",
        "-o",
        "y",
        "-t",
        "t",
        "--memory",
        "constant",
        *fills,
        "--out",
        tmp_path / "r",
    ]
    code, printed, _ = call("fleet", "run", *args)
    flat, code_again, again = " ".join(printed.split()), *call("fleet", "show", tmp_path / "r")[:2]
    assert code == code_again == 0
    is_told = "gaps in the clock: 4 (" in flat and "--dt 60, the usual step, makes missing samples" in flat
    assert is_told == (dt is None) == ("--dt 60" in " ".join(again.split()))
    assert ("missing ticks filled: 8 (" in flat) == (dt is not None)
    estimates = pq.read_table(tmp_path / "r" / "estimates")
    assert [str(t)[11:] for t in estimates["time"].to_pylist()[:2]] == ["00:00:00+00:00", "00:01:00+00:00"]


def test_a_table_whose_newest_row_comes_first_is_told_and_so_is_an_empty_column(call, tmp_path):
    T, out = 60, tmp_path / "r"
    table = {"who": ["a", "b"] * T, "t": np.repeat(np.arange(T), 2)[::-1], "y": np.full(2 * T, np.nan)}
    csv_file = tmp_path / "t.csv"
    for y in (np.random.default_rng(3).standard_normal(2 * T), table["y"]):
        lines = [f"{who},{t},{'' if np.isnan(v) else v}\n" for who, t, v in zip(table["who"], table["t"], y)]
        csv_file.write_text("".join(["who,t,y\n", *lines]))
        args = ["--by", "who", "-o", "y", "-t", "t", *QUICK, "--out", out, "--replace"]
        code, printed, _ = call("fleet", "run", csv_file, *args)
        flat = " ".join(printed.split())
        assert code == 0 and "e+0" not in flat and "2 of 2 series need a look. 2 have poor data." in flat
        assert ("Most rows are late: is the newest row first?" in flat) == bool(np.isfinite(y).all())


@pytest.mark.parametrize(
    "args, words",
    [
        (["nowhere", *PUMPS, "--out", "r"], "no such file or folder: nowhere"),
        ([".", *PUMPS, "--out", "."], "results would be taken for data"),
        ([".", *PUMPS, "--out", "r", "--checkpoint", "often"], "--checkpoint takes seconds"),
        ([".", *PUMPS, "--out", "r", "--checkpoint", "0b"], "--checkpoint takes seconds"),
        ([".", *PUMPS, "--out", "r", "--model", "arx:2"], "--model is written arx:na,nb,nk"),
        ([".", *PUMPS, "--out", "r", "--model", "axr:2,2"], "as in arx:2,2,1, or joint, as in joint:2; got 'axr:2,2'"),
        ([".", *PUMPS, "-o", "head", "--out", "r"], "--output names 2 columns, flow, head, and a series has one"),
        ([".", *PUMPS, "--out", "r", "--resume", "--replace"], "give one of them"),
        ([".", *PUMPS, "--out", "r", "--memory", "forever"], "--memory must be"),
        ([".", *PUMPS, "--out", "r", "--dt", "-1"], "--dt must be a positive step"),
        ([".", "--by", "a", "-o", "y", "--out", "r", "--dt", "1"], "there is no --time"),
        ([".", *PUMPS, "--out", "r", "--json", "no/such/file"], "there is no folder"),
    ],
)
def test_wrong_commands_say_what_is_wrong(call, tmp_path, monkeypatch, args, words):
    monkeypatch.chdir(tmp_path)
    code, out, complaint = call("fleet", "run", *args)
    assert code == 2 and out == "" and words in " ".join(complaint.split())


def test_wrong_columns_are_refused_before_anything_is_written(call, pumps, tmp_path):
    code, _, complaint = call("fleet", "run", pumps[0], "--by", "asset", "-o", "flw", *QUICK, "--out", tmp_path / "r")
    assert code in (1, 2) and "flow" in complaint
    out = tmp_path / "a file" / "r"
    out.parent.write_text("in the way")
    code, _, complaint = call("fleet", "run", pumps[0], *PUMPS, *QUICK, "--out", out)
    assert code == 2 and "is a file, and a folder is wanted" in " ".join(complaint.split())
    code, _, complaint = call("fleet", "show", tmp_path)
    assert code == 1 and "no run in" in complaint


def test_models_are_those_of_run_with_an_offset_besides():
    def names(**asked):
        return FleetRunJob("d", "by", ["y"], "out", **asked).estimator().names

    assert names(input=["u"]) == ["a1", "a2", "b1", "b2", "offset"] and names() == ["a1", "a2", "offset"]
    assert names(input=["u", "v"], model="arx:1,1/2,1", memory="constant")[:4] == ["a1", "b1.1", "b1.2", "b2.2"]
    assert FleetRunJob("d", "by", ["y"], "out", jumps="level:1000").words == "ar:2, memory constant, jumps level:1000"
    assert FleetRunJob("d", "by", ["y"], "out", checkpoint="20b").pace == {"batches": 20}
    assert FleetRunJob("d", "by", ["y"], "out", checkpoint="1.5s").pace == {"seconds": 1.5}


@pytest.mark.slow
def test_a_hundred_thousand_series_are_judged_in_seconds_on_a_small_page(results, tmp_path):
    out, _, _ = results
    former, rng, S = former_run(out), np.random.default_rng(3), 100_000
    pick = rng.integers(0, len(former.fleet), S)
    fleet = dw.Fleet(former.fleet.estimators[0], range(S))
    fleet.states[:] = former.fleet.states[pick]
    fleet.states["theta"] *= 1 + 0.002 * rng.standard_normal(fleet.states["theta"].shape)
    tally = {name: former.tally[name][pick] for name in former.tally.names}
    start = time.process_time()
    found = outliers(fleet, tally, inputs=("speed",))
    assert time.process_time() - start < 10
    report = FleetReport("many", "asset", "flow", ("speed",), fleet, tally, found)
    assert write(report, tmp_path / "page.html").stat().st_size < 2e6
    assert len(found.table(3)) <= 21 and "of 100\u202f000 series need a look" in lead(report)


def test_series_that_each_start_at_zero_have_no_common_instants():
    from types import SimpleNamespace as FleetReport

    from driftwise.report.fleet_report import starts_anew

    first, last = np.zeros(20), np.linspace(2500.0, 3500.0, 20)
    for begin, end, is_dated, is_own in (
        (first, last, False, True), (first, last, True, False), (first, first + 3000, False, False),
        (last - 2000, last, False, False),
    ):  # fmt: skip
        report = FleetReport(tally={"first_time": begin, "last_time": end}, is_dated=is_dated)
        assert starts_anew(report) is is_own


def test_a_key_that_is_the_time_is_doubted(tmp_path, call):
    rows = "".join(f"2024-05-01T00:{k // 60:02d}:{k % 60:02d},{np.sin(k):.3f}\n" for k in range(100))
    (tmp_path / "t.csv").write_text("stamp,level\n" + rows)
    code, out, _ = call(
        "fleet", "run", str(tmp_path / "t.csv"), "-b", "stamp", "-o", "level", "--out", str(tmp_path / "o")
    )
    assert code == 0 and "is 'stamp' the column that names the series" in " ".join(out.split())


def test_a_fleet_whose_memory_finds_jumps_by_itself_is_told_how_many_may_be_false():
    from types import SimpleNamespace as FleetReport

    from driftwise.fleet.counters import UNUSED
    from driftwise.report.fleet_report import fleet_notes

    tally = dict.fromkeys(("samples", *UNUSED), np.zeros(20))
    nobody, somebody = FleetReport(rows=[]), FleetReport(rows=[3])
    for memory, samples, jumped, is_told in (
        (dw.AutoMemory(), 1_000_000, somebody, True), (dw.AutoMemory(), 1_000_000, nobody, False),
        (dw.AutoMemory(), 10_000, somebody, False), (dw.RestartOnChange(), 1_000_000, somebody, False),
    ):  # fmt: skip
        fleet = dw.Fleet(dw.ARX(1, 1, memory=memory), range(20))
        found = FleetReport(found={"jumped": jumped, "differs": nobody})
        report = FleetReport(fleet=fleet, outliers=found, samples=samples, tally=tally)
        told = " ".join(fleet_notes(report))
        assert ("Up to 10 jumps may be false alarms" in told) is is_told
