"""The z-plane of the report: poles and zeros on the unit circle, each with its 95 % ellipse."""

from __future__ import annotations

from math import isfinite
from typing import Any

from driftwise.report.axes import dress, legend
from driftwise.report.figure import PALETTE

FAR = 2.5  # a zero farther out than this is counted, not drawn
CLOUD = 300  # posterior draws shown where an ellipse would mislead
MARKERS = ("circle", "square", "diamond", "triangle", "inverted_triangle", "hex")


SMALL = 0.12  # an ellipse smaller than this hides behind its mark: it gets a window of its own


def own_zeros(model, input: int) -> list[tuple[complex, float]]:
    """Return (zero, std) of an input, without those that the orders themselves put at 0 or at infinity."""
    pairs = zip(model.zeros(input), model.zeros_std(input))
    return [(z, std) for z, std in pairs if isfinite(abs(z)) and (z != 0 or std > 0)]


def smallest_window(model):
    """Return (centre, half width) of a window on the largest pole where its ellipse is too small to see, or None."""
    from driftwise.models.ellipse import confidence_ellipse

    for pole, covariance, how in zip(model.poles, model.poles_covariance, model.method):
        if pole.imag >= 0 and how in ("first order", "sampled"):
            size = confidence_ellipse(covariance).semi_axes[0]
            return (pole, 1.7 * size) if 1e-9 < size < SMALL else None
    return None


def plane(model, window=None):
    """Draw poles (crosses) and zeros (open marks, one shape per input); a cloud of draws where they are sampled.

    ``window`` is (centre, half width) of a close-up; around the unit circle if omitted.
    """
    import numpy as np
    from bokeh.models import HoverTool
    from bokeh.plotting import figure

    reach = _reach(model)
    (x, y), half = ((0.0, 0.0), reach) if window is None else ((window[0].real, window[0].imag), window[1])
    size, name = (310, "poles") if window is None else (150, "closeup")
    labels = ("real part", "imaginary part") if window is None else ("close-up of a pole", "")
    look: dict[str, Any] = {"width": size + 90, "height": size + 90, "frame_width": size, "frame_height": size}
    look |= {"x_range": (x - half, x + half), "y_range": (y - half, y + half), "tools": "box_zoom,pan,reset,save"}
    fig: Any = figure(name=name, **look)
    dress(fig, *labels).sizing_mode = "fixed"
    if window is not None:
        fig.xaxis.ticker.desired_num_ticks = fig.yaxis.ticker.desired_num_ticks = 3
    angle = np.linspace(0, 2 * np.pi, 3601)
    fig.patch(np.cos(angle), np.sin(angle), fill_color="#f1f5f9", line_color="#94a3b8", line_width=1.4)
    n, k = model.form.n, model.form.inputs
    draws = model.samples[:CLOUD]
    if "sampled" in model.method:
        _cloud(fig, [np.append(1.0, row[:n]) for row in draws], PALETTE["predicted"], reach)
    for i in range(k):
        if "sampled" in model.zeros_method(i):
            rows = [model.form.polynomials(row)[1][i] for row in draws]
            _cloud(fig, [row if model.form.direct else row[1:] for row in rows], PALETTE["good"], reach)

    marks = [_marks(fig, model.poles, model.poles_covariance, model.method, "pole", "x", PALETTE["predicted"], reach)]
    for i in range(k):
        name = "zero" if k == 1 else f"zero from u{i + 1}"
        found = model.zeros(i), model.zeros_covariance(i), model.zeros_method(i)
        marker = MARKERS[i % len(MARKERS)]
        own = [j for j, (z, std) in enumerate(zip(found[0], model.zeros_std(i))) if z != 0 or std > 0]
        found = found[0][own], found[1][own], [found[2][j] for j in own]
        marks.append(_marks(fig, *found, name, marker, PALETTE["good"], reach))
    marks = [mark for mark in marks if mark is not None]
    tips = [("", "@what"), ("size", "@size"), ("real", "@x{0.0000}"), ("imaginary", "@y{0.0000}")]
    fig.add_tools(HoverTool(renderers=marks, tooltips=tips))
    if fig.legend:
        fig.legend[0].visible = False
        if window is None:
            legend(fig, [(item.label.value, item.renderers) for item in fig.legend[0].items])
    return fig


def _reach(model) -> float:
    """Return how far the axes go: around the circle, every pole, and the zeros that are near."""
    import numpy as np

    sizes = [abs(p) for p in model.poles if np.isfinite(p)]
    for i in range(model.form.inputs):
        sizes += [abs(z) for z in model.zeros(i) if np.isfinite(z) and abs(z) <= FAR]
    return 1.12 * float(max([1.0, *sizes]))


def _marks(fig, roots, covariances, methods, what, marker, color, reach):
    """Draw the ellipses and the marks of some roots; return the marks."""
    import numpy as np
    from bokeh.models import ColumnDataSource

    from driftwise.models.ellipse import confidence_ellipse

    shown = []
    for root, covariance, how in zip(roots, covariances, methods):
        if not np.isfinite(root) or abs(root) > 1.2 * reach:
            continue
        ink = PALETTE["alert"] if what == "pole" and abs(root) >= 1 else color
        std = float(np.sqrt(np.trace(covariance)))
        size = f"{abs(root):.4f} \u00b1 {std:.2g}" if np.isfinite(std) else f"{abs(root):.4f}, no bound"
        shown.append((root.real, root.imag, what, size, ink))
        found = confidence_ellipse(covariance, centre=complex(root))
        if how == "first order" and found.semi_axes[0] < 2 * reach:
            fig.patch(*found.points().T, fill_color=ink, fill_alpha=0.14, line_color=ink, line_alpha=0.6)
    if not shown:
        return None
    source = ColumnDataSource(dict(zip(("x", "y", "what", "size", "color"), map(list, zip(*shown)))))
    looks = {"fill_color": None, "line_color": "color", "line_width": 1.8, "legend_label": what}
    return fig.scatter("x", "y", source=source, marker=marker, size=11, **looks)


def _cloud(fig, polynomials, color, reach):
    """Scatter the roots of drawn polynomials."""
    import numpy as np

    roots = np.concatenate([np.roots(c) for c in polynomials])
    roots = roots[abs(roots) < 1.5 * reach]
    fig.scatter(roots.real, roots.imag, marker="circle", size=2.5, color=color, alpha=0.35, legend_label="draws")
