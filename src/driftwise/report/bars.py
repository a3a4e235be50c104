"""The Bokeh bars of the report: what is left in the innovations, what was learned, how probable each order is."""

from __future__ import annotations

from driftwise.models.quantities import NORMAL_95
from driftwise.report.axes import across, dress, shade
from driftwise.report.figure import PALETTE


def _blank(name: str, height: int, x_label: str, y_label: str, **more):
    from bokeh.plotting import figure

    return dress(figure(name=name, height=height, tools="save", **more), x_label, y_label)


def _listed(name: str, height: int, factors: list[str], x_label: str, y_label: str, **more):
    """Return an empty figure for a bar in each row."""
    from bokeh.models.ranges import FactorRange

    height = max(70 + 30 * len(factors), height)
    fig = _blank(name, height, x_label, y_label, y_range=FactorRange(factors=factors[::-1]), **more)
    fig.ygrid.grid_line_color = None
    return fig


def autocorrelations(values, count: float):
    """Autocorrelation of the innovations from lag 1 with the 95 % bounds of white noise."""
    import numpy as np

    values = np.asarray(values, float)
    bound = NORMAL_95 / np.sqrt(max(count, 1.0))
    reach = max(1.25 * np.nanmax(np.abs(values), initial=0.0), 2.2 * bound)
    ranges = {"y_range": (-reach, reach), "x_range": (0.3, len(values) + 0.7)}
    fig = _blank("acf", 250, "lag (samples)", "autocorrelation", **ranges)
    shade(fig, -bound, bound)
    across(fig, 0)
    lags = np.arange(1, len(values) + 1)
    for beyond, look in ((False, {"color": PALETTE["predicted"]}), (True, {"color": PALETTE["alert"]})):
        some = (abs(values) > bound) == beyond
        more = {"hatch_pattern": "/", "hatch_color": "#ffffff"} if beyond else {}
        fig.vbar(lags[some], top=values[some], width=0.55, **look, **more)
    return fig


def excitation(directions, threshold: float):
    """Bars of posterior over prior variance per direction, on a log scale; long bars were not learned."""
    from math import log10

    names: list[str] = []
    seen: dict[str, int] = {}
    for text, _ in directions:
        text = _short(text)
        seen[text] = seen.get(text, 0) + 1
        names.append(text if seen[text] == 1 else f"{text} ({seen[text]})")
    ratios = [min(max(float(r), 1e-30), 1.0) for _, r in directions]
    decades = max(1, round(-log10(min([*ratios, 0.1]))) + 1)
    step = -(-decades // 5)
    lowest = 10.0**-decades
    ranges = {"x_axis_type": "log", "x_range": (lowest, 10 ** (0.04 * decades))}
    least = 300 if len(names) > 2 else 0
    fig = _listed("excitation", least, names, "variance left: posterior / prior", "", **ranges)
    colors = [PALETTE["warn"] if r > threshold else PALETTE["good"] for r in ratios]
    fig.hbar(y=names, left=lowest, right=ratios, height=0.5, color=colors, alpha=0.85)
    across(fig, threshold, dimension="height", line_color=PALETTE["warn"], line_dash="dashed")
    fig.xaxis.ticker = [10.0**-k for k in range(0, decades + 1, step)]
    return fig


def _short(text: str, most: int = 28) -> str:
    """Return the first terms of a long combination."""
    if len(text) <= most:
        return text
    cut = max(text.rfind(sign, 0, most) for sign in (" + ", " \u2212 "))
    return text[:cut] + " \u2026"


def orders(names: list[int], probability):
    """Bars of the posterior probability of each order."""
    import numpy as np

    factors = [str(name) for name in names]
    p = np.asarray(probability, float)
    fig = _listed("orders", 190, factors, "posterior probability", "order", x_range=(0, 1.02))
    colors = [PALETTE["predicted"] if v == p.max() else PALETTE["quiet"] for v in p]
    fig.hbar(y=factors, left=0, right=p, height=0.5, color=colors, alpha=0.85)
    fig.xaxis.ticker = [0, 0.25, 0.5, 0.75, 1]
    return fig
