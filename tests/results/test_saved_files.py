"""A saved file is read as it was written, or refused in one sentence that names it: whatever was done to it."""

import io
import json
import zipfile

import numpy as np
import pytest
from draws import draws

import driftwise as dw
from driftwise.tracking.plots import plots

VALUES = [None, True, -1, 1e400, 2**70, "", "ARX", "nan", [], [[]], {}, {"kind": "nobody"}, {"kind": "dict"}]


def _estimator():
    return dw.ARX(2, 1, memory=dw.RestartOnChange(dw.detect.PageHinkley()))


def _state(path):
    est, rng = _estimator(), np.random.default_rng(1)
    trace = est.scan(rng.standard_normal(30), rng.standard_normal(30))
    dw.save_state(est, trace.state, path)


def _trace(path):
    rng = np.random.default_rng(1)
    _estimator().scan(rng.standard_normal(30), rng.standard_normal(30)).save(path)


def _tracker(path):
    tracker, time = dw.tracking.Tracker("boat"), np.arange(12.0)
    tracker.feed(plots(time, np.stack([3 * time, 4 * time], axis=1)))
    tracker.save(path)


FILES = {
    "state.json": (_state, dw.load_state),
    "trace.npz": (_trace, dw.Trace.load),
    "tracker.npz": (_tracker, dw.tracking.Tracker.load),
}


def refused(load, path, content: bytes) -> str:
    """Return what is said of a file with that content; nothing where it is read."""
    path.write_bytes(content)
    said = ""
    try:
        load(path)
    except dw.InputError as error:
        said = str(error)
        told = str(path) in said and "pickle" not in said and len(said) < 600
    else:
        told = True
    assert told, said
    return said


@draws("count", 50, 150)
@pytest.mark.parametrize("name", FILES)
def test_a_damaged_file_is_refused_by_name(name, count, tmp_path):
    write, load = FILES[name]
    path, rng = tmp_path / name, np.random.default_rng(5)
    write(path)
    load(path)
    whole = path.read_bytes()
    for content in (b"", b"{}", b"[]", b"null", b"\0" * 999, b"PK\x03\x04", b"[" * 100_000, whole[: len(whole) // 2]):
        assert refused(load, path, content)
    for _ in range(count):
        content = bytearray(whole)
        for at in rng.integers(0, len(whole), rng.integers(1, 4)):
            content[at] = rng.integers(256)
        refused(load, path, bytes(content))


def test_no_file_is_a_sentence(tmp_path):
    for _, load in FILES.values():
        with pytest.raises(dw.InputError, match="no such file"):
            load(tmp_path / "nothing")


def places(value, at=()):
    """Yield where the values of a JSON text stand."""
    yield at
    pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in pairs:
        yield from places(inner, (*at, key))


def altered(data, at, value):
    """Return a copy of JSON data with another value at one place; a name that is gone where the value is `del`."""
    data = json.loads(json.dumps(data))
    if not at:
        return value
    inner = data
    for key in at[:-1]:
        inner = inner[key]
    if value == "del":
        del inner[at[-1]]
    else:
        inner[at[-1]] = value
    return data


def test_a_state_with_any_other_value_is_read_or_refused(tmp_path):
    path = tmp_path / "state.json"
    _state(path)
    data = json.loads(path.read_text())
    data["rows"] = [row[:3] for row in data["rows"]] + data["rows"]
    for at in places({**data, "rows": []}):
        for value in [*VALUES, "del"]:
            refused(dw.load_state, path, json.dumps(altered(data, at, value)).encode())


def test_a_tracker_with_any_other_value_is_read_or_refused(tmp_path):
    path = tmp_path / "tracker.npz"
    _tracker(path)
    with zipfile.ZipFile(path) as file:
        parts = {name: file.read(name) for name in file.namelist()}
    facts = json.loads(np.load(io.BytesIO(parts["facts.npy"])).tobytes())
    rng = np.random.default_rng(2)
    spots = list(places(facts))
    for at in (spots[i] for i in rng.choice(len(spots), 120, replace=False)):
        text = json.dumps(altered(facts, at, VALUES[rng.integers(len(VALUES))]))
        buffer, array = io.BytesIO(), io.BytesIO()
        np.save(array, np.frombuffer(text.encode(), np.uint8))
        with zipfile.ZipFile(buffer, "w") as file:
            for name, content in (parts | {"facts.npy": array.getvalue()}).items():
                file.writestr(name, content)
        refused(dw.tracking.Tracker.load, path, buffer.getvalue())


@pytest.mark.parametrize("wrong", ["nan", "inf"])
def test_a_state_that_is_not_finite_is_refused(wrong, tmp_path):
    path = tmp_path / "state.json"
    _state(path)
    data = json.loads(path.read_text())
    data["rows"][0][7] = wrong
    assert "states are finite" in refused(dw.load_state, path, json.dumps(data).encode())


def test_a_shape_below_nothing_is_refused(tmp_path):
    path = tmp_path / "state.json"
    _state(path)
    data = json.loads(path.read_text()) | {"shape": [-1]}
    assert "shape [-1]" in refused(dw.load_state, path, json.dumps(data).encode())


def test_nothing_but_estimators_is_built_from_a_file(tmp_path):
    path = tmp_path / "state.json"
    _state(path)
    data = json.loads(path.read_text())
    for name in ("annotations", "lazy", "__loader__", "system"):
        assert "no estimator" in refused(dw.load_state, path, json.dumps(data | {"estimator": name}).encode())
