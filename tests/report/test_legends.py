"""A legend is a row where the frame is wide enough, and broken into several where it is not."""

import pytest
from browser import PROGRAM, Browser

import driftwise as dw
from driftwise.report.axes import ENTRY, LETTER, legend_widths

SHOWN = (
    "Bokeh.documents.flatMap(d => [...d.get_model_by_name ? d._all_models.values() : []])"
    ".filter(m => m.type == 'Legend').map(m => m.ncols)"
)


def test_widths_are_of_one_column_to_all_in_a_row():
    found = legend_widths(["one", "seven77", "two"])
    one, seven = ENTRY + 3 * LETTER, ENTRY + 7 * LETTER
    assert found == [seven, seven + one, seven + 2 * one]


@pytest.mark.skipif(PROGRAM is None, reason="no Chromium on the PATH: THE LEGENDS WERE NOT LOOKED AT")
def test_a_narrow_page_breaks_the_row_and_a_wide_one_does_not(tmp_path):
    y, u = dw.simulate([-0.7], [1.0], samples=200, noise_std=0.3, seed=1)
    dw.ARX(1, 1).scan(y, u).report(tmp_path / "page.html")
    browser = Browser(tmp_path / "profile")
    try:
        for width, is_row in ((1280, True), (400, False)):
            browser.screen(width, 900)
            browser.open(tmp_path / "page.html")
            browser.wait(f"({SHOWN})[0] {'==' if is_row else '!='} 'auto'")
    finally:
        browser.close()
