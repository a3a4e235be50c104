"""Boats beside each other: whose a plot is, and that its neighbour's plots alone make a mean NIS large."""

import json

import numpy as np
from driftwise_studies.papers.recordings import boats
from driftwise_studies.score.motions import neighbours
from driftwise_studies.score.ours import tracked


def test_a_plot_of_two_boats_is_the_nearer_ones_alone(tmp_path):
    """Two scans of two boats 10 m apart; the second scan sees one of them."""
    where = tmp_path / "autoferry"
    where.mkdir()
    plots = [[100.0, 100.5], [0.0, 10.0]], [[102.0], [9.0]]  # North, East
    scans = [dict(sensorID=2, time=2.0 * k, ownshipPosition=[0, 0], measurement=m) for k, m in enumerate(plots)]
    truth = [[dict(targetID=i + 1, position=[100.0 + 2 * k, 10.0 * i, 0]) for i in range(2)] for k in range(2)]
    (where / "s_detections.json").write_text(json.dumps(scans))
    (where / "s_groundTruth.json").write_text(json.dumps(truth))
    both, alone = ({name: p.tolist() for name, _, p in boats(tmp_path, twice)} for twice in (True, False))
    assert both == {"s, boat 1": [[0, 100], [9, 102]], "s, boat 2": [[10, 100.5], [9, 102]]}
    assert alone == {"s, boat 1": [[0, 100]], "s, boat 2": [[10, 100.5], [9, 102]]}


def test_no_mean_nis_is_large_but_by_plots_of_the_neighbour():
    drawn = [one for k in range(12) for one in neighbours.draw(5, k)]
    squares = []
    for pair in zip(drawn[::2], drawn[1::2]):
        said = tracked(*(one.series for one in pair), neighbours.BOAT.told)
        squares += [(one.series.y - o.prediction) ** 2 / o.variance for one, o in zip(pair, said)]
    late = slice(neighbours.SKIP, None)
    every = np.array([np.mean(z[late]) for z in squares])
    own = np.array([np.mean(z[late][~one.others[late]]) for one, z in zip(drawn, squares)])
    assert np.mean(every > neighbours.MOST_NIS) > 0.1 and (own <= neighbours.MOST_NIS).all()
    name, *cells = neighbours.row("ours", drawn, squares)
    assert name == "ours" and cells[:1] == ["48"] and float(cells[3]) == 0.0
