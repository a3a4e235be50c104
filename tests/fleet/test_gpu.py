"""A fleet on a real GPU gives the numbers of the processor, every bit of them."""

import numpy as np
import pytest
from test_laws import ESTIMATORS

import driftwise as dw
from driftwise.engine import device
from driftwise.engine.errors import InputError
from driftwise.fleet.cuda import require_device

CASES = {**ESTIMATORS, "two outputs": dw.JointMIMO([1, 1])}


def has_gpu() -> bool:
    try:
        require_device()
    except InputError:
        return False
    return not device.is_simulated()


pytestmark = [
    pytest.mark.slow,  # half a minute is compiled for each
    pytest.mark.skipif("not has_gpu()", reason="no NVIDIA GPU that driftwise[cuda] can use"),
]


def story(estimator, where):
    """Take samples of any keys, some missing, in stretches; series come and go; return what came out."""
    rng, series, samples = np.random.default_rng(1), 70, 30  # more than a block of threads
    n, p, k = series * samples, getattr(estimator.model, "outputs", None), estimator.model.inputs
    y, u = rng.standard_normal((n, p) if p else n), rng.standard_normal((n, k))
    y[rng.random(y.shape) < 0.1], u[rng.random(u.shape) < 0.05] = np.nan, np.nan
    keys, fleet, shown = rng.permutation(np.arange(n) % series), dw.Fleet(estimator, range(series), device=where), []
    for part in np.split(np.arange(n), [1, 40, 1000]):
        shown += fleet.scan(keys[part], y[part], u[part] if k else None)
        fleet.drop([3])
        fleet.add([3])
    shown += fleet.update_batch(None, y[:series], u[:series] if k else None)
    return [*shown, fleet.states.view(float)]


@pytest.mark.parametrize("name", CASES)
def test_every_bit_is_the_processors(name):
    for found, expected in zip(story(CASES[name], "cuda"), story(CASES[name], "cpu")):
        np.testing.assert_array_equal(found, expected)


def test_what_was_compiled_is_kept_and_what_is_damaged_is_not_believed(monkeypatch, tmp_path):
    monkeypatch.setenv("DRIFTWISE_CACHE", str(tmp_path))
    estimator, made = dw.ARX(1, 1), []
    monkeypatch.setattr(device, "bind", lambda real=device.bind: made.append(real()))

    def again():
        device.grid.cache_clear()
        return story(estimator, "cuda")

    expected = again()
    (path,) = tmp_path.glob("*.cuda")
    for deed, compiled in ((lambda data: data, 1), (lambda data: data[:-1] + bytes([data[-1] ^ 1]), 2)):
        path.write_bytes(deed(path.read_bytes()))
        for one, other in zip(again(), expected):
            np.testing.assert_array_equal(one, other)
        assert len(made) == compiled
