"""The pages in a real browser: nothing fetched, no complaint, panels drawn, hover, one zoom for all, folds, print."""

import base64
import re

import numpy as np
import pytest
from browser import PROGRAM, Browser

import driftwise as dw

pytestmark = pytest.mark.skipif(PROGRAM is None, reason="no Chromium on the PATH: THE PAGES WERE NOT LOOKED AT")
LONG, JUMP, SPIKE = 100_000, 60_000, 31_415
OPEN = ["output", "input0", *(f"parameter{j}" for j in range(4)), "innovations"]
VALIDATION = ("crossed0", "crossed1", "step0", "bode0gain", "bode0phase", "nyquist0")
FOLDED = [*VALIDATION, "acf", "poles", "excitation"]

FIGURES = """
Object.fromEntries([...Bokeh.index].filter(view => view.frame).map(view => {
  const box = view.el.getBoundingClientRect(), frame = view.frame.bbox, range = view.frame.x_range
  return [view.model.name, {left: box.left, top: box.top + scrollY, width: box.width, right: box.right,
          frame: [frame.left, frame.top, frame.width, frame.height], range: [range.start, range.end]}]
}))
"""
COLUMN = """
(name, column) => {
  const of = [...Bokeh.index].find(view => view.model.name == name).model.renderers
  return of.map(r => r.data_source.columns().includes(column) ? Array.from(r.data_source.get(column)) : [])
}
"""
TOOLTIPS = """
(() => {
  const found = [], look = root => {
    for (const el of root.querySelectorAll('*')) {
      if (el.classList.contains('bk-Tooltip') && el.getBoundingClientRect().width) found.push(el.shadowRoot.textContent)
      if (el.shadowRoot) look(el.shadowRoot)
    }
  }
  look(document)
  return found.join(' | ').replace(/\\s+/g, ' ')
})()
"""


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    found = Browser(tmp_path_factory.mktemp("profile"))
    yield found
    found.close()


@pytest.fixture(scope="module")
def trace():
    """A run of 100 000 samples with a jump, a spike of one sample and a gap."""
    a = np.where(np.arange(LONG)[:, None] < JUMP, [-1.5, 0.7], [-1.2, 0.7])
    y, u = dw.simulate(a, [1.0, 0.5], samples=LONG, noise_std=0.1, seed=4)
    y[SPIKE] += 60
    y[80_000:81_000] = np.nan
    return dw.Joint(2, inputs=1, memory=dw.RestartOnChange(), dt=60.0).scaled_to(y, u).scan(y, u)


@pytest.fixture(scope="module")
def path(trace, tmp_path_factory):
    labels = {"output": "level (m)", "inputs": ["valve (%)"], "origin": "2024-03-01"}
    return trace.report(tmp_path_factory.mktemp("page") / "page.html", labels=labels, title="A tank")


@pytest.fixture(scope="module")
def page(browser, path):
    """The page, opened once; every test leaves it as it was."""
    browser.open(path)
    return browser


def place(page, name, x=0.5, y=0.5):
    """Scroll a figure into view; return the place at these shares of its frame."""
    top = page.run(FIGURES)[name]["top"]
    page.run(f"scrollTo(0, {top - 150})")
    found = page.run(FIGURES)[name]
    left, over, width, height = found["frame"]
    return found["left"] + left + x * width, top - page.run("scrollY") + over + y * height


def test_opens_without_network_and_complaint_and_is_small(page, path):
    assert page.errors == []
    assert [url for url in page.requests if not url.startswith(("data:", path.as_uri()))] == []
    assert path.stat().st_size < 3e6
    figures = page.run(FIGURES)
    assert set(figures) == {*OPEN, *FOLDED, *(["closeup"] if "closeup" in figures else [])}
    tops = [figures[name]["top"] for name in OPEN]
    assert tops == sorted(tops), "an engineer looks at the output first"
    assert tops[0] < 768, "the first figure begins on the first screen of a laptop"
    assert len({(figures[name]["frame"][0], figures[name]["frame"][2]) for name in OPEN}) == 1, "one above the other"
    assert page.run("document.documentElement.scrollWidth") <= 1366
    assert page.run("[...document.querySelectorAll('.card')].every(card => card.scrollWidth <= card.clientWidth)")
    assert page.run("document.querySelectorAll('details[open]').length") == 0


def test_spikes_gaps_and_alarms_survive_thinning(page, trace):
    rows, values = page.run(f"({COLUMN})('output', 'k')"), page.run(f"({COLUMN})('output', 'y')")
    assert max(map(len, rows)) <= 20_000
    k, y = rows[1], values[1]
    assert y[k.index(SPIKE)] == pytest.approx(trace.y[SPIKE], rel=1e-6)
    assert None in y, "a gap stays a gap"
    seen = [value for value in y if value is not None]
    assert (min(seen), max(seen)) == pytest.approx((np.nanmin(trace.y), np.nanmax(trace.y)))
    told = [event.time for event in trace.jumps()]
    start = np.datetime64("2024-03-01").astype("datetime64[ms]").astype(float)
    marks = page.run(f"({COLUMN})('output', 't')")[-1]
    np.testing.assert_allclose((np.array(marks) - start) / 1000, told)
    assert any(0 <= when / 60 - JUMP < 200 for when in told)
    for where in ("#prediction table", ".lead", ".cards"):
        assert "2024-04-11" in page.run(f"document.querySelector('{where}').innerText"), "when, as a date"


def test_hover_tells_sample_and_value(page, trace):
    for name, said in (("output", "measured"), ("parameter0", "a1"), ("input0", "valve")):
        page.mouse("mouseMoved", *place(page, name, 0.31))
        text = page.wait(f"{TOOLTIPS}.includes('{said}') && {TOOLTIPS}")
        sample, value = re.search(r"sample:? ?(\d+) .*?" + said + r"(?: \(%\))?:? ?([-\d.e+]+)", text).groups()
        column = {"output": trace.y, "parameter0": trace.parameters[:, 0], "input0": trace.u[:, 0]}[name]
        assert float(value) == pytest.approx(column[int(sample)], rel=1e-3)
        assert int(sample) == pytest.approx(0.31 * LONG, abs=500)
        assert "2024-03-" in text


def test_zoom_is_shared_and_undone(page):

    def ranges():
        figures = page.run(FIGURES)
        assert len({tuple(figures[name]["range"]) for name in OPEN}) == 1
        return figures["output"]["range"]

    whole = ranges()
    x, y = place(page, "parameter1", 0.2)
    page.drag(x, y, place(page, "parameter1", 0.4)[0], y + 3)
    low, high = ranges()
    size = whole[1] - whole[0]
    assert ((low - whole[0]) / size, (high - whole[0]) / size) == pytest.approx((0.2, 0.4), abs=0.01)
    for count in (1, 2):
        for kind in ("mousePressed", "mouseReleased"):
            page.mouse(kind, x, y, button="left", clickCount=count)
    page.wait(f"{FIGURES}.output.range[1] == {whole[1]}")
    assert ranges() == whole
    page.mouse("mouseWheel", x, y, deltaX=0, deltaY=-200, modifiers=2)  # with Ctrl
    page.wait(f"{FIGURES}.output.range[1] < {whole[1]}")
    zoomed, at = ranges(), page.run("scrollY")
    page.mouse("mouseWheel", x, y, deltaX=0, deltaY=200)
    page.wait(f"scrollY > {at}")
    assert ranges() == zoomed, "the bare wheel scrolls the page"
    page.run("Bokeh.documents[0].get_model_by_name('output').reset.emit()")


def test_folds_open_with_their_figures(page):
    page.run("document.querySelector('.more button').click()")
    assert page.run("document.querySelectorAll('details:not([open])').length") == 0
    page.wait(f"Object.values({FIGURES}).every(figure => figure.width > 100)")
    page.wait("Bokeh.documents.every(d => d.is_idle)")
    inked = """[...Bokeh.index].filter(view => view.frame).map(view => {
        const {ctx, canvas} = view.canvas_view.primary, data = ctx.getImageData(0, 0, canvas.width, canvas.height).data
        return data.some((value, k) => k % 4 == 3 && value > 0)
    })"""
    assert all(page.run(inked))
    page.run("document.querySelectorAll('details').forEach(fold => fold.open = false)")
    assert page.errors == []


def test_prints_on_a4_with_nothing_cut(page):
    page.run("""matchMedia('print').addEventListener('change', event => {
        const main = document.querySelector('main').getBoundingClientRect()
        if (event.matches) window.printed = {
            paper: document.documentElement.clientWidth, width: main.width, right: main.right,
            figures: [...Bokeh.index].filter(view => view.frame && !view.el.closest('details'))
                .map(view => view.el.getBoundingClientRect()).map(({width, right}) => [width, right]) }
    })""")
    pdf = base64.b64decode(page.call("Page.printToPDF", preferCSSPageSize=True)["data"])
    width, height = map(float, re.search(rb"/MediaBox ?\[0 0 ([\d.]+) ([\d.]+)\]", pdf).groups())
    assert (width, height) == pytest.approx((595, 842), abs=1)
    printed = page.run("window.printed")
    assert printed["width"] > 0.95 * printed["paper"], "Chromium did not make the page smaller to hold what overflows"
    for width, right in printed["figures"]:
        assert width > 0.9 * printed["width"] and right <= printed["right"]


def test_a_page_of_plain_columns(browser, tmp_path):
    """The recipe of `page`, with the members of an average."""
    from driftwise.report.axes import Timeline
    from driftwise.report.marks import marks
    from driftwise.report.page import Card, Page, Panel, group, named
    from driftwise.report.panels import verdict_table, zoom_words
    from driftwise.report.plots import innovations, output, panels, weights
    from driftwise.results.verdicts import Verdict

    rng, T = np.random.default_rng(1), 9000
    time, z, shares = np.arange(T) * 0.5, rng.standard_normal(T), rng.dirichlet(np.ones(12), T)
    z[100:300] = np.nan
    line, members = Timeline(time, "time (s)"), [f"member {j}" for j in range(12)]
    figures = [output(line, z, 0 * z, np.full(T, 1.96), "level (m)", marks=marks([]))]
    figures += named("parameter", panels(line, ["gain"], shares[:, :1], 0 * shares[:, :1]))
    figures += [weights(line, shares, members), innovations(line, z)]
    cards = [group("The plant", [Card("Time constant", "1.8", unit="s")])]
    rows = [Verdict("NIS", 1.02, (0.9, 1.1), True, "error bars are right")]
    rows += [Verdict("whiteness", 3e-9, (0.01, np.inf), False, "<try> more")]
    parts = [Panel("forecast", "Forecast", "", (*figures, zoom_words(line)))]
    parts.append(Panel("verdicts", "Verdicts", "", (verdict_table(rows),)))
    browser.open(Page("An average", parts, "It is so. And more.", cards=cards).write(tmp_path / "average.html"))
    assert browser.errors == []
    assert set(browser.run(FIGURES)) == {figure.name for figure in figures}
    tops = browser.run(f"({COLUMN})('weights', 'top7')")
    assert np.nanmin(tops[0]) == pytest.approx(1, abs=1e-6), "the shares add up to one"
    assert "<try> more" in browser.run("document.querySelector('#verdicts').innerText")
