"""`driftwise live` as it is typed."""

import json
import subprocess
import sys

import numpy as np
import pytest
from live_plant import configuration, opened, outputs

from driftwise.cli.live import LiveJob
from driftwise.engine.errors import InputError


def driftwise(*words, text=None, folder=None):
    return subprocess.run(
        [sys.executable, "-m", "driftwise", "live", *map(str, words)], input=text, text=True, capture_output=True,
        cwd=folder, timeout=120,
    )  # fmt: skip


def test_a_pipe_is_estimated_and_its_events_are_told(tmp_path):
    y = outputs(1, 300)[0]
    y[200:] += 40.0
    text = "".join(json.dumps({"key": "pump", "time": 1e9 + t, "value": v}) + "\n" for t, v in enumerate(y.tolist()))
    found = driftwise("-", "--model", "ar:2", "--store", tmp_path / "s", "--log", "json", text=text + "nonsense\n")
    assert found.returncode == 0, found.stderr
    told = [json.loads(line) for line in found.stdout.splitlines()]
    assert any(event["kind"] == "jump" and 1e9 + 200 <= event["time"] < 1e9 + 210 for event in told)
    core = opened(tmp_path / "s")
    assert core.picture.columns["count"][0] == 300
    core.store.close()
    assert "not used, once: neither JSON nor a number" in found.stderr
    words = driftwise("status", "--store", tmp_path / "s")
    assert words.stdout.startswith("1 series\n")
    assert f"{len(told)} events" in words.stdout


def test_a_model_is_chosen_by_the_first_samples(tmp_path):
    rng = np.random.default_rng(4)
    u = rng.standard_normal(400)
    y = np.zeros(400)
    for t in range(1, 400):
        y[t] = 0.7 * y[t - 1] + 2.0 * u[t - 1] + 0.1 * rng.standard_normal()
    text = "".join(json.dumps({"time": t, "value": y[t], "speed": u[t]}) + "\n" for t in range(400))
    found = driftwise("-", "-i", "speed", "--store", tmp_path, text=text)
    assert found.returncode == 0, found.stderr
    core = opened(tmp_path, 'inputs = ["speed"]')
    assert len(core.roster.by_number[0].samples) == 400  # not enough yet: all of them are kept
    core.store.close()
    more = "".join(json.dumps({"time": t, "value": 0.0, "speed": 0.0}) + "\n" for t in range(400, 700))
    assert driftwise("-", "-i", "speed", "--store", tmp_path, text=more).returncode == 0
    core = opened(tmp_path, 'inputs = ["speed"]')
    words = json.loads(core.roster.words[0])[0]
    assert words.startswith("ARX(") and "chosen by 500 samples" in words
    assert core.roster.groups[0].tally["samples"][0] == 700


def test_init_check_and_complaints(tmp_path):
    assert driftwise("init", folder=tmp_path).returncode == 0
    assert driftwise("init", folder=tmp_path).returncode == 2
    told = driftwise("driftwise-live.toml", "--check", folder=tmp_path)
    assert told.returncode == 0, told.stderr
    assert "follow samples.jsonl, which is not there yet" in told.stdout
    (tmp_path / "bad.toml").write_text("[model]\nmodel = 'arx:2'\ninputs = ['u']\n")
    bad = driftwise("bad.toml", folder=tmp_path)
    assert bad.returncode == 2 and "arx:na,nb,nk" in bad.stderr


def test_a_store_has_one_service(tmp_path):
    core = opened(tmp_path / "store")
    path = configuration(tmp_path, f'[[source]]\nkind = "file"\npath = "{tmp_path}/x"\n')
    found = driftwise(path)
    assert found.returncode == 1 and "another service" in found.stderr
    core.store.close()


def test_status_finds_the_store_in_a_folder_or_says_what_it_wants(tmp_path, capsys):
    opened(tmp_path / "plant").store.close()
    opened(tmp_path / "site" / "driftwise-live").store.close()
    (tmp_path / "set").mkdir()
    (tmp_path / "set" / "driftwise-live.toml").write_text(f'[store]\npath = "{tmp_path / "plant"}"\n')
    for path in ("plant", "site", "set", "plant/live.sqlite"):
        LiveJob("status", str(tmp_path / path)).run()
        assert capsys.readouterr().out.startswith("0 series\n")
    with pytest.raises(InputError, match="neither a store"):
        LiveJob("status", str(tmp_path)).run()
    with pytest.raises(InputError, match="is a folder, not a configuration"):
        LiveJob(str(tmp_path), only_check=True).run()
