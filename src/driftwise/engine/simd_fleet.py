"""The loop of a fleet, eight series at a time where eight have clean samples, one at a time elsewhere."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from . import compile
from .dispatch import advance, open_row, open_scratch, read_all
from .loops import AHEAD
from .recovery import is_sound, settle
from .simd import LANES, collect, disagreements, finite, gather, interleave, own, scatter
from .views import fetch, matrix

STRETCH = 128  # samples of each series between two times that lanes go back into the rows
NEAR = 1500  # numbers of a state and its step, up to which lanes lie on the stack: what is not there is in registers
RESCUE = 64  # samples taken one by one after a missing one, or after a disagreement
DIMENSIONS = (*compile.CREW, "index", 1, "index")  # of what the loop takes
MOST = 255  # samples of a series beyond which it does not matter how many more there are


def make_lanes(kinds, sizes, shapes, fingerprint):
    """Return the loop of `compile.crew` that takes members by ``turns``, with room to interleave in (see `room`)."""
    width, outputs, inputs, columns, numbers, scratch_size = shapes
    Y = width + scratch_size  # where the samples of a stretch begin in ``space``, in lanes: outputs, inputs, results
    U = Y + outputs
    O = U + inputs
    end = O + columns

    def advance_members(rows, members, starts, order, ys, us, outs, specs, group, buffer, turn, space, places):
        version = fingerprint
        if (
            rows.shape[1] != width
            or buffer.size != scratch_size
            or buffer.shape[0] != scratch_size
            or specs.shape[1] != numbers
        ):
            return -1  # never; but now the compiler knows these as constants too
        if ys.shape[1] != outputs or us.shape[1] != inputs or outs.shape[1] != columns:
            return -1
        if space.size != LANES * end or space.shape[0] != LANES * end:
            return -1
        wide = own(end) if end <= NEAR else interleave(space)
        y8, u8, out8 = matrix(wide[Y:U], 1, outputs), matrix(wide[U:O], 1, inputs), matrix(wide[O:end], 1, columns)
        row, first, at = (
            places[:LANES],
            places[LANES : 2 * LANES],
            places[2 * LANES :],
        )  # of each lane; `at`: of its sample
        i = 0
        while i < turn.size:
            spec = specs[group[members[turn[i]]]]
            form, noise, memory, gate, scale, detector = read_all(kinds, sizes, spec)
            # so many series of the same settings, as far as each has samples
            count, longest, common = 0, 0, 0
            while count < LANES and i + count < turn.size:
                k = turn[i + count]
                samples = starts[k + 1] - starts[k]
                if count > 0 and group[members[k]] != group[row[0]]:
                    break
                row[count], first[count] = members[k], starts[k]
                longest, common = max(longest, samples), samples if count == 0 else min(common, samples)
                count += 1
            for j in range(i + count, min(i + count + LANES, turn.size)):  # those after them
                k = turn[j]
                t = order[starts[k]] if order.size else starts[k]
                fetch(rows, members[k])
                fetch(ys, t)
                fetch(us, t)
                fetch(outs, t)
            done = 0
            while done < longest:
                stretch, is_done, are_sound = longest - done, False, True
                if count == LANES and done < common:
                    before, taken, stretch = disagreements(), 0, min(common - done, STRETCH)
                    collect(rows, row, wide[:width])
                    state8, work8 = open_row(form, wide[:width]), open_scratch(form, wide[width:Y])
                    while taken < stretch:
                        for l in range(LANES):
                            t = first[l] + done + taken
                            at[l] = t
                            if order.size:
                                at[l] = order[t]
                                ahead = order[min(t + AHEAD, order.size - 1)]
                                fetch(ys, ahead)
                                fetch(us, ahead)
                                fetch(outs, ahead)
                        is_clean = True
                        for c in range(outputs):
                            y8[0, c] = gather(ys, at, c)
                            is_clean = is_clean and finite(y8[0, c])
                        for c in range(inputs):
                            u8[0, c] = gather(us, at, c)
                            is_clean = is_clean and finite(u8[0, c])
                        if not is_clean:
                            break
                        advance(form, noise, memory, gate, scale, detector, state8, work8, y8, u8, out8, 0)
                        for c in range(outputs):  # prediction, variance: see `is_sound`
                            are_sound = are_sound and finite(out8[0, c]) and finite(out8[0, 2 * outputs + c])
                        if not are_sound:
                            break
                        scatter(wide[O:end], outs, at)
                        taken += 1
                    is_done = taken > 0 and are_sound and disagreements() == before
                    if is_done:
                        stretch = taken
                        scatter(wide[:width], rows, row)
                    else:
                        stretch = min(RESCUE, common - done)
                if not is_done:
                    scratch = open_scratch(form, buffer)
                    for l in range(count):
                        k = turn[i + l]
                        state = open_row(form, rows[row[l]])
                        j, again, clock = first[l] + done, -1.0, 0.0
                        while j < min(first[l] + done + stretch, starts[k + 1]):
                            t = order[j] if order.size else j
                            advance(form, noise, memory, gate, scale, detector, state, scratch, ys, us, outs, t)
                            j += 1
                            if not is_sound(outs[t], outputs) or again >= 0.0:
                                again, clock = settle(rows[row[l]], spec, outs[t], outputs, again, clock)
                                j -= 1 if again >= 0.0 else 0
                done += stretch
            i += count
        return version

    return advance_members


@functools.cache
def lane_crew(kinds: tuple[type, ...], sizes: tuple[float, ...], shapes: tuple[int, ...]) -> Callable | None:
    """Return the compiled loop of `compile.crew`, the same bits; after its arguments come `turns` and `room`.

    None: no compiler here knows of lanes (tcc).
    """
    return compile.native(make_lanes, (kinds, sizes, shapes), kinds, DIMENSIONS)


def turns(members, starts, group) -> np.ndarray:
    """Return the order in which members shall be taken: side by side those of the same settings, and as many samples.

    ``starts`` are one more than ``members``: the samples of each; ``group`` names the settings of a row.
    """
    turn = np.empty(len(members), np.int64)
    count = compile.function(turns_of_one_kind, *["index"] * 5)
    if count(members, starts, group, np.zeros(MOST + 2, np.int64), turn) < 0:
        key = np.minimum(np.diff(starts), MOST) + (MOST + 1) * group[members]
        return np.argsort(key.astype(np.uint16) if key.max() < 1 << 16 else key, kind="stable")
    return turn


def turns_of_one_kind(members, starts, group, counts, turn):
    """Sort members by how many samples they have, in ``turn``, by counting; return -1 where settings differ."""
    for j in range(members.size):
        if group[members[j]] != group[members[0]]:
            return -1
        counts[min(starts[j + 1] - starts[j], MOST) + 1] += 1
    for c in range(1, counts.size):
        counts[c] += counts[c - 1]
    for j in range(members.size):
        c = min(starts[j + 1] - starts[j], MOST)
        turn[counts[c]] = j
        counts[c] += 1
    return turn.size


def room(shapes) -> tuple[np.ndarray, np.ndarray]:
    """Return memory to interleave states and samples in, aligned as lanes must be, and for numbers of each lane."""
    width, outputs, inputs, columns, _, own = shapes
    size = LANES * (width + own + outputs + inputs + columns)
    whole = np.empty(size + LANES)
    first = -(whole.ctypes.data // 8) % LANES
    return whole[first : first + size], np.empty(3 * LANES, np.int64)
