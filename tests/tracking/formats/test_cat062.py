"""Tracks as CAT062, read back by another decoder and by our own."""

import numpy as np
import pytest

pytest.importorskip("asterix.generated", reason='pip install "driftwise[tracking]"')

from driftwise.engine.errors import InputError
from driftwise.tracking.formats.asterix import decode, read_asterix
from driftwise.tracking.formats.cat062 import encode_cat062


def rows(T=40):
    rng = np.random.default_rng(3)
    sd = {
        f"{n}_sd": rng.uniform(0.3, scale, (T, 2))
        for n, scale in (("position", 500), ("velocity", 20), ("acceleration", 5))
    }
    level = np.where(np.arange(T) % 7 == 0, np.nan, rng.uniform(-300, 15000, T))
    return sd | {
        "time": 86300 + 4.0 * np.arange(T), "track": 1 + np.arange(T) % 3, "latitude": rng.uniform(-89, 89, T),
        "longitude": rng.uniform(-180, 180, T), "position": rng.normal(size=(T, 2)) * 2e5,
        "velocity": rng.normal(size=(T, 2)) * 200, "acceleration": rng.normal(size=(T, 2)) * 5, "altitude": level,
        "key": np.array(["4BAA5F", "A1234", "boat"], object)[np.arange(T) % 3],
        "name": np.array(["DLH65A", "", "ÄÖ"], object)[np.arange(T) % 3],
        "turn_rate": np.resize([0.02, -0.02, 0.0, 0.0, np.nan], T),
        "turn_rate_sd": np.resize([0.001, 0.001, 0.001, 0.1, 0.001], T),
        "tentative": np.arange(T) < 3,
    }  # fmt: skip


def test_another_decoder_reads_the_values_to_the_items_resolution():
    pyasteryx = pytest.importorskip("pyasteryx")
    wanted = rows()
    found = [m.items for m in pyasteryx.Decoder().decode(encode_cat062(wanted, 25, 201, service=7))]
    assert len(found) == 40
    for k, got in enumerate(found):
        row = {name: column[k] for name, column in wanted.items()}
        assert got["I062/010"] == {"SAC": 25, "SIC": 201} and got["I062/015"] == {"SID": 7}
        assert got["I062/070"]["ToT"] == row["time"] % 86400 and got["I062/040"]["TrkN"] == row["track"]
        assert got["I062/105"]["Lat"] == pytest.approx(row["latitude"], abs=180 / 2**26)
        assert got["I062/105"]["Lon"] == pytest.approx(row["longitude"], abs=180 / 2**26)
        for item, names, column, step in (
            ("100", "XY", "position", 0.5), ("185", ("Vx", "Vy"), "velocity", 0.25),
            ("210", ("Ax", "Ay"), "acceleration", 0.25),
        ):  # fmt: skip
            assert [got[f"I062/{item}"][n] for n in names] == pytest.approx(row[column], abs=step / 2)
        bars = {"APC": ("position_sd", 0.5), "ATV": ("velocity_sd", 0.25), "AA": ("acceleration_sd", 0.25)}
        for part, (column, step) in bars.items():
            assert list(got["I062/500"][part].values()) == pytest.approx(row[column], abs=step / 2)
        if np.isnan(row["altitude"]):
            assert "I062/136" not in got
        else:
            assert got["I062/136"]["MFL"] * 0.3048 == pytest.approx(row["altitude"], abs=25 * 0.3048 / 2)
        who = got.get("I062/380", {}).get("ADR", {}).get("ADR"), got.get("I062/060", {}).get("Mode3A")
        assert who == {"4BAA5F": ("4BAA5F", None), "A1234": (None, "1234"), "boat": (None, None)}[row["key"]]
        status = got["I062/080"]
        assert status["CNF"] == (k < 3) and status.get("TSB", 0) == (k < 3) and status.get("TSE", 0) == (k >= 37)
        turning = got["I062/200"]["TRANSA"] if "I062/200" in got else None
        assert turning == (1, 2, 0, 3, None)[k % 5]  # right, left, straight on, not known, not told


def test_our_own_reader_reads_the_tracks_as_plots():
    wanted = rows()
    data = encode_cat062(wanted, 25, 201)
    plots = read_asterix(data, day="2024-07-03", origin=(46.0, 15.0), editions={62: "1.20"})
    assert plots.faults == () and len(plots) == 40
    assert plots.time == pytest.approx(wanted["time"] + 1719964800)  # past midnight
    assert list(plots.key) == [{"boat": f"T{t}"}.get(k, k) for k, t in zip(wanted["key"], wanted["track"])]
    assert plots.name[0] == "DLH65A" and plots.name[2] == "" and set(plots.sensor) == {"25/201"}
    sd = np.sqrt(np.einsum("tii->ti", plots.covariance))
    assert sd == pytest.approx(np.maximum(wanted["position_sd"], 0.5), abs=0.25)
    body = decode(data).reports[5].body
    assert (body.first, body.second) == pytest.approx((wanted["latitude"][5], wanted["longitude"][5]), abs=180 / 2**26)


def test_what_is_too_large_is_the_largest_and_what_is_missing_is_left_out():
    one = {"time": [1.0], "track": [70000], "latitude": [10.0], "longitude": [350.0]}
    big = encode_cat062(
        one | {"velocity": [[1e9, -1e9]], "velocity_sd": [[1e9, 64.0]], "position_sd": [[np.inf, 1.0]]}, 1, 2
    )
    pyasteryx = pytest.importorskip("pyasteryx")
    (got,) = pyasteryx.Decoder().decode(big)
    assert got.items["I062/185"] == {"Vx": 8191.75, "Vy": -8192.0} and got.items["I062/040"]["TrkN"] == 70000 % 65536
    assert {part: list(bars.values()) for part, bars in got.items["I062/500"].items()} == {"ATV": [63.75, 63.75]}
    assert got.items["I062/105"]["Lon"] == pytest.approx(-10.0, abs=1e-5)
    (bare,) = pyasteryx.Decoder().decode(encode_cat062(one | {"velocity": [[np.nan, 1.0]]}, 1, 2))
    assert set(bare.items) == {f"I062/{i}" for i in ("010", "015", "070", "105", "040", "080")}
    assert encode_cat062([], 1, 2) == b""


def test_bad_columns_are_refused_at_the_door():
    one = {"time": [1.0], "track": [1], "latitude": [10.0], "longitude": [15.0]}
    for change, what in (
        ({"latitude": [np.nan]}, "in row 0; are they radians"),
        ({"velocity": [1.0]}, r"velocity must have shape \(1, 2\)"),
        ({"time": [np.inf]}, "time must be finite"), ({"speed": [1.0]}, "'speed' that is not known"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=what):
            encode_cat062(one | change, 1, 2)
    with pytest.raises(InputError, match="missing: longitude"):
        encode_cat062({k: one[k] for k in ("time", "track", "latitude")}, 1, 2)
    with pytest.raises(InputError, match="sic must be a whole number from 0 to 255"):
        encode_cat062(one, 1, 256)


@pytest.mark.slow  # compiles the whole bank
def test_tracks_of_a_tracker_are_encoded():
    from driftwise.tracking.plots import plots
    from driftwise.tracking.tracker import Tracker

    time = 4.0 * np.arange(15)
    position = np.stack([200 * time, 100 * time], axis=1) + np.random.default_rng(0).normal(size=(15, 2)) * 50
    tracker = Tracker("aircraft")
    tracker.feed(plots(time + 1e9, position, key="4BAA5F", name="DLH1", altitude=10000.0, origin=(46.0, 15.0)))
    tracker.finish()
    (track,) = tracker.tracks
    found = read_asterix(encode_cat062(tracker.tracks, 25, 1), origin=(46.0, 15.0), day="2001-09-09")
    assert found.time == pytest.approx(track.plots.time, abs=1 / 256)
    assert found.position == pytest.approx(track.trace.position, abs=1.0)
    assert set(found.key) == {"4BAA5F"} and found.altitude == pytest.approx(10000.0, abs=4)
