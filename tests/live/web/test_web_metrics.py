"""What Prometheus is told, read back with its own parser."""

import dataclasses

import pytest

pytest.importorskip("prometheus_client", reason='pip install "driftwise[live]"')
from live.simulated_board import Simulated
from prometheus_client.openmetrics.parser import text_string_to_metric_families as openmetrics
from prometheus_client.parser import text_string_to_metric_families as classic

from driftwise.live.web.metrics import Picture, exposition

ACCEPT = {classic: "", openmetrics: "application/openmetrics-text; version=1.0.0"}


def told(board, parser=classic, limit=1000):
    picture = Picture(board.series(), board.health(), board.counters(), limit)
    text, _ = exposition(picture, ACCEPT[parser])
    return {(s.name, *sorted(s.labels.items())): s.value for family in parser(text.decode()) for s in family.samples}


@pytest.mark.parametrize("parser", [classic, openmetrics])
def test_numbers_are_those_of_the_board(parser):
    board = Simulated(['a "quoted"\n\\ key', "b"], at=1.7e9)
    for _ in range(20):
        board.tick()
    board.told.clear()
    board.happened("b", "jump", "b1 jumped")
    found = told(board, parser)
    for view in board.series():
        assert found["driftwise_series_output", ("series", view.key)] == view.output
        assert found["driftwise_series_nis", ("series", view.key)] == view.nis
    assert found["driftwise_series_alarm", ("series", "b")] == 1.0 and found[("driftwise_alarms",)] >= 1.0
    assert found["driftwise_series", ("state", "jump")] >= 1.0 and found[("driftwise_samples_total",)] == 40.0


def test_labels_are_bounded():
    board = Simulated([f"key {k}" for k in range(50)], at=1.7e9)
    board.tick()
    found = told(board, limit=10)
    assert len({labels for name, *labels in found if name == "driftwise_series_output" for labels in labels}) == 10
    assert found[("driftwise_series_unlisted",)] == 40.0


def test_long_keys_stay_apart_and_odd_states_are_counted():
    board = Simulated(["k" * 500 + "1", "k" * 500 + "2"], at=1.7e9)
    board.tick()
    first = board.keys[0]
    board.views[first] = dataclasses.replace(board.views[first], status="on holiday")
    found = told(board)
    names = [dict(labels)["series"] for name, *labels in found if name == "driftwise_series_output"]
    assert len(set(names)) == 2 and max(map(len, names)) <= 200 and found["driftwise_series", ("state", "other")] == 1.0
