"""The page in a headless Chromium: its numbers are those of the board, whatever happens to the service meanwhile."""

import time
from urllib.parse import quote

import pytest

pytest.importorskip("starlette", reason='pip install "driftwise[live]"')
from browser import PROGRAM, Browser
from live.simulated_board import Simulated
from live.simulated_site import Running

from driftwise.live.web.access import Access, hashed

pytestmark = [
    pytest.mark.service,
    pytest.mark.skipif(PROGRAM is None, reason="no Chromium on the PATH: THE LIVE PAGE WAS NOT TESTED"),
]
LIVE = "document.querySelector('#link').dataset.link == 'live'"
NASTY = "<img src=x onerror=alert(1)>"
KEYS = ["hall 1/pump 2", "hall 1/pump 10", NASTY, "größe"]
ROW = "[...document.querySelectorAll('.row')].find(row => row.dataset.key == {0!r})"


@pytest.fixture
def browser(tmp_path):
    browser = Browser(tmp_path / "profile")
    yield browser
    browser.close()


@pytest.fixture
def site():
    board = Simulated(KEYS, at=time.time() - 60)
    for _ in range(60):
        board.tick()
    for seen in list(board.told):
        board.acknowledge(seen.number)
    site = Running(board)
    yield site
    site.stop()


def shown(browser, key):
    """Return the cells of a row as they stand there."""
    row = ROW.format(key)
    return browser.run(
        f"['.output', '.predicted', '.nis', '.state'].map(part => {row}.querySelector(part).textContent)"
    )


def numbers(text):
    return [float(part) for part in text.replace("\u2212", "-").replace("m3/h", "").split("±")]


def agree(browser, board):
    """Hold every row to the board, to the digits that it shows."""
    for key in KEYS:
        view, (output, predicted, nis, status) = board.view(key), shown(browser, key)
        assert numbers(output)[0] == pytest.approx(view.output, rel=1e-3)
        half = (view.band[1] - view.band[0]) / 2
        assert numbers(predicted) == pytest.approx([view.prediction, half], abs=0.06 * half)
        assert numbers(nis)[0] == pytest.approx(view.nis, rel=0.06) and status.lower() == view.status


def test_numbers_follow_the_state(browser, site):
    browser.visit(site.address)
    browser.wait(f"{LIVE} && document.querySelectorAll('.row').length == {len(KEYS)}")
    agree(browser, site.board)
    for _ in range(3):
        site.do(site.board.tick)
        output = f"{site.board.view(KEYS[0]).output:.3g}".replace("-", "\u2212")[:4]
        browser.wait(f"{ROW.format(KEYS[0])}.querySelector('.output').textContent.startsWith({output[:3]!r})")
        browser.wait("new Promise(done => setTimeout(() => done(true), 400))")
        agree(browser, site.board)
    assert browser.run("[...document.querySelectorAll('.row a')].map(a => a.textContent)")[:2] != [], "rows are there"
    assert browser.run("document.querySelectorAll('.rows img').length") == 0, "names are text"
    own = {site.address + path for path in ("/", "/static/app.js", "/stream")}
    assert own <= set(browser.requests) and all(url.startswith(site.address) for url in browser.requests)
    assert browser.errors == []


def test_one_series_its_events_and_acknowledging(browser, site):
    key = NASTY
    browser.visit(f"{site.address}/#/series/{quote(key, safe='')}")
    browser.wait(f"{LIVE} && document.querySelectorAll('#numbers tr').length == 2")
    seen = site.do(site.board.happened, key, "jump", f"b1 jumped {NASTY}")
    browser.wait("document.querySelectorAll('#events button').length == 1")
    site.do(site.board.tick)
    view = site.board.view(key)
    browser.wait(f"document.querySelector('#cards').textContent.includes('{view.count}')")
    assert view.status == "well" and browser.run("document.querySelector('#series-state').textContent") == "Jumped"
    for k, parameter in enumerate(view.parameters):
        name, estimate, _ = browser.run(
            f"[...document.querySelectorAll('#numbers tr')[{k}].children].map(c => c.textContent)"
        )
        assert name == parameter.name
        assert numbers(estimate) == pytest.approx([parameter.value, parameter.std], abs=0.06 * parameter.std)
    charts = browser.run("document.querySelectorAll('.chart canvas').length")
    assert charts == 4, "output, two parameters, NIS"
    assert NASTY in browser.run("document.querySelector('#events').textContent")
    browser.run("document.querySelector('#events button').click()")
    browser.wait("document.querySelectorAll('#events button').length == 0")
    assert site.board.told[seen.number - 1].acknowledged
    browser.wait("document.querySelector('#series-state').textContent == 'Well'")
    assert browser.errors == []


def test_the_page_comes_back_after_the_service(browser, site):
    browser.visit(site.address)
    browser.wait(LIVE)
    site.stop()
    browser.wait("document.querySelector('#link').dataset.link == 'gone'")
    site.board.tick()
    site.start()
    browser.wait(LIVE)
    browser.wait(f"document.querySelectorAll('.row').length == {len(KEYS)}")
    agree(browser, site.board)
    site.do(site.board.tick)
    browser.wait("new Promise(done => setTimeout(() => done(true), 600))")
    agree(browser, site.board)
    assert [e for e in browser.errors if "ERR_CONNECTION" not in str(e) and "ERR_INCOMPLETE" not in str(e)] == []


def test_keys_alone_are_enough(browser, site):
    site.do(site.board.happened, KEYS[1], "jump", "b1 jumped")
    browser.visit(site.address)
    browser.wait(f"{LIVE} && document.querySelectorAll('.row').length == {len(KEYS)}")
    reached = []
    for _ in range(25):
        browser.press("Tab")
        reached.append(browser.run("(e => e.id || e.className || e.textContent)(document.activeElement)"))
        if browser.run("document.activeElement.closest('.row') != null"):
            break
    assert {"skip", "brand", "theme", "find", "sort"} <= set(reached)
    key = "document.activeElement.closest('.row').dataset.key"
    assert browser.run(key) == KEYS[1], "who needs a look is first"
    browser.press("Tab")
    assert browser.run("document.activeElement.textContent") == "Seen"
    browser.press("Tab", shift=True)
    browser.press("ArrowDown")
    assert browser.run(key) != KEYS[1]
    browser.press("Home")
    assert browser.run(key) == KEYS[1]
    browser.press("Enter")
    browser.wait("!document.querySelector('#series').hidden")
    assert browser.run("document.querySelector('#series-title').textContent") == KEYS[1]
    assert browser.errors == []


LUMINANCE = """
(() => {
  const parts = (text) => text.match(/[\\d.]+/g).map(Number);
  const linear = rgb => rgb.slice(0, 3).map(v => v / 255);
  const light = (rgb) => linear(rgb).map(v => v <= .04045 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4)
    .reduce((sum, v, k) => sum + v * [.2126, .7152, .0722][k], 0);
  const ground = (node) => {
    for (; node; node = node.parentElement) {
      const found = parts(getComputedStyle(node).backgroundColor);
      if (found.length < 4 || found[3] > 0) return found;
    }
    return [255, 255, 255];
  };
  const faint = [];
  for (const node of document.querySelectorAll('body *')) {
    if (![...node.childNodes].some(n => n.nodeType == 3 && n.textContent.trim()) || !node.checkVisibility()) continue;
    if (node.closest('.skip, option, noscript, script')) continue;
    const [a, b] = [light(parts(getComputedStyle(node).color)), light(ground(node))].sort((x, y) => y - x);
    if ((a + .05) / (b + .05) < 4.5) faint.push([node.textContent.trim().slice(0, 30), (a + .05) / (b + .05)]);
  }
  return faint;
})()
"""
UNNAMED = """[...document.querySelectorAll('button, input, select, a')].filter(e => e.checkVisibility()
  && !(e.ariaLabel || e.textContent.trim() || e.labels?.length)).map(e => e.outerHTML)"""


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("place", ["/", "/api", f"/#/series/{quote(KEYS[0], safe='')}"])
def test_text_is_readable_and_named(browser, site, place, dark):
    site.do(site.board.happened, KEYS[0], "jump", "b1 jumped")
    browser.screen(390, 844, dark=dark, mobile=True)
    browser.visit(site.address + place)
    browser.wait("document.querySelectorAll('.row, #numbers tr, #routes tr').length > 1")
    browser.wait("new Promise(done => setTimeout(() => done(true), 500))")
    assert browser.run("document.documentElement.dataset.theme") == ("dark" if dark else "light")
    assert browser.run(LUMINANCE) == [] and browser.run(UNNAMED) == []
    assert browser.run("document.documentElement.scrollWidth") <= 390, "nothing is wider than a phone"
    assert browser.errors == []


def test_a_token_opens_the_door(browser, site):
    site.stop()
    site.access = Access(hashed("open sesame"))
    site.start()
    browser.visit(site.address)
    browser.wait("!document.querySelector('#door').hidden")
    enter = "document.querySelector('#token').value = {!r}; document.querySelector('#door button').click()"
    browser.run(enter.format("open barley"))
    browser.wait("document.querySelector('#refused').textContent != ''")
    browser.run(enter.format("open sesame"))
    browser.wait(f"{LIVE} && document.querySelectorAll('.row').length == {len(KEYS)}")
    assert browser.run("document.cookie") == "", "scripts cannot read it"
    agree(browser, site.board)
    assert [e for e in browser.errors if "401" not in str(e)] == []


def longest_tasks(browser, act, seconds):
    """Return the processor time (ms) of the five longest tasks of the main thread while `act` is done each second.

    Processor time and not that on the wall: a machine that is busy with other tests stretches every task.
    """
    browser.call("Tracing.start", traceConfig={"includedCategories": ["toplevel", "__metadata"]})
    for k in range(seconds):
        act(k)
        browser.wait("new Promise(done => setTimeout(() => done(true), 1000))")
    before = len(browser.said)
    browser.call("Tracing.end")
    browser.until("Tracing.tracingComplete")
    told = [m["params"]["value"] for m in browser.said[before:] if m.get("method") == "Tracing.dataCollected"]
    events = [event for part in told for event in part]
    mains = {(e["pid"], e["tid"]) for e in events if e.get("args", {}).get("name") == "CrRendererMain"}
    tasks = [e["tdur"] / 1e3 for e in events if e.get("ph") == "X" and "tdur" in e and (e["pid"], e["tid"]) in mains]
    return sorted(tasks)[-5:]


def test_a_thousand_series_keep_the_page_quick(browser):
    board = Simulated([f"hall {k % 9}/pump {k}" for k in range(1000)])
    for _ in range(30):
        board.tick(census_too=False)
    site = Running(board, tick=1.0)
    try:
        browser.visit(site.address)
        browser.wait(f"{LIVE} && document.querySelectorAll('.row').length > 5")
        count = "Number(document.querySelector('#counts').textContent.match(/, (.+) samples/)[1].replace(/\\D/g, ''))"
        before = browser.run(count)
        tasks = longest_tasks(browser, lambda k: browser.run(f"scrollTo(0, {k % 5 * 700}); true"), 60)
        assert len(tasks) == 5 and tasks[-1] < 50.0, tasks
        assert browser.run(count) > before + 20_000, "samples came meanwhile"
        assert 5 < browser.run("document.querySelectorAll('.row').length") < 60, "only rows in sight are elements"
        assert browser.errors == []
        print(f"\n1000 series at 1 Hz, 60 s: longest tasks of the main thread {[round(t, 1) for t in tasks]} ms")
    finally:
        site.stop()
