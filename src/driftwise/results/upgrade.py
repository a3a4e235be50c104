"""Rows of `AutoMemory` and of an average that earlier versions wrote, as this one lays them out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from enum import Enum
from typing import Any, NamedTuple

import numpy as np


class Form(Enum):
    """Rows of `AutoMemory`, of an average and of a `ScoreCUSUM` without a size as they were, oldest first.

    Until `NO_SPREAD` an average kept the logarithms of its weights; the ratios of a `ScoreCUSUM` lay one parameter
    after the other until `ONE_WIDTH`.
    """

    BANKS = "AutoMemory kept two more banks instead of its trials; the mean of an average was by likelihood alone"
    ONE_START = "AutoMemory began once only; no mean of an average was by the regrets of its members"
    SHORT_HEAD = "louder noise made parameters faster, the head of AutoMemory was shorter; means as before"
    NO_SPREAD = "disagreement added nothing to the variance of an average; across gaps its mean was by likelihood"
    ONE_WIDTH = "one variance followed the errors of an average, no four; it kept weights, no logarithms"
    NO_GAPS = "AutoMemory did not count the samples since an output was missing; the mean of an average was of four"
    NO_OUTLIERS = "no second start of AutoMemory counted its own outliers"
    NO_ROWS = "AutoMemory remembered none of the last rows"
    NO_MOMENTS = "AutoMemory summed nothing up over the moments of a jump"
    NO_ACROSS = "no average learnt from its forecasts across gaps"
    ONE_KIND = "AutoMemory did not tell outliers of the sensor from those of the process"
    NO_STEP = "AutoMemory did not learn in which steps outputs are recorded"
    NO_FRESH = "no joint filter of an output error kept what parameters have done since they are doubted"
    NO_MOST = "AutoMemory did not learn what most rows say of sigma^2; short gaps taught an average what long ones did"
    NO_LATE = "AutoMemory kept no rows to look back over"
    NO_LOUDNESS = "AutoMemory did not learn how loud the noise is usually"


def until(last: Form, was: Any, now: Any) -> dict[Form, Any]:
    """Return ``was`` for each form until the last of which it is true, and ``now`` for those that follow."""
    forms = list(Form)
    return {form: was if k <= forms.index(last) else now for k, form in enumerate(forms)}


SHORT_HEAD = 7  # numbers of the head of AutoMemory, until louder noise was told from faster parameters
GAPLESS_HEAD = 9  # and until it counted since when an output was missing
UNCOUNTED = 1  # numbers that its second start had less, until it counted its outliers
MEANS, SHAPES, ACROSS = 4, 4, 3  # that an average was made of, variances that it may have, and means across a gap
BOUNDLESS = 1e300  # no y is further
AVERAGED = Form.NO_OUTLIERS, Form.NO_ROWS, Form.NO_MOMENTS, Form.NO_ACROSS  # forms in which an average was the same
OF_ONE_LENGTH = Form.ONE_KIND, Form.NO_STEP, Form.NO_FRESH, Form.NO_MOST  # and in which its gaps were of one length
TRUSTED, SURE = 1e-4, 60.0  # a regret in y_scale^2, soon outgrown, and so many of them: who has these is trusted alone


class Piece(NamedTuple):
    """Neighbouring numbers of a row: how many there were in each form, how many there are, what makes these of those.

    A form without a maker had the same numbers.
    """

    before: dict[Form, int]
    now: int
    makers: Mapping[Form, Callable[[np.ndarray, Piece], np.ndarray] | None] = {}
    owner: Any = None


def rows(estimator, found: np.ndarray) -> np.ndarray:
    """Return rows of states, (.., numbers), as this version lays them out; any that are not of any former, as they are.

    What `AutoMemory` had learnt goes on: its filters, speeds, outliers. A trial that ran is begun again if need be. An
    average goes on from its weights by likelihood.
    """
    found = estimator.carried_over(found)
    pieces = list(_pieces(estimator))
    for form in Form:
        if found.ndim and found.shape[-1] == sum(p.before[form] for p in pieces) != sum(p.now for p in pieces):
            return _weighed(estimator, _rows(pieces, form, found))
    return _weighed(estimator, found)


def _weighed(estimator, found: np.ndarray) -> np.ndarray:
    """Return rows of an average with its weights, not their logarithms: these are never above zero, those always."""
    if not estimator.members or not found.ndim or found.shape[-1] != estimator.dtype.itemsize // 8:
        return found
    now = np.array(found)
    own = now.view(estimator.dtype)["own"]
    if np.any(own["likely"] <= 0.0):
        weights = np.exp(own["likely"])
        own["likely"] = weights / weights.sum(axis=-1, keepdims=True)
    return now


def _rows(pieces: list[Piece], form: Form, found: np.ndarray) -> np.ndarray:
    parts, at = [], 0
    for piece in pieces:
        part, maker = found[..., at : at + piece.before[form]], piece.makers.get(form)
        parts.append(part if maker is None else maker(part, piece))
        at += piece.before[form]
    return np.concatenate(parts, axis=-1)


def table(estimator, found: np.ndarray, width: int) -> np.ndarray:
    """Return the table of a trace with a column for each of today's filters: those of trials had no weight."""
    from ..memory.auto import AutoMemoryKernel
    from ..memory.trial_state import COPIES

    found = estimator.carried_table(found)
    if not any(isinstance(policy, AutoMemoryKernel) for policy in estimator.policies):
        return found
    if found.ndim != 2 or found.shape[1] != width - 3 * COPIES:
        return found
    return np.insert(found, [estimator.columns["mixture"].stop - 3 * COPIES] * 3 * COPIES, 0.0, axis=1)


def fields(estimator) -> list[list]:
    """Return, of each former row, [name, size] of the parts of a state, those of no size left out."""
    all_parts = list(_parts(estimator))
    sizes = [[(name, sum(piece.before[form] for piece in pieces)) for name, pieces in all_parts] for form in Form]
    return [[[name, size] for name, size in found if size] for found in sizes]


def _pieces(estimator) -> Iterator[Piece]:
    for _, pieces in _parts(estimator):
        yield from pieces


def _parts(estimator) -> Iterator[tuple[str, list[Piece]]]:
    """Yield each part of a row, and the pieces it is made of."""
    from ..detect.size_mixture import SizeMixture
    from ..memory.auto import AutoMemoryKernel

    kinds: dict[str, tuple[type, Any]] = {
        "memory_state": (AutoMemoryKernel, _piece), "detector_state": (SizeMixture, _mixture)
    }  # fmt: skip
    members = {f"member{i}": one for i, one in enumerate(estimator.members)}
    for name in estimator.dtype.names:
        size = estimator.dtype[name].itemsize // 8
        if name in members:
            yield name, list(_pieces(members[name]))
            continue
        if members and name == "own":
            yield name, [_average(estimator, size)]
            continue
        if name == "fresh":
            yield name, [Piece(until(Form.NO_FRESH, 0, size), size, until(Form.NO_FRESH, _none_yet, None))]
            continue
        pieces = []
        if name in kinds:
            kind, piece = kinds[name]
            kept = [policy for one in estimator.parts for policy in one.policies if isinstance(policy, kind)]
            pieces = [piece(policy, size // len(kept)) for policy in kept]
        yield name, pieces if sum(p.now for p in pieces) == size else [Piece(dict.fromkeys(Form, size), size)]


def _none_yet(was: np.ndarray, piece: Piece) -> np.ndarray:
    """Return numbers that were not kept: nothing has happened."""
    return np.zeros((*was.shape[:-1], piece.now))


def _mixture(detector, size: int) -> Piece:
    """Return how long the part of a mixture over sizes was and is."""
    m = detector.parameters(size)
    last = Form.ONE_WIDTH
    return Piece(until(last, size - 3 * m, size), size, until(last, _by_sizes, None), (int(detector.K), m))


def _by_sizes(was: np.ndarray, piece: Piece) -> np.ndarray:
    """Return what one mixture keeps: of each parameter there were all sizes up, then down; what it said is not kept."""
    K, m = piece.owner
    ratios = was[..., -6 * m * K :].reshape(*was.shape[:-1], 3, m, 2, K)
    now = np.zeros((*was.shape[:-1], piece.now))
    now[..., : was.shape[-1] - 6 * m * K] = was[..., : -6 * m * K]
    now[..., -6 * m * K :] = np.moveaxis(ratios, (-1, -2, -3), (-3, -2, -1)).reshape(*was.shape[:-1], 6 * m * K)
    return now


def _piece(memory, size: int) -> Piece:
    """Return how long the part of an `AutoMemory` was and is."""
    from ..memory.additive import past_size
    from ..memory.at_rest import HEARD_BOTH
    from ..memory.auto_constants import MOMENTS
    from ..memory.auto_state import HEAD, MODES
    from ..memory.bank import bank_size
    from ..memory.less_noise import HEARD
    from ..memory.likelihood_drift import learner_size
    from ..memory.modes import size_of
    from ..memory.moments import moments_size
    from ..memory.resolution import KEPT
    from ..memory.retrospect import retrospect_size
    from ..memory.robust_start import rows_size
    from ..memory.second_start import second_size
    from ..memory.unknown_drift import drift_state_size

    N, now = memory.cap.size, memory.state_size(memory.cap.size)
    first = SHORT_HEAD + bank_size(N, MODES) + 2 * MODES * size_of(N) + learner_size(N, N)
    with_late = now - HEARD_BOTH
    with_most = with_late - retrospect_size(N, int(memory.stakes))
    with_step = with_most - HEARD
    with_moments = with_step - KEPT - past_size(N)
    with_rows = with_moments - moments_size(N, MODES, MOMENTS)
    last = with_rows - rows_size(N) - UNCOUNTED
    third, fourth = last - (HEAD - SHORT_HEAD), last - (HEAD - GAPLESS_HEAD)
    second = third - second_size(N) + UNCOUNTED
    before = {
        **until(Form.NO_GAPS, fourth, last),
        Form.BANKS: drift_state_size(N, first), Form.ONE_START: second, Form.SHORT_HEAD: third,
        Form.NO_ROWS: last + UNCOUNTED, Form.NO_MOMENTS: with_rows,
        **dict.fromkeys((Form.NO_ACROSS, Form.ONE_KIND), with_moments), Form.NO_STEP: with_step - KEPT,
        Form.NO_FRESH: with_step, Form.NO_MOST: with_step, Form.NO_LATE: with_most,
        Form.NO_LOUDNESS: with_late,
    }  # fmt: skip
    makers = {
        **until(Form.NO_GAPS, _longer_head, _counting), Form.BANKS: _trials, Form.ONE_START: _second_start,
        Form.NO_ROWS: _longer, Form.NO_MOMENTS: _longer,
        **dict.fromkeys((Form.NO_ACROSS, Form.ONE_KIND), _one_kind), Form.NO_STEP: _longer, Form.NO_FRESH: _longer,
        Form.NO_MOST: _longer, Form.NO_LATE: _longer, Form.NO_LOUDNESS: _longer,
    }  # fmt: skip
    return Piece(before, now, makers, memory)


def _average(estimator, size: int) -> Piece:
    """Return how long what an average keeps of its own was and is."""
    start = estimator.start()["own"]
    members = start["likely"].size
    first = sum(start[name].size for name in start.dtype.names[: start.dtype.names.index("regret")])
    second = first + 2 * members + (MEANS - 2) + 3 * (MEANS - 1)  # two more weights, their errors, regrets of three
    across = 3 * (members + 1) + 3 * ACROSS  # of gaps of one length: weights of all, and regrets of three
    apart = first + 5 * members + (MEANS - 2) + 3 * MEANS  # weights and regrets of members, regrets of four
    before = {
        Form.BANKS: first, Form.ONE_START: second, Form.SHORT_HEAD: second, Form.NO_SPREAD: apart + 2,
        Form.ONE_WIDTH: apart + 3 + 3 * MEANS, Form.NO_GAPS: apart + 1 + 3 * MEANS + 4 * SHAPES,
        **dict.fromkeys(AVERAGED, size - 2 * across - 2), **dict.fromkeys(OF_ONE_LENGTH, size - across),
        Form.NO_LATE: size, Form.NO_LOUDNESS: size,
    }  # fmt: skip
    makers = {
        **until(Form.SHORT_HEAD, _alone, None), Form.NO_SPREAD: _of_one_width, Form.ONE_WIDTH: _of_one_width,
        Form.NO_GAPS: _of_four, **dict.fromkeys(AVERAGED, _without_gaps),
        **dict.fromkeys(OF_ONE_LENGTH, _of_one_length),
    }  # fmt: skip
    return Piece(before, size, makers, start)


def _begun(was: np.ndarray, piece: Piece) -> tuple[np.ndarray, np.ndarray]:
    """Return what an average keeps, with what it knew of its members: as a row, and by name."""
    now = np.broadcast_to(np.atleast_1d(piece.owner).view(float), (*was.shape[:-1], piece.now)).copy()
    now[..., : piece.before[Form.BANKS]] = was[..., : piece.before[Form.BANKS]]
    return now, now.view(piece.owner.dtype)[..., 0]


def _alone(was: np.ndarray, piece: Piece) -> np.ndarray:
    """Return what an average keeps that trusts the mean by likelihood alone, at first."""
    now, found = _begun(was, piece)
    found["regret"][..., -1], found["regret_most"][..., -1] = SURE * TRUSTED, TRUSTED
    found["regret_squares"][..., -1] = TRUSTED**2
    return now


def _of_members(was: np.ndarray, piece: Piece) -> tuple[np.ndarray, np.ndarray]:
    """Return what an average keeps, with the regrets of its members; they stood behind two more weights of each."""
    now, found = _begun(was, piece)
    members, at = piece.owner["likely"].size, piece.before[Form.BANKS]
    for k, name in enumerate(("regret", "regret_squares", "regret_most")):
        found[name][..., :-1] = was[..., at + (2 + k) * members : at + (3 + k) * members]
    return now, found


def _of_one_width(was: np.ndarray, piece: Piece) -> np.ndarray:
    """Return what an average keeps, with a width of each variance: it stood before silent."""
    now, found = _of_members(was, piece)
    at = piece.before[Form.NO_SPREAD] - 2
    found["width"], found["silent"] = was[..., at : at + 1], was[..., at + 1]
    return now


def _of_four(was: np.ndarray, piece: Piece) -> np.ndarray:
    """Return what an average keeps, with all its variances, which stood last."""
    now, found = _of_members(was, piece)
    found["silent"] = was[..., piece.before[Form.NO_SPREAD] - 2]
    now[..., -4 * SHAPES :] = was[..., -4 * SHAPES :]
    return now


def _without_gaps(was: np.ndarray, piece: Piece) -> np.ndarray:
    """Return what an average keeps, which learnt nothing across gaps and knows no range; its variances stand last."""
    start = np.broadcast_to(np.atleast_1d(piece.owner).view(float), (*was.shape[:-1], piece.now))
    head, rest = was.shape[-1] - 4 * SHAPES, piece.now - 4 * SHAPES
    now = np.concatenate([was[..., :head], start[..., head:rest], was[..., head:]], axis=-1)
    now[..., rest - 2], now[..., rest - 1] = -BOUNDLESS, BOUNDLESS
    return now


def _of_one_length(was: np.ndarray, piece: Piece) -> np.ndarray:
    """Return what an average keeps, to which gaps of all lengths have taught the same."""
    now = np.broadcast_to(np.atleast_1d(piece.owner).view(float), (*was.shape[:-1], piece.now)).copy()
    found, at = now.view(piece.owner.dtype)[..., 0], 0
    for name in found.dtype.names:
        is_across, shape = name.startswith("across"), found.dtype[name].shape
        size = int(np.prod(shape[1:] if is_across else shape))
        part = was[..., at : at + size].reshape(*was.shape[:-1], *((1, *shape[1:]) if is_across else shape))
        found[name], at = part, at + size
    return now


def _longer_head(was: np.ndarray, piece: Piece) -> np.ndarray:
    """Return what one `AutoMemory` keeps, whose noise has not become louder, and who misses no output."""
    from ..memory.auto_state import HEAD
    from ..memory.unknown_drift import drift_state_size

    end, more = drift_state_size(piece.owner.cap.size) + HEAD, piece.before[Form.NO_OUTLIERS] - was.shape[-1]
    return _counting(np.insert(was, [end - more] * more, 0.0, axis=-1), piece)


def _counting(was: np.ndarray, piece: Piece) -> np.ndarray:
    """Return what one `AutoMemory` keeps, whose second start met no outlier; its row and the learner stand last."""
    from ..memory.likelihood_drift import learner_size
    from ..memory.modes import size_of

    N = piece.owner.cap.size
    return _longer(np.insert(was, was.shape[-1] - learner_size(N, N) - size_of(N), 0.0, axis=-1), piece)


def _longer(was: np.ndarray, piece: Piece) -> np.ndarray:
    """Return what one `AutoMemory` keeps, without what stands last: rows, moments, steps of y, loudness."""
    return np.concatenate([was, np.zeros((*was.shape[:-1], piece.now - was.shape[-1]))], axis=-1)


def _one_kind(was: np.ndarray, piece: Piece) -> np.ndarray:
    """Return what one `AutoMemory` keeps, which remembers no past outputs; its moments stood last."""
    from ..memory.additive import past_size
    from ..memory.auto_constants import MOMENTS
    from ..memory.auto_state import MODES
    from ..memory.moments import moments_size

    N = piece.owner.cap.size
    at = was.shape[-1] - moments_size(N, MODES, MOMENTS)
    return _longer(np.insert(was, [at] * past_size(N), 0.0, axis=-1), piece)


def _second_start(was: np.ndarray, piece: Piece) -> np.ndarray:
    """Return what one `AutoMemory` keeps, which has not begun again; what learns a speed stands last."""
    from ..memory.likelihood_drift import learner_size

    N, third = piece.owner.cap.size, piece.before[Form.SHORT_HEAD]
    was = np.insert(was, [was.shape[-1] - learner_size(N, N)] * (third - was.shape[-1]), 0.0, axis=-1)
    return _longer_head(was, piece)


def _trials(was: np.ndarray, piece: Piece) -> np.ndarray:
    """Return what one `AutoMemory` keeps; it kept on, age, jumped, louder, verdict, rho, clean, and three banks."""
    from ..memory.auto_constants import ISOLATED
    from ..memory.auto_state import CLEAN, IS_ISOLATED, MODES, RHO
    from ..memory.bank import bank_size
    from ..memory.likelihood_drift import learner_size
    from ..memory.unknown_drift import drift_state_size

    N = piece.owner.cap.size
    begin, learner = drift_state_size(N), learner_size(N, N)
    filters = begin + SHORT_HEAD + bank_size(N, MODES)
    now = np.zeros((*was.shape[:-1], piece.before[Form.SHORT_HEAD]))
    now[..., :filters] = was[..., :filters]
    now[..., -learner:] = was[..., -learner:]
    head = now[..., begin : begin + SHORT_HEAD]
    rho, clean = head[..., 5].copy(), head[..., 6].copy()
    head[...] = 0.0
    head[..., RHO], head[..., CLEAN], head[..., IS_ISOLATED] = rho, clean, clean >= ISOLATED
    return _longer_head(now, piece)
