"""Nothing is forgotten until a detector alarms; then everything is known less, or some parameters are."""

from typing import Any, NamedTuple

from ..detect.variance import VarianceCUSUM
from ..engine import validation
from ..engine.dispatch import PerParameter, kernel
from ..engine.elementary import exp, log
from ..engine.errors import InputError, refuse_class
from ..engine.status import JUMP
from .gauss_markov import widen_within
from .questions import on_alarm, resolve
from .registry import register
from .settings import jump_size, more_than_one
from .wind_up import hold_within


@register()
class CovarianceInflation(NamedTuple):
    """After an alarm each parameter gains variance ``step`` squared, at most up to its prior.

    ``step`` is the size of jump to expect, one number or one per parameter, in the units of `y_scale` and `u_scale`.
    ``only_named``: where the detector names the parameter that jumped, only that one is freed.
    Bad at: jumps much larger than the step.

    Examples
    --------
    >>> import driftwise as dw
    >>> b = [[1.0]] * 400 + [[2.0]] * 200  # b1 jumps
    >>> y, u = dw.simulate([-0.8], b, samples=600, noise_std=0.1, seed=1)
    >>> trace = dw.ARX(1, 1, memory=dw.RestartOnChange(response=dw.memory.CovarianceInflation(1.0))).scan(y, u)
    >>> trace.parameters[-1].round(1).tolist(), trace.parameters_std[-1].round(2).tolist()
    ([-0.8, 2.0], [0.0, 0.01])
    """

    step: Any = 1.0
    only_named: bool = False


def _read(words):
    steps = words.each()
    if not all(step > 0 for step in words.numbers()):
        raise InputError(
            f"--memory {words.kind}:STEP is the size of jump to expect, a positive number, got {words.rest!r}."
        )
    return RestartOnChange(response=CovarianceInflation(steps))


QUICK = {"detector": VarianceCUSUM(threshold=1.0), "settle": 10}  # one that does alarm in a short record


@register(
    "restart", "restart:STEP", about="constant until they jump; size to expect, 1 if omitted", read=_read, **QUICK
)
class RestartOnChange(NamedTuple):
    """Nothing is forgotten until the parameters jump; then they are freed as ``response`` says.

    ``response`` is `CovarianceInflation` (the default: each parameter gains variance 1 in the units of `y_scale` and
    `u_scale`) or, for recursive estimators, `GainReset`. The detector (`VarianceCUSUM`, `PageHinkley`, `GLR`; for
    recursive estimators also `ScoreCUSUM`) watches the whitened innovations after ``settle`` measured samples (None:
    six times the number of unknowns); with several outputs, each has one of its own. No parameter becomes wider than
    its prior. Bad at slow drift, which never alarms (use `RandomWalk`), at noise whose variance grows (it looks like a
    jump), and at dating a jump: the samples between jump and alarm are taken for the old parameters, so bars are too
    short there, smoothed ones (`Joint.smooth`) also before.

    Examples
    --------
    >>> import driftwise as dw
    >>> b = [[1.0]] * 400 + [[2.0]] * 200  # b1 jumps
    >>> y, u = dw.simulate([-0.8], b, samples=600, noise_std=0.1, seed=1)
    >>> trace = dw.ARX(1, 1, memory=dw.RestartOnChange()).scan(y, u)
    >>> [jump.sample for jump in trace.jumps()], trace.parameters[-1].round(1).tolist()
    ([401], [-0.8, 2.0])
    """

    detector: Any = VarianceCUSUM()
    response: Any = CovarianceInflation()
    settle: float | None = None


@register(
    "gain-reset:N",
    about="constant until they jump; then the gain is 1/N again",
    read=lambda words: RestartOnChange(response=GainReset(words.number())),
)
class GainReset(NamedTuple):
    """After an alarm the gain is 1/``samples`` again, and falls from there: P grows by one factor, nothing moves.

    The best value for jumps of size d is 1 + (noise of the estimate/d)^2, that of a single sample; more than 1.
    Source: Perriot-Mathonna (1981), section 4. Bad at: jumps of one parameter among many (all are freed).

    Examples
    --------
    >>> import driftwise as dw
    >>> b = [[1.0]] * 400 + [[2.0]] * 200  # b1 jumps
    >>> y, u = dw.simulate([-0.8], b, samples=600, noise_std=0.1, seed=1)
    >>> trace = dw.ARX(1, 1, memory=dw.RestartOnChange(response=dw.memory.GainReset(5))).scan(y, u)
    >>> trace.parameters[-1].round(1).tolist(), trace.parameters_std[-1].round(2).tolist()
    ([-0.8, 2.0], [0.0, 0.01])
    """

    samples: float = 10.0


class CovarianceInflationKernel(NamedTuple):
    """What the kernel sees of `CovarianceInflation`: variances q, absolute; ``is_named``: for the parameter named."""

    q: PerParameter
    is_named: float
    cap: PerParameter


class GainResetKernel(NamedTuple):
    """What the kernel sees of `GainReset`."""

    samples: float
    cap: PerParameter


@resolve.on(RestartOnChange)
def resolve_restart_on_change(memory, setting):
    answer = memory.response
    refuse_class("response", answer)
    if isinstance(answer, CovarianceInflation):
        q = jump_size("step", answer.step, setting.N) ** 2 * setting.units
        is_named = float(validation.yes("only_named", answer.only_named))
        return CovarianceInflationKernel(q, is_named, setting.cap)
    if isinstance(answer, GainReset):
        return GainResetKernel(more_than_one("samples", answer.samples), setting.cap)
    raise InputError(f"response must be CovarianceInflation(step) or GainReset(samples), got {answer!r}")


@kernel
def log_volume(D):
    """Return log |P| of P = U D U', exactly known directions left out."""
    total = 0.0
    for i in range(D.size):
        if D[i] > 0.0:
            total += log(D[i])
    return total


@on_alarm.on(CovarianceInflationKernel)
def on_alarm_covariance_inflation(memory, state, alarm, view):
    U, D, known = view.U, view.D, log_volume(view.D)
    for i in range(memory.q.size):
        if memory.is_named == 0.0 or alarm.which < 0.0 or alarm.which == i:
            widen_within(U, D, view.first + i, memory.q[i] / view.s2, memory.cap[i], view.b)
    # as many samples as would be left had all of P grown by one factor: |P'| = c^N |P|
    return view.weight * exp(min((known - log_volume(D)) / D.size, 0.0)), JUMP


@on_alarm.on(GainResetKernel)
def on_alarm_gain_reset(memory, state, alarm, view):
    left = memory.samples - 1.0
    if view.weight <= left:
        return view.weight, JUMP
    for j in range(view.first, view.D.size):
        view.D[j] *= view.weight / left
    hold_within(view.U, view.D, memory.cap, view.c, view.f, view.b)
    return left, JUMP
