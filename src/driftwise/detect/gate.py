"""Which samples are believed: all of them, or those within so many standard deviations."""

from typing import Any, NamedTuple

from ..engine import validation
from ..engine.dispatch import choice
from ..engine.errors import InputError, refuse_class
from ..engine.ud import predicted_variance
from .registry import register


class Always(NamedTuple):
    """Every sample is believed."""


@register()
class InnovationGate(NamedTuple):
    """An innovation beyond ``sigmas`` predicted standard deviations is an outlier, treated as missing.

    After ``patience`` rejections in a row it is not an outlier but a change: the next ``settle`` samples are
    believed, and so are the first ones of a run (None: six times the number of unknowns). Bad at heavy-tailed
    noise: it trims what it should weigh.

    Examples
    --------
    >>> import driftwise as dw
    >>> y, u = dw.simulate([-0.8], [1.0], samples=400, noise_std=0.1, seed=1)
    >>> y[200] += 5.0  # a glitch of the sensor
    >>> trace = dw.ARX(1, 1, gate=dw.InnovationGate(5)).scan(y, u)
    >>> trace.summary().rejected, trace.parameters[-1].round(1).tolist()
    (1, [-0.8, 1.0])
    """

    sigmas: float = 5.0
    patience: float = 5.0
    settle: float | None = None


@choice
def admit(gate, e, f, D, R, s2, rejected, observed):
    """Say whether the innovation e is believed; its variance is s2 (f' D f + R)."""


@admit.on(Always)
def admit_always(gate, e, f, D, R, s2, rejected, observed):
    return True


@admit.on(InnovationGate)
def admit_innovation_gate(gate, e, f, D, R, s2, rejected, observed):
    if observed < gate.settle or rejected < 0.0 or rejected >= gate.patience:
        return True
    return e * e <= gate.sigmas * gate.sigmas * s2 * predicted_variance(f, D, R)


@choice
def count_rejections(gate, rejected, is_rejected):
    """Return the number of rejections in a row; negative while samples are believed after a change."""


@count_rejections.on(Always)
def count_rejections_always(gate, rejected, is_rejected):
    return 0.0


@count_rejections.on(InnovationGate)
def count_rejections_innovation_gate(gate, rejected, is_rejected):
    if is_rejected:
        return rejected + 1.0
    if rejected >= gate.patience:
        return -gate.settle
    return min(rejected + 1.0, 0.0)


def resolve_gate(gate, unknowns: int) -> Any:
    """Return the kernel's gate."""
    if gate is None:
        return Always()
    if isinstance(gate, InnovationGate):
        settle = 6 * unknowns if gate.settle is None else validation.count("settle", gate.settle)
        return InnovationGate(
            validation.positive("sigmas", gate.sigmas), validation.positive("patience", gate.patience), float(settle)
        )
    if type(gate) not in admit.table:
        refuse_class("gate", gate)
        raise InputError(f"gate must be None or InnovationGate(sigmas), got {gate!r}")
    return gate
