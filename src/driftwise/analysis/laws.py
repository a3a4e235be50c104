"""The laws every estimator obeys, as checks anyone can run on theirs (and on their own policies inside it)."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from ..detect.gain import GainProbes, PullTest
from ..detect.gate import InnovationGate, admit
from ..detect.probes import ProbeBank
from ..detect.score import ScoreCUSUM
from ..detect.watch import watch
from ..engine import compile
from ..engine.errors import InputError, refuse_class
from ..estimators.adaptive_gain.estimator import AdaptiveGain
from ..estimators.arx.estimator import ARX
from ..estimators.joint.estimator import Joint
from ..fleet.fleet import Fleet
from ..memory.exponential_forgetting import ExponentialForgetting
from ..memory.questions import MEMORIES
from ..memory.restart_on_change import CovarianceInflation, GainReset, RestartOnChange
from ..models.noise import EquationError
from ..models.simulation import simulate_mimo
from ..results.snapshot import is_described, load_state, save_state


def same(a, b) -> bool:
    """Say whether two arrays or states are equal bit for bit (NaN equals NaN)."""
    a, b = np.atleast_1d(a), np.atleast_1d(b)
    if a.dtype.names:
        a, b = a.view(np.float64), b.view(np.float64)
    return a.shape == b.shape and np.array_equal(a, b, equal_nan=True)


def example(estimator, samples: int = 120, seed: int = 0, missing: float = 0.1):
    """Return a record (y, u) that fits the estimator: a stable plant, random inputs, gaps in both."""
    rng = np.random.default_rng(seed)
    n, k = max(estimator.order, 1), estimator.model.inputs
    if _is_observer(estimator):
        return _example_of_a_plant(estimator, rng, samples, missing)
    if _outputs(estimator) is not None:
        return _example_of_several(estimator.model, rng, samples, missing)
    a = np.poly(rng.uniform(-0.8, 0.8, n))[1:]
    b = rng.standard_normal((k, n))
    u = rng.standard_normal((samples, k))
    x, y = np.zeros(n), np.empty(samples)
    for t in range(samples):
        y[t] = x[0] + 0.1 * rng.standard_normal()
        x = np.append(x[1:], 0.0) - a * y[t] + u[t] @ b
    y[rng.random(samples) < missing] = np.nan
    u[rng.random((samples, k)) < missing / 4] = np.nan
    return y, u if k else None


def _is_observer(est):
    """Say whether the estimator observes a known plant: no parameters, estimates that may not be ready."""
    return est.is_observer


def _example_of_a_plant(est, rng, samples, missing):
    """The same from the plant itself, its disturbances, and noise as stated."""
    if est.simulates:
        return _example_of_formulas(est, rng, samples, missing)
    system = est.plant
    Phi, G0, G1 = system.discretise(est.dt, est.hold)
    std = np.ones(system.outputs) if est.noise_std is None else est.noise_std
    z, u = rng.standard_normal(system.m), rng.standard_normal((samples, system.inputs))
    y = np.empty((samples, system.outputs))
    for t in range(samples):
        z = Phi @ z + G0 @ u[t - 1] + G1 @ u[t] if t else z
        y[t] = system.H @ z + system.D @ u[t] + std * rng.standard_normal(system.outputs)
    y[rng.random(y.shape) < missing] = np.nan
    u[rng.random(u.shape) < missing / 4] = np.nan
    return y if system.outputs > 1 else y[:, 0], u if system.inputs else None


def _example_of_formulas(est, rng, samples, missing):
    """The same from formulas, at parameters that are likely beforehand."""
    k, theta = est.model.inputs, est.likely(rng)
    u = np.repeat(rng.standard_normal((samples // 4 + 1, k)), 4, axis=0)[:samples]
    y = est.simulate(u, theta, samples=samples, seed=int(rng.integers(2**31)))
    y[rng.random(y.shape) < missing] = np.nan
    u[rng.random((samples, k)) < missing / 4] = np.nan
    return y, u if k else None


def _outputs(est):
    """Return the number of outputs where y has an axis for them, None where it has none."""
    return est.outputs


def _example_of_several(form, rng, samples, missing):
    """The same with several outputs: each with poles of its own, coupled weakly."""
    if hasattr(form, "canonical"):
        form, _ = form.canonical()
    theta = np.where(form.sources < form.outputs, 0.1, 1.0) * rng.standard_normal(form.N - form.n)
    for i in range(form.outputs):
        own = (form.targets == i) & (form.sources == i)
        theta[own] = np.poly(rng.uniform(-0.8, 0.8, own.sum()))[1:]
    k = form.inputs
    u = rng.standard_normal((samples, k))
    options = dict(u=u, missing=missing, noise_std=0.1)
    y, _ = simulate_mimo(form, theta, samples=samples, seed=int(rng.integers(2**31)), **options)
    u = u.copy()
    u[rng.random((samples, k)) < missing / 4] = np.nan
    return y, u if k else None


def _part(u, where):
    return None if u is None else u[where]


def law_stream_record_halves_fleet(est, y, u):
    """The same samples give the same numbers, bit for bit, whichever way they are fed."""
    whole = est.scan(y, u)
    state, seen = est.start(), []
    for t in range(len(y)):
        state, step = est.update(state, y[t], _part(u, t))
        seen.append(step)
    assert same(state, whole.state), "one by one differs from the record"
    steps = np.array([s[:3] for s in seen]).reshape(len(y), -1)
    assert same(steps, whole.table[:, : steps.shape[1]]), "the steps differ from the trace"
    half = len(y) // 2
    first = est.scan(y[:half], _part(u, slice(half)))
    second = est.scan(y[half:], _part(u, slice(half, None)), state=first.state)
    assert same(np.concatenate([first.table, second.table]), whole.table), "two halves differ from the whole"
    assert same(first.dof, whole.dof[:half]), "the degrees of freedom of the first half differ"
    assert same(second.dof, whole.dof[half:]), "the degrees of freedom of the second half differ"
    states, _ = est.update_batch(
        est.start(3), np.stack([y, y[::-1], y]), None if u is None else np.stack([u, u[::-1], u])
    )
    assert same(states[0], whole.state) and same(states[2], whole.state), (
        "a series in a fleet differs from itself alone"
    )


def law_state_is_plain_numbers(est, y, u):
    """A state can be copied, written down and read back; nothing changes."""
    half = len(y) // 2
    state = est.scan(y[:half], _part(u, slice(half))).state
    before = state.copy()
    est.update(state, y[half], _part(u, half))
    assert same(state, before), "update changed the state it was given"
    other, back = est, state.copy()
    if is_described(est):
        with tempfile.TemporaryDirectory() as folder:
            save_state(est, state, Path(folder) / "state.json")
            other, back = load_state(Path(folder) / "state.json")
    assert same(state, back), "reading back changed the state"
    rest = y[half:], _part(u, slice(half, None))
    assert same(est.scan(*rest, state=state).table, other.scan(*rest, state=back).table), "the resumed run differs"


def law_nan_is_missing(est, y, u):
    """NaN means missing, in outputs and inputs; time moves, estimates stay finite, theta waits (or relaxes)."""
    state = est.scan(y, u).state
    nothing = None if u is None else np.full(est.model.inputs, np.nan)
    phi = np.asarray(1.0 if est.relaxation is None else est.relaxation)  # what the parameters relax by
    disturbance = est.options.get("disturbance")
    if disturbance is not None:  # the last parameter, which fades by its pole
        phi = np.append(np.broadcast_to(phi, len(est.names) - 1), disturbance.pole)
    for _ in range(20):
        after, step = est.update(state, np.full(np.shape(y)[1:], np.nan), nothing)
        assert np.all(np.isnan(step.innovation) & (np.asarray(step.status) & 1 == 1)), (
            "a missing output is not reported"
        )
        if not _is_observer(est):
            expected = phi @ state["theta"] if np.ndim(phi) == 2 else phi * state["theta"]
            off = abs(after["theta"] - expected).max(initial=0.0)  # a mixture's mean is added up anew
            assert off <= 1e-14 * abs(expected).max(initial=0.0), "a missing output moved the parameters"
        assert after["samples"] == state["samples"] + 1, "time stood still"
        state = after
    assert np.isfinite(np.atleast_1d(state).view(float)).all(), "a gap left something that is not finite"
    try:
        est.update(state, np.full(np.shape(y)[1:], np.inf), _part(u, 0))
    except InputError:
        return
    raise AssertionError("infinity passed the door")


def law_covariance_stays_a_covariance(est, y, u):
    """P is symmetric and non-negative; an estimate that is ready has a finite deviation, any other has none."""
    if _is_observer(est):
        trace = est.scan(y, u)
        is_bar = np.isfinite(trace.std) & (trace.std >= 0)
        assert same(is_bar.all(1), trace.ready) and same(np.isfinite(trace.estimates).all(1), trace.ready)
        return
    trace = est.scan(y, u, keep="covariance")
    assert np.all(trace.state["D"] >= 0), "a factor went negative"
    P = est.covariance(trace.state)
    if np.all(np.isinf(np.diag(P))):
        return  # an estimator that claims nothing
    assert np.linalg.eigvalsh(P).min() >= -1e-12 * np.trace(P), "P lost positivity"
    assert np.all(trace.x_std >= 0) and np.all(trace.parameters_std >= 0)


def law_scaling(est, y, u):
    """Scaling the data scales the answer, exactly for powers of two (default prior, noise learnt or absent)."""
    if est.simulates:
        return  # its units are those of physics
    if _is_observer(est):
        return _law_scaling_of_an_observer(est, y, u)
    options = {"noise": EquationError(), **est.options}
    stated = [options.get(name) for name in ("P0", "s0", "theta0", "variance", "K0", "x0", "B")]
    if any(value is not None for value in stated) or getattr(options["noise"], "variance", 0) is not None:
        return
    c, g = 2.0**20, 2.0**-13
    plain, scaled = est.scaled_to(y, u), est.scaled_to(c * y, _times(u, g))
    one, two = plain.scan(y, u), scaled.scan(c * y, _times(u, g))
    assert same(c * one.prediction, two.prediction), "predictions do not scale"
    units = np.sqrt(scaled._theta_units() / plain._theta_units())
    assert same(one.parameters * units, two.parameters), "parameters do not scale by their units"


def _law_scaling_of_an_observer(est, y, u):
    """The same where all deviations are stated: they scale, too."""
    c, options = 2.0**20, dict(est.options)
    if "disturbances" in options:
        options["disturbances"] = [
            q._replace(prior_std=c * np.asarray(q.prior_std), walk=c * q.walk) for q in est.plant.disturbances
        ]
    for name in ("noise_std", "tolerance", "x0", "x_std"):
        if options.get(name) is not None:
            options[name] = c * np.asarray(options[name], float)
    for name in ("Q", "R", "P0"):
        if options.get(name) is not None:
            options[name] = c * c * np.asarray(options[name], float)
    if "y_scale" in options:
        options["y_scale"] = c * np.asarray(options["y_scale"], float)
    one, two = est.scan(y, u), type(est)(**options).scan(c * y, _times(u, c))
    assert same(c * one.prediction, two.prediction), "predictions do not scale"
    assert same(c * one.estimates, two.estimates) and same(c * one.std, two.std), "estimates do not scale"


def _times(u, g):
    return None if u is None else g * u


def law_compiled_equals_plain(est, y, u):
    """Compiled code and the same Python run line by line agree to 1e-12 (relative, prior-dominated start aside)."""
    y, u = y[:60], _part(u, slice(60))
    fast = est.scan(y, u)
    rows, outs = est._rows(est.start()), np.empty_like(fast.table[None])
    us = np.zeros((1, len(y), 0)) if u is None else np.ascontiguousarray(u, float).reshape(1, len(y), -1)
    with np.errstate(all="ignore"):
        est._started(compile.plain_driver(*map(type, est.policies)))(
            rows, y.reshape(1, len(y), -1), us, outs, est.spec, est.scratch()
        )
    assert np.allclose(fast.table, outs[0], rtol=1e-9, atol=1e-12, equal_nan=True), (
        "compiled and uncompiled traces differ"
    )
    a, b = np.atleast_1d(fast.state).view(float), rows[0]
    assert np.allclose(a, b, rtol=1e-9, atol=1e-12), "compiled and uncompiled states differ"


def law_fleet_of_known_sizes(est, y, u):
    """Mixed with others in a fleet, whose loop has its sizes compiled in, a series takes the same steps."""
    if est.starting is not None or est.pauses:
        return  # no fleet takes them, or one by one
    y, u = y[:12], _part(u, slice(12))
    fleet = Fleet(est, ["own", "other"], threads=1, lanes=False)
    crew, rows, outs = fleet.crew, est._rows(est.start()), np.empty((1, len(y), est.step_columns))

    def plain(columns):
        return compile.plain_crew(crew.kinds, crew.sizes, crew.shapes(columns))

    crew.loop = plain  # type: ignore[method-assign]  # in place of the compiled one
    us = np.zeros((1, len(y), 0)) if u is None else np.ascontiguousarray(u, float).reshape(1, len(y), -1)
    both = np.stack([y, y[::-1]], axis=1).reshape(2 * len(y), *y.shape[1:])
    with np.errstate(all="ignore"):
        fleet.scan(["own", "other"] * len(y), both, None if u is None else np.repeat(us[0], 2, axis=0))
        compile.plain_driver(*map(type, est.policies))(
            rows, y.reshape(1, len(y), -1), us, outs, est.spec, est.scratch()
        )
    assert same(np.atleast_1d(fleet.state("own")).view(float), rows[0]), "its state differs from itself alone"


def law_no_wind_up(est, y, u):
    """Without excitation the parameters' covariance stays within the prior (twice that, where they drift)."""
    if _is_observer(est):
        return  # it has no parameters to forget
    rest = np.zeros((2000, *y.shape[1:]))
    state = est.scan(y, u).state
    state = est.scan(rest, None if u is None else np.zeros((2000, est.model.inputs)), state=state).state
    P, P0 = est.covariance(state), est.prior_covariance[np.ix_(est.model.salut, est.model.salut)]
    n, room = est.model.n, 1.0 if est.relaxation is None else 2.0
    assert np.all(np.diag(P)[n:] <= room * np.diag(P0)[n:] * (1 + 1e-9)), (
        "a parameter is less certain than before the first sample"
    )


LAWS = [law for name, law in sorted(globals().items()) if name.startswith("law_")]


def check_estimator(estimator, y=None, u=None) -> None:
    """Raise AssertionError, naming the law, if an estimator breaks one.

    Parameters
    ----------
    estimator : an estimator, with any policies
    y, u : (T,) and (T, k), a record to check it on; a simulated one with gaps if omitted

    Examples
    --------
    >>> import driftwise as dw
    >>> dw.check_estimator(dw.Joint(1, inputs=1))
    """
    if y is None:
        y, u = example(estimator)
    for law in LAWS:
        try:
            law(estimator, y, u)
        except AssertionError as broken:
            raise AssertionError(f"{estimator!r} breaks a law: {law.__doc__} {broken}") from None


def check_policy(policy) -> None:
    """Raise AssertionError, naming the law, if an estimator with this memory, gate, detector or restart breaks one.

    Parameters
    ----------
    policy : driftwise's or your own; each works in the estimator it is for (`Joint`, `ARX`, `AdaptiveGain`)

    Examples
    --------
    >>> import driftwise as dw
    >>> dw.check_policy(dw.RandomWalk(1e-4))
    """
    for estimator in _homes(policy):
        check_estimator(estimator)


def _homes(policy) -> list:
    """Return the estimators in which a policy is checked."""
    refuse_class("policy", policy)
    kind, joint = type(policy), dict[str, Any](noise=EquationError(0.01), P0=10.0)
    if isinstance(policy, ProbeBank):
        raise InputError("a ProbeBank alone compares probes of your own: check GainProbes(gains) instead")
    if isinstance(policy, GainProbes | PullTest):
        plr: dict[str, Any] = (
            {"method": "plr", "memory": ExponentialForgetting(0.98), "gate": InnovationGate()}
            if isinstance(policy, PullTest)
            else {}
        )
        return [AdaptiveGain(0.9, detector=policy, **plr)]
    if isinstance(policy, CovarianceInflation | GainReset):
        return [ARX(2, 2, memory=RestartOnChange(ScoreCUSUM(threshold=1.0), policy, settle=10))]
    if kind in admit.table:
        return [Joint(2, inputs=1, gate=policy, **joint), ARX(2, 2, gate=policy)]
    if isinstance(policy, ScoreCUSUM):
        policy = RestartOnChange(policy, settle=10)
    if isinstance(policy, RestartOnChange) or kind in MEMORIES:
        return [Joint(2, inputs=1, memory=policy, **joint), ARX(2, 2, memory=policy)]
    if kind in watch.table or hasattr(policy, "resolve"):
        return [Joint(2, inputs=1, memory=RestartOnChange(policy, settle=10), **joint)]
    raise InputError(
        "a policy is a memory, a gate or a detector with its rule (time_update.on, adapt.on, admit.on, watch.on), or a "
        f"restart, got {policy!r}"
    )
