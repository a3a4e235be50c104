"""What a notebook shows: words and tables of every result; nothing prints where it lies in memory; plots are Axes."""

import re
import tempfile

import matplotlib
import numpy as np
import pytest

import driftwise as dw

matplotlib.use("Agg")
Y, U = dw.simulate([-0.8], [1.0], samples=300, noise_std=0.1, seed=1)
ADDRESS = re.compile(r"0x[0-9a-f]{6,}| object at ")


def results():
    """Return results of every public kind by name."""
    y = Y.copy()
    y[200] += 5.0
    est, time = dw.ARX(1, 1, memory=dw.AutoMemory()), 4.0 * np.arange(30)
    trace, found = est.scan(y, U), dw.identify({"heater": U, "temperature": Y})
    tracks = dw.track({"time": time, "east": 150 * time, "north": 80 * time})
    table = {"key": np.repeat(["a", "b"], 300), "y": np.r_[Y, Y]}
    cart = dw.Plant([[0, 1], [0, 0]], states=("position", "speed"))
    observed = dw.WindowObserver(cart, 1.0, noise_std=0.1, dt=0.1).scan(0.1 * np.arange(30))
    return {
        "trace": trace,
        "summary": trace.summary(),
        "model": trace.model(),
        "events": trace.events(),
        "jumps": trace.jumps(),
        "diagnosis": trace.diagnose(),
        "validation": trace.validate(),
        "smoothed parameters": dw.ARX(1, 1).smooth(Y, U),
        "smoothed": dw.Joint(1, inputs=1).smooth(Y, U),
        "identification": found,
        "comparison": dw.compare(Y, U, {"one": dw.ARX(1, 1), "two": dw.ARX(2, 2)}),
        "tracks": tracks,
        "track": tracks[0].trace,
        "observer": observed,
        "observer events": observed.events(),
        "fleet": dw.Fleet(dw.AR(1), ["a", "b"]),
        "average": dw.ModelAverage([dw.ARX(1, 1)]).scaled_to(Y, U).scan(Y, U),
        # what has words but no table of its own
        "claims": found.claims,
        "forecast": found.forecast_summary,
        "orders": dw.analysis.choose_order(Y, U, orders=range(1, 3)),
        "alarms": dw.PageHinkley().scan(Y),
        "fleet run": dw.fleet.run_fleet(dw.fleet.FleetJob(table, "key", "y", dw.AR(1), tempfile.mkdtemp())),
        "estimator": est,
        "plant": cart,
    }


@pytest.fixture(scope="module")
def shown():
    return results()


def test_nothing_prints_an_address(shown):
    for name, result in shown.items():
        for text in (repr(result), str(result), getattr(result, "_repr_html_", str)()):
            assert not ADDRESS.search(text), (name, text[:200])


def test_results_are_shown_as_words_and_tables(shown):
    for name in list(shown)[: list(shown).index("average") + 1]:
        if name != "jumps":
            html = shown[name]._repr_html_()
            assert re.search(r"<(p|table|pre)>", html) and html.count("<tr>") == html.count("</tr>"), name
    assert "OUTLIER" in shown["events"]._repr_html_() and "outlier" in str(shown["events"])
    assert shown["tracks"]._repr_html_().count("<tr>") == 2 and "coverage" in shown["diagnosis"]._repr_html_()


def test_names_in_a_table_are_no_tags():
    assert "<b>" not in dw.Fleet(dw.AR(1), ["<b>"])._repr_html_()


def test_plots_are_axes(shown):
    for name in ("trace", "smoothed parameters", "observer"):
        assert all(hasattr(ax, "plot") for ax in np.ravel(shown[name].plot())), name
