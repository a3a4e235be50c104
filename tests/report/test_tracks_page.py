"""The page of tracks in a real browser: nothing fetched, no complaint, all drawn, another track on demand, small."""

import numpy as np
import pytest
from browser import PROGRAM, Browser
from test_page import COLUMN, FIGURES

import driftwise as dw
from driftwise.report import track_report
from driftwise.report.track_plots import running_mean
from driftwise.report.tracks_page import write
from driftwise.tracking.plots import Fault, plots

PANELS = ["altitude", "speed", "turn", "manoeuvre", "east", "north", "nis"]
SITE = ("52/13", 48.1, 2.1)


def flights(objects, T, seed=1):
    """Return plots of objects of which every second one turns right by 90 degrees; the first has fewer plots."""
    rng, k, found = np.random.default_rng(seed), np.arange(T), []
    for i in range(objects):
        turning = (k > T // 2) & (k <= T // 2 + 15) & (i % 2 == 0)
        course = i + np.cumsum(np.where(turning, np.radians(6.0), 0.0))
        path = np.cumsum(600.0 * np.stack([np.sin(course), np.cos(course)], axis=1), axis=0) + 9000.0 * i
        rows = slice(T // 4 if i == 0 else 0, None)
        found.append((1.7e9 + 0.1 * i + 4.0 * k[rows], (path + 30 * rng.standard_normal((T, 2)))[rows], i))
    time, position, who = (np.concatenate(c) for c in zip(*((t, p, np.full(len(t), i)) for t, p, i in found)))
    key = [f"{i:06X}" for i in who]
    return plots(
        time, position, altitude=5000 + 10.0 * who, key=key, name=[f"CALL{i}" for i in who], sensor="52/13",
        origin=(48.0, 2.0), faults=[Fault("a.pcap", 99, "<b>bits</b>: 7, this is the first")],
    )  # fmt: skip


def test_a_moored_boat_does_not_turn():
    """Errors of a place turn a course as far as one likes; what moves and turns is told."""
    rng, t = np.random.default_rng(4), 1.7e9 + 10.0 * np.arange(200)
    swing = np.cumsum(0.05 * rng.standard_normal((200, 2)), axis=0)
    moored = 0.5 * np.round((swing + 0.5 * rng.standard_normal((200, 2))) / 0.5)
    found = track_report.rows(dw.track(plots(t, moored, key="MOORED"), "boat"))
    assert len(found) == 1 and not found[0].turns
    course = np.radians(3) * np.clip(t - t[80], 0, 60)
    path = np.cumsum(60.0 * np.stack([np.sin(course), np.cos(course)], axis=1), axis=0)
    found = track_report.rows(dw.track(plots(t, path + 3 * rng.standard_normal(path.shape), key="UNDER WAY"), "boat"))
    assert len(found[0].turns) == 1 and 150 < found[0].turns[0].angle < 210


@pytest.fixture(scope="module")
def tracks():
    return dw.track(flights(4, 80))


@pytest.fixture(scope="module")
def path(tracks, tmp_path_factory):
    return tracks.report(tmp_path_factory.mktemp("tracks") / "page.html", "A <radar>", sites=[SITE])


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    if PROGRAM is None:
        pytest.skip("no Chromium on the PATH: THE PAGE WAS NOT LOOKED AT")
    found = Browser(tmp_path_factory.mktemp("profile"))
    yield found
    found.close()


def test_numbers_in_words(tracks):
    rows = track_report.rows(tracks)
    assert [r.plots for r in rows] == [80, 80, 80, 60] and track_report.objects(rows) == 4
    assert {r.called: len(r.turns) for r in rows} == {"CALL0": 1, "CALL1": 0, "CALL2": 1, "CALL3": 0}
    for (turn,) in (r.turns for r in rows if r.turns):
        assert turn.angle == pytest.approx(90, abs=8), "15 steps of 6 degrees"
        assert turn.end - turn.start == pytest.approx(60, abs=16)
    words = track_report.lead(rows, tracks.counts)
    assert words.startswith("4 objects in 5.27 min, of which CALL2 and CALL0 turned. The longest turn: CALL")
    assert "° to the right from 2023-11-14 22:16" in words
    assert track_report.fault_words(tracks.faults) == "7 records skipped – <b>bits</b>: 7 (first at 99)."


def test_running_mean_steps_over_what_is_missing():
    x = np.array([1.0, np.nan, 2.0, 3.0, np.nan, 7.0])
    np.testing.assert_array_equal(running_mean(x, 2), [np.nan, np.nan, 1.5, 2.5, 2.5, 5.0])


def test_nothing_to_show_is_a_page_too(tmp_path):
    found = dw.track(plots([0.0], [[0.0, 0.0]]))
    text = write(found, tmp_path / "page.html").read_text()
    assert "No object was seen often enough to make a track, in 1 plot." in text


@pytest.mark.slow
def test_a_hundred_thousand_plots_are_a_small_page(tmp_path):
    found = dw.track(flights(40, 2500))
    assert sum(map(len, found)) > 98_000
    assert write(found, tmp_path / "page.html").stat().st_size < 5e6


def test_opens_draws_and_shows_another_track(browser, tracks, path):
    browser.open(path)
    assert browser.errors == []
    assert [url for url in browser.requests if not url.startswith(("data:", path.as_uri()))] == []
    figures = browser.run(FIGURES)
    assert set(figures) == {"plan", *PANELS}
    assert browser.run("document.documentElement.scrollWidth") <= 1366
    assert browser.run("document.querySelector('h1').innerText") == "A <radar>"
    assert "<b>bits</b>" in browser.run("document.querySelector('#skipped').textContent")
    (*_, width, height), (start, end) = figures["plan"]["frame"], figures["plan"]["range"]
    view = "[...Bokeh.index].find(view => view.model.name == 'plan').frame.y_range"
    assert (end - start) / width == pytest.approx(browser.run(f"({view}.end - {view}.start)") / height, rel=0.02)
    texts = [text for some in browser.run(f"({COLUMN})('plan', 'text')") for text in some]
    assert {f"CALL{k}" for k in range(4)} | {"52/13"} <= set(texts) and any(text.endswith(" km") for text in texts)

    rows = track_report.rows(tracks)
    for name, column in (("speed", "speed"), ("turn", "turn"), ("manoeuvre", "manoeuvre"), ("east", "east")):
        assert browser.run(f"({COLUMN})('{name}', '{column}').some(values => values.length == 80)")
    last = next(k for k, r in enumerate(rows) if r.called == "CALL0")
    choose = f"(() => {{ const which = document.getElementById('which'); which.value = '{last}'; which.onchange() }})()"
    browser.run(choose)
    browser.wait("Bokeh.documents.every(d => d.is_idle)")
    shown = browser.run(f"({COLUMN})('speed', 'speed').find(values => values.length == 60)")
    np.testing.assert_allclose(shown, rows[last].track.trace.speed, rtol=1e-5)
    after = browser.run(FIGURES)
    assert after["speed"]["range"] == after["nis"]["range"] == [1000 * rows[last].start, 1000 * rows[last].end]
    # a click on a track chooses it as well; one beside all of them changes nothing
    browser.run("Bokeh.documents[0].get_model_by_name('tracks').selected.indices = [1]")
    assert browser.run("document.getElementById('which').value") == "1"
    browser.run("Bokeh.documents[0].get_model_by_name('tracks').selected.indices = []")
    assert browser.run("Bokeh.documents[0].get_model_by_name('tracks').selected.indices[0]") == 1
    assert browser.errors == []


def test_prints_with_nothing_cut(browser, path):
    browser.open(path)
    browser.run("""matchMedia('print').addEventListener('change', event => {
        const main = document.querySelector('main').getBoundingClientRect()
        if (event.matches) window.printed = [main.width, main.right, [...Bokeh.index].filter(view => view.frame)
            .map(view => view.el.getBoundingClientRect()).map(({width, right}) => [width, right])]
    })""")
    browser.call("Page.printToPDF", preferCSSPageSize=True)
    width, right, figures = browser.run("window.printed")
    assert len(figures) == 1 + len(PANELS)
    assert all(w > 0.9 * width and r <= right for w, r in figures)
