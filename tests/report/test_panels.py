"""A page is a list of panels: text is escaped, what is None is left out, what has a hint is folded."""

import re

import numpy as np

from driftwise.report.axes import single
from driftwise.report.page import Card, Page, Panel, columns, group, named, stack, table, tag


def test_a_page_of_panels_without_figures(tmp_path):
    shown = table(["what", ""], [["a < b", tag("fine", "good")]])
    panels = [Panel("one", "First & only", "Said <b>so</b>.", (shown,)), None, Panel("two", "Second", "", (), "folded")]
    page = Page("A <tank>", panels, "It is slow. And more.", ["3 samples", "no input"], [group("G", [Card("N", "1")])])
    text = page.write(tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<title>A &lt;tank&gt;</title>" in text and "3 samples \u00b7 no input" in text
    assert "<strong>It is slow.</strong> And more." in text
    assert re.findall(r'<(section|details) id="(\w+)"', text) == [("section", "one"), ("details", "two")]
    assert "Said &lt;b&gt;so&lt;/b&gt;." in text and "a &lt; b" in text and '<span class="tag good">fine</span>' in text
    assert "{{" not in text.split("</style>")[0] and table(["what"], []) == ""


def test_figures_stand_where_the_panel_puts_them():
    from bokeh.plotting import figure

    few, many = named("few", [figure() for _ in range(3)]), named("many", [figure() for _ in range(5)])
    panel = Panel("p", "P", "", (*stack(few), *stack(many), tuple(columns([])), (few[0],)))
    drawn = {one.name: f"<{one.name}>" for one in panel.figures}
    assert list(drawn) == ["few0", "few1", "few2", *(f"many{j}" for j in range(5))]
    text = panel.html(drawn)
    assert text.index("<few2>") < text.index('<div class="many" style="--columns:2">') < text.index("<many0>")
    assert text.endswith('<div class="center"></div><div class="center"><few0></div></section>')


def test_numbers_beyond_single_precision_stay_as_they_are():
    small, large = np.array([1.0, np.nan, -2.5]), np.array([1e39, np.nan])
    assert single(small).dtype == np.float32 and single(large) is large and single(np.array([3])).dtype.kind == "i"
