"""A configuration: what is wrong is told with its line and the nearest word."""

import re
from importlib.resources import files

import pytest

from driftwise.engine.errors import InputError
from driftwise.live.config import load, parse


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[modle]\nmodel = 'auto'", "x.toml:1: there is no section [modle]; was 'model' meant?"),
        ("[model]\nmemroy = 'auto'", "x.toml:2: there is no option 'memroy' in [model]; was 'memory' meant?"),
        ("[model]\n\nfirst = '3'", "x.toml:3: first in [model] must be a whole number, got '3'"),
        ("[model]\ninputs = [1]", "x.toml:2: inputs in [model] must be text in quotes, got 1"),
        ("[model]\nlag = -1", "x.toml:2: lag is at least 0, got -1"),
        ("[[source]]\nkind = 'mqt'\nurl = ''", "x.toml:2: kind = 'mqt' in [[source]]; was 'mqtt' meant?"),
        ("[[source]]\nurl = 'mqtt://h'", "x.toml:1: no kind in [[source]]"),
        ("[[source]]\nkind = 'mqtt'\nurl = 'mqtt://h'", "x.toml:1: [source: mqtt] needs topics = .. (a list of text"),
        ("[[source]]\nkind = 'mqtt'\nurl = 'mqtt://u:p@h'\ntopics = ['a']", "x.toml:3: url holds a password"),
        ("[[source]]\nkind = 'file'\npath = 'a'\n[[source]]\nkind = 'file'\npth = 'a'", "x.toml:6: there is no option"),
        ("[source]\nkind = 'file'", "there may be several source: write [[source]]"),
        ("[[series]]\nkeys = 'a*'\nstuk = 3", "x.toml:3: there is no option 'stuk' in [series]; was 'stuck' meant?"),
        ("[web]\nport = 70000", "x.toml:2: port is between 0 and 65535, got 70000"),
        ("[model\n", "x.toml: "),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told(text, words):
    with pytest.raises(InputError, match=re.escape(words)):
        parse(text, "x.toml")


def test_a_password_is_never_told():
    with pytest.raises(InputError) as told:
        parse("[[source]]\nkind = 'mqtt'\nurl = 'mqtt://me:secret@h'\ntopics = ['a']", "x.toml")
    assert "secret" not in str(told.value)


def test_series_have_what_is_not_said_from_the_model():
    config = parse("[model]\nmodel = 'ar:2'\nstuck = 7\n[[series]]\nkeys = 'pump/*'\nunit = 'l/s'\nmodel = 'ar:3'")
    pump, other = config.of("pump/7"), config.of("fan")
    assert (pump.model, pump.stuck, pump.unit) == ("ar:3", 7, "l/s")
    assert (other.model, other.unit) == ("ar:2", "")


def test_the_environment_speaks_last():
    config = parse(
        "[store]\npath = 'a'", environment={"DRIFTWISE_LIVE_STORE_PATH": "b", "DRIFTWISE_LIVE_WEB_PORT": "9"}
    )
    assert (config.store.path, config.web.port) == ("b", 9)


def test_the_example_is_a_configuration(tmp_path):
    text = files("driftwise.live").joinpath("example.toml").read_text("utf-8")
    assert parse(text).sources[0].path == "samples.jsonl"
    whole = re.sub(r"^# (?=[\[a-z_]+.*(=|\]\]))", "", text, flags=re.M)
    assert len(parse(whole.replace("Options may", "# ")).sources) == 3


def test_no_such_file(tmp_path):
    with pytest.raises(InputError, match="driftwise live init"):
        load(tmp_path / "none.toml")
