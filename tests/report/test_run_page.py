"""The report opens without a network and says what it should; figures keep what matters."""

import re
from html.parser import HTMLParser

import numpy as np
import pytest
from draws import slow

import driftwise as dw
from driftwise.engine.errors import InputError
from driftwise.models.canonical import Canonical
from driftwise.models.convert import Model
from driftwise.report.panels import roots_panel
from driftwise.report.roots import plane
from driftwise.report.run_page import write
from driftwise.report.thin import envelope, together
from driftwise.results.numbers import fixed, interval, number, plus_minus, probable


@pytest.fixture(scope="module")
def trace():
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=1200, noise_std=0.1, missing=0.03, seed=4)
    y[600] += 50
    est = dw.Joint(2, inputs=1, gate=dw.InnovationGate(6, settle=40), dt=0.1).scaled_to(y, u)
    return est.scan(y, u)


class Page(HTMLParser):
    """Collects ids, text, and whatever a page would fetch."""

    def __init__(self, text):
        super().__init__()
        self.ids, self.fetched, self.text, self.open = [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.open.append(tag)
        if "id" in attrs:
            self.ids.append(attrs["id"])
        for name in ("src", "href", "srcset", "data", "action"):
            if attrs.get(name):
                self.fetched.append((tag, attrs[name]))

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("script", "style"):
            self.text.append(data)


def test_report_is_self_contained_and_complete(trace, tmp_path):
    path = write(trace, tmp_path / "r.html", title="A <plant> & its page", labels={"output": "level (m)"})
    text = path.read_text(encoding="utf-8")
    page = Page(text)
    assert [f for f in page.fetched if f != ("link", "data:,")] == []
    assert not re.search(r"@import|url\(\s*['\"]?http", text)
    for section in ("prediction", "parameters", "poles", "excitation", "innovations", "whiteness", "events"):
        assert section in page.ids
    words = " ".join(" ".join(page.text).split())
    assert trace.summary().words in words
    assert "A <plant> & its page" in words, "the title is escaped"
    for word in (
        "One-step fit",
        "NIS",
        "95 % bands hold",
        "Ljung-Box",
        "outlier",
        "a1",
        "b2",
        "standard error",
    ):
        assert word in words
    assert "level (m)" in text
    assert len(text) < 4e6


def test_report_of_a_long_trace_is_not_longer(tmp_path):
    y, u = dw.simulate([-0.9], [1.0], samples=60_000, noise_std=0.5, seed=1)
    est = dw.Joint(1, inputs=1).scaled_to(y, u)
    small = write(est.scan(y[:30_000], u[:30_000]), tmp_path / "a.html").stat().st_size
    large = write(est.scan(y, u), tmp_path / "b.html").stat().st_size
    assert large < small + 100_000


@pytest.mark.parametrize("keep", ["innovations", slow("means"), slow("std"), "covariance"])
def test_report_and_plot_of_every_kind_of_trace(tmp_path, keep):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    y, u = dw.simulate([-0.9], [1.0], samples=300, noise_std=0.5, seed=1)
    trace = dw.Joint(1, inputs=1).scan(y, u, keep=keep)
    assert trace.report(tmp_path / "r.html").exists()
    axes = trace.plot()
    assert len(axes) == (2 if keep == "innovations" else 4)
    plt.close("all")


def test_report_without_input_and_of_a_short_record(tmp_path):
    y, _ = dw.simulate([-0.9], samples=12, noise_std=0.5, seed=1)
    text = dw.Joint(1).scan(y).report(tmp_path / "r.html").read_text(encoding="utf-8")
    assert "no input" in text
    assert "too short to tell" in text


def test_report_draws_smoothed_orders_and_zeros(tmp_path):
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=600, noise_std=0.5, seed=4)
    est = dw.Joint(2, inputs=1, memory=dw.RandomWalk(1e-6)).scaled_to(y, u)
    trace, smoothed = est.scan(y, u), est.smooth(y, u, lag=50)
    path = trace.report(tmp_path / "r.html", smoothed=smoothed, orders=dw.analysis.choose_order(y, u, [1, 2]))
    page = Page(path.read_text(encoding="utf-8"))
    for section in ("states", "orders", "poles"):
        assert section in page.ids
    words = " ".join(" ".join(page.text).split())
    assert "Dashed between dotted lines: smoothed, given 50 later samples." in words
    assert "Poles and zeros" in words
    assert "Every combination of the parameters shows in the record." in words
    assert "in 95 of 100 records" in words
    with pytest.raises(InputError, match="smooth the same record"):
        trace.report(tmp_path / "r.html", smoothed=est.smooth(y[:50], u[:50]))


def figure_of(model):
    """Return the z-plane as (ellipse centres, numbers of marks by name)."""
    fig = plane(model)
    patches = [r for r in fig.renderers if r.glyph.__class__.__name__ == "Patch"][1:]
    marks = {}
    for item in fig.legend[0].items:
        for r in item.renderers:
            marks[item.label.value] = marks.get(item.label.value, 0) + len(r.data_source.data["x"])
    return patches, marks


def test_plane_draws_the_95_percent_ellipse():
    y, u = dw.simulate([-1.5, 0.7], [1.0, 0.5], samples=800, noise_std=0.3, seed=1)
    model = dw.Joint(2, inputs=1).scan(y, u).model()
    patches, marks = figure_of(model)
    assert marks == {"pole": 2, "zero": 1}
    assert len(patches) == 3
    for patch, pole, covariance in zip(patches, model.poles, model.poles_covariance):
        x, y = (np.asarray(patch.data_source.data[c]) for c in "xy")
        e = np.stack([x - pole.real, y - pole.imag])
        radius = np.einsum("it,ij,jt->t", e, np.linalg.inv(covariance), e)
        np.testing.assert_allclose(radius, 5.991464547, rtol=1e-9)  # chi-square with 2 degrees at 95 %


def test_plane_draws_a_cloud_where_poles_nearly_coincide_and_leaves_out_what_is_far():
    form = Canonical(2, inputs=1)
    model = Model(form, np.array([-1.5, 0.5625, 1e-4, 1.0]), 1e-6 * np.eye(4))
    assert model.method == ["sampled", "sampled"]
    patches, marks = figure_of(model)
    assert patches == []
    assert marks["draws"] > 100
    assert marks["pole"] == 2
    assert "zero" not in marks
    text = roots_panel(_Summary(model), 1.0).html({"poles": "", "closeup": ""})
    assert "1 zero lies outside the figure." in text
    assert "nearly coincide" in text


class _Summary:
    """What the section about roots reads of a summary."""

    def __init__(self, model):
        self.model, self.notes, self.moduli = model, model.notes, list(zip(model.poles, model.poles_std))
        self.unit, self.is_static, self.is_enough = "s", False, True


def test_plot_keeps_spikes_and_labels(trace):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure = plt.figure()
    axes = trace.plot(labels={"output": "level (m)", "time": "hours"}, figure=figure)
    assert axes[0].get_ylabel() == "level (m)"
    assert axes[-1].get_xlabel() == "hours"
    assert axes[0].figure is figure
    measured = next(line for line in axes[0].lines if line.get_label() == "measured")
    assert np.nanmax(measured.get_ydata()) == np.nanmax(trace.y)
    plt.close(figure)


def test_envelope_keeps_extremes_ends_and_holes():
    rng = np.random.default_rng(0)
    y = rng.standard_normal(100_003)
    y[77_777], y[4], y[50_000:51_000] = 40, -30, np.nan
    kept = envelope(y, 1000)
    assert len(kept) <= 1000
    assert {0, 4, 77_777, 100_002} <= set(kept)
    assert np.isnan(y[kept]).any()
    assert (np.diff(kept) > 0).all()
    assert len(together(1000, y, y**2)) <= 1000
    np.testing.assert_array_equal(envelope(y[:50], 1000), np.arange(50))
    assert len(envelope(np.full(5000, np.nan), 100)) <= 100


def test_wording():
    assert plus_minus(-1.694538, 0.02041) == "−1.695 ± 0.020"
    assert plus_minus(12345.678, 210.0) == "12346 ± 210"
    assert plus_minus(1.0, float("nan")).startswith("1 ±")
    assert plus_minus(3.2e-12, 1.5e-13) == "3.20e-12 ± 1.5e-13"
    assert plus_minus(1.7602e-8, 2.5e-8) == "1.8e-08 ± 2.5e-08"
    assert interval(1.0, 0.1) == "0.80 … 1.20"
    assert number(-0.25) == "−0.25"
    assert fixed(99.54321, 1) == "99.5"
    assert [fixed(x, 1) for x in (-2.5e17, 3.1e6, 26_843.7)] == ["far below 0", "> 1 million", "26800"]
    assert plus_minus(-0.0, 14.0) == "0 ± 14"
    assert number(-0.0) == "0"
    assert fixed(float("nan"), 2) == "–"
    assert [probable(p) for p in (1.0, 0.1234, 2e-10, 1e-40)] == ["1.000", "0.123", "2e-10", "0"]


def test_report_says_what_asks_for_attention(tmp_path):
    rng = np.random.default_rng(0)
    y, u = dw.simulate([-0.9], [1.0], samples=300, noise_std=0.5, seed=1)
    sound = " ".join(Page(dw.Joint(1, inputs=1).scan(y, u).report(tmp_path / "a.html").read_text("utf-8")).text)
    assert "Nothing asks for attention." in sound
    y[150:] += 5 * rng.standard_normal(150)
    page = Page(dw.Joint(1, inputs=1).scan(y, u).report(tmp_path / "b.html").read_text("utf-8"))
    assert "verdicts" in page.ids and "ask for attention" in " ".join(page.text)
