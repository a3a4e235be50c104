"""Messages in every shape, and those that are none."""

import math

import pytest

from driftwise.engine.errors import InputError
from driftwise.live.decode import LARGEST, Chunk, Shape, chunks, influx_lines, json_lines
from driftwise.live.sources.lines import Lines


def same(chunk, key, time, fields):
    assert chunk.key == key
    assert list(map(repr, chunk.time)) == list(map(repr, time))
    assert {name: list(map(repr, values)) for name, values in chunk.fields.items()} == {
        name: list(map(repr, values)) for name, values in fields.items()
    }


@pytest.mark.parametrize(
    ("payload", "time", "fields"),
    [
        ("12.5", [math.nan], {"value": [12.5]}),
        ("null", [math.nan], {"value": [math.nan]}),
        ('{"time": 3, "flow": 1, "speed": null, "unit": "l/s"}', [3.0], {"flow": [1.0], "speed": [math.nan]}),
        ('{"time": [1, 2], "value": [NaN, "4"]}', [1.0, 2.0], {"value": [math.nan, 4.0]}),
        ('[{"time": 1, "value": 5}, {"time": 2, "value": 6}]', [1.0, 2.0], {"value": [5.0, 6.0]}),
        ('{"time": "2001-09-09T01:46:40Z", "value": true}', [1e9], {"value": [1.0]}),
    ],
)
def test_shapes_of_messages(payload, time, fields):
    (found,) = chunks(payload.encode(), "pump", Shape())
    same(found, "pump", time, fields)


@pytest.mark.parametrize(
    "payload",
    [
        "", "hello", "{", "[[1]]", '{"value": {"a": 1}}', '{"value": Infinity}', '{"time": 1}', '{"value": "x"}',
        '{"key": [1], "value": 2}', '{"time": [1, 2], "value": [1]}', "[" * 100_000, "1" * 5000, "\xff",
        " " * (LARGEST + 1), '{"time": {}, "value": 1}', '{"value": [1, [2]]}',
    ],
)  # fmt: skip
def test_what_is_no_message_is_refused(payload):
    with pytest.raises(InputError):
        chunks(payload.encode("latin-1"), "pump", Shape())


def test_keys_stand_in_messages_or_outside():
    found = list(json_lines(b'{"key": "a", "value": 1}\nnonsense\n\n{"key": 7, "value": 2}\n{"value": 3}\n'))
    assert [one.key for one in found if isinstance(one, Chunk)] == ["a", "7"]
    assert sum(isinstance(one, InputError) for one in found) == 2


def test_lines_are_read_one_by_one_where_one_of_them_is_none():
    good = [b'{"key": "a", "value": %d.5}' % i for i in range(3)]
    assert [one.fields["value"] for one in json_lines(b"\n".join(good))] == [[0.5], [1.5], [2.5]]
    for bad in (b'{"key": "a"', b'{"value": 1},{"value": 2}', b'{"value": Infinity, "key": "b"}', b"{}"):
        found = list(json_lines(b"\n".join([good[0], bad, good[1]])))
        assert [isinstance(each, InputError) for each in found] == [False, True, False]


def test_truths_of_the_line_protocol():
    found = list(influx_lines("\n".join(f"m v={word}" for word in "t T true True TRUE f F false False FALSE".split())))
    assert [one.fields["v"][0] for one in found] == [1.0] * 5 + [0.0] * 5


def test_line_protocol():
    text = 'pump,site=a\\ b,nr=7 flow=1.5,on=t,n=3i,text="x=1, y" 1000000000000000000\n# no\nbad\npump v=1'
    found = list(influx_lines(text))
    same(found[0], "pump/a b/7", [1e9], {"flow": [1.5], "on": [1.0], "n": [3.0]})
    assert isinstance(found[1], InputError)
    same(found[2], "pump", [math.nan], {"v": [1.0]})


def test_the_kind_of_lines_is_recognised():
    assert Lines("auto", "k").read(b"1.5\n2.5\n")[0][0].fields == {"value": [1.5, 2.5]}
    csv = Lines("auto", "k")
    found, refused = csv.read(b"time,key,value\n1,a,5\n2,b,6\n3,a,\n4,a\n")
    assert [(one.key, one.time) for one in found] == [("a", [1.0, 3.0]), ("b", [2.0])]
    assert len(refused) == 1
    assert csv.read(b"5,a,9\n")[0][0].fields == {"value": [9.0]}
    assert Lines("auto").read(b"m,t=1 v=2 5\n")[0][0].key == "m/1"
