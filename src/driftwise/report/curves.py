"""Figures of a validation: correlations by lag, step response, Bode and Nyquist, each with its band."""

from __future__ import annotations

from typing import Any

from driftwise.report.axes import across, shade, zoomable
from driftwise.report.axes import dress as dressed
from driftwise.report.figure import PALETTE
from driftwise.results.numbers import SECONDS


def _figure(name: str, height: int, x: str, y: str, **more) -> Any:
    fig: Any = zoomable(height=height, name=name, **more)
    return dressed(fig, x, y)


def correlated(name: str, found, title: str):
    """Correlations at lags with the limit that chance gives the largest of them."""
    import numpy as np

    values, lags, limit = found.correlations, found.lags, found.limit / np.sqrt(max(found.samples, 1))
    reach = max(1.15 * float(np.abs(values).max(initial=0.0)), 1.8 * limit)
    ranges = {"y_range": (-reach, reach), "x_range": (lags[0] - 0.8, lags[-1] + 0.8)}
    fig = _figure(name, 210, "lag (samples)", title, **ranges)
    shade(fig, -limit, limit)
    across(fig, 0)
    for beyond, color in ((False, PALETTE["predicted"]), (True, PALETTE["alert"])):
        some = (np.abs(values) > limit) == beyond
        fig.vbar(lags[some], top=values[some], width=0.55, color=color)
    return fig


def banded(fig, curve) -> None:
    """Draw a curve within its band."""
    import numpy as np

    x, low, high = curve.x, np.nan_to_num(curve.low), np.nan_to_num(curve.high)
    fig.varea(x, low, high, color=PALETTE["predicted"], alpha=0.22)
    fig.line(x, curve.value, color=PALETTE["predicted"], width=1.9)


def step(name: str, curve, unit: str = SECONDS):
    """A step response."""
    import numpy as np

    seen = curve.value[np.isfinite(curve.value)]
    low, high = min(float(seen.min(initial=0.0)), 0.0), max(float(seen.max(initial=0.0)), 0.0)
    room = (high - low) or 1.0
    low = max(min(float(np.nanmin(curve.low)), low), low - 2 * room) - 0.1 * room
    high = min(max(float(np.nanmax(curve.high)), high), high + 2 * room) + 0.1 * room
    fig = _figure(name, 240, f"time ({unit})", "output after a step of 1", y_range=(low, high))
    across(fig, 0)
    banded(fig, curve)
    return fig


def bode(name: str, found, label: str) -> list:
    """Gain and phase over frequency."""
    import numpy as np

    g = found.gain.value[found.gain.value > 0]
    low, high = (float(g.min()), float(g.max())) if len(g) else (0.1, 1.0)
    ranges: dict[str, Any] = {
        "x_axis_type": "log",
        "y_axis_type": "log",
        "y_range": (max(low, 1e-4 * high) / 2, 2 * high),
    }
    gain = _figure(f"{name}gain", 230, label, "gain", **ranges)
    banded(gain, found.gain._replace(low=np.maximum(found.gain.low, 1e-12)))
    middle = found.phase.value
    phase = _figure(
        f"{name}phase", 230, label, "phase (degrees)", x_axis_type="log", x_range=gain.x_range,
        y_range=(float(middle.min()) - 45, float(middle.max()) + 45),
    )  # fmt: skip
    banded(phase, found.phase)
    return [gain, phase]


def nyquist(name: str, found):
    """The frequency response in the complex plane, with 95 % ellipses at some frequencies."""
    import numpy as np

    from driftwise.models.ellipse import confidence_ellipse

    G = found.response
    reach = 1.15 * float(max(np.abs(G.real).max(), np.abs(G.imag).max(), 1e-12))
    fig = _figure(name, 340, "real part", "imaginary part", width=380, x_range=(-reach, reach), y_range=(-reach, reach))
    fig.sizing_mode = "fixed"
    across(fig, 0)
    across(fig, 0, dimension="height")
    for k in range(0, len(G), 8):
        if np.isfinite(found.covariance[k]).all():
            ellipse = confidence_ellipse(found.covariance[k], centre=complex(G[k]))
            if ellipse.semi_axes[0] < 0.5 * reach:
                fig.patch(*ellipse.points().T, fill_color=PALETTE["predicted"], fill_alpha=0.14, line_color=None)
    fig.line(G.real, G.imag, color=PALETTE["predicted"], width=1.9)
    fig.scatter([-1.0], [0.0], marker="x", size=9, color=PALETTE["quiet"])
    return fig
