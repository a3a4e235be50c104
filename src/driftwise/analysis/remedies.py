"""What to try next, by estimator: where the noise is not white, and where error bars have the wrong size."""

from __future__ import annotations

from ..results.whiteness import LAGS


def for_colour(s=None, share: float = 0.0) -> str:
    """Return what to try where something predictable is left in the innovations of a `Summary`.

    ``share`` are the squared autocorrelations together, to which a mean of b deviations adds b^4 at each lag.
    """
    if s is None:
        return "something predictable is left in it"
    est = s.estimator
    if LAGS * s.bias**4 > 0.5 * share:
        way = "estimate it (offset=True)" if "offset" in est.options else "take another operating point off y and u"
        return (
            f"the innovations are {abs(s.bias):.2g} deviations too {'low' if s.bias < 0 else 'high'} on average: {way}"
        )
    if s.jumps:
        return "right after jumps it never is; where there are none, try a higher order or another noise model"
    if est.remedy:
        return f"try {est.remedy}"
    walks = ", or parameters that walk or jump" if est.is_constant else ""
    return f"try {est.for_colour}{walks}"


def for_bars(value: float, s=None) -> str:
    """Return what to try where NIS is too far from one."""
    if s is not None and s.estimator.has_known_scale:
        way = "larger" if value > 1 else "smaller"
        return f"the noise is {way} than the variance that was given, so give another, or none: then it is learnt"
    if s is not None and s.estimator.remedy:
        return f"the noise changed along the track, or C does not fit: try {s.estimator.remedy}"
    est = None if s is None else s.estimator
    if value < 1:
        why = "the noise has become quieter, or the drift allowed for is too fast"
    elif est is None or est.is_constant:
        why = "let the parameters drift or jump, or the variance of the noise"
    else:
        why = "the plant changes faster than the memory forgets, or the noise became louder"
    return f"{why}: try {memories(est)}"


def memories(est=None, plain: str = "") -> str:
    """Return the memory to try, ``plain`` or `AutoMemory`: not the one in use, nor one it cannot have."""
    if est is not None and est.is_automatic:
        return "a higher order, or another noise model"
    auto = "memory=AutoMemory()" if est is None else est.automatic
    return f"{plain} or {auto.removeprefix('memory=')}" if plain else auto
