"""The loop of a fleet, eight series at a time where eight neighbours have clean samples, one at a time elsewhere."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from . import compile, jit, simd
from .dispatch import advance, open_row, open_scratch, read_all
from .simd import LANES, disagreements, finite, interleave
from .views import matrix

STRETCH = 64  # samples of each series between two looks at whether the lanes have agreed
RESCUE = 64  # samples taken one by one after a missing one, or after a disagreement
LEAST = 8  # fewer clean samples in a row are not worth interleaving eight states for


def _make(kinds, sizes, shapes, fingerprint):
    """Return the loop of `compile.crew` with room to interleave in, ``space`` (see `room`)."""
    width, outputs, inputs, columns, numbers, own = shapes
    Y = width + own  # where the samples of a stretch begin in ``space``, in lanes: outputs, inputs, results
    U = Y + outputs
    O = U + inputs
    end = O + columns

    def advance_members(rows, members, starts, order, ys, us, outs, specs, group, buffer, space):
        version = fingerprint
        if rows.shape[1] != width or buffer.size != own or buffer.shape[0] != own or specs.shape[1] != numbers:
            return -1  # never; but now the compiler knows these as constants too
        if ys.shape[1] != outputs or us.shape[1] != inputs or outs.shape[1] != columns:
            return -1
        if space.size != LANES * end or space.shape[0] != LANES * end:
            return -1
        wide = interleave(space)
        y8, u8, out8 = matrix(wide[Y:U], 1, outputs), matrix(wide[U:O], 1, inputs), matrix(wide[O:end], 1, columns)
        i = 0
        while i < members.size:
            spec = specs[group[members[i]]]
            form, noise, memory, gate, scale, detector = read_all(kinds, sizes, spec)
            # eight neighbours of the same settings, as far as each has samples
            count, common, longest = 1, 0, starts[i + 1] - starts[i]
            if i + LANES <= members.size:
                most, common = longest, longest
                for l in range(1, LANES):
                    samples = starts[i + l + 1] - starts[i + l]
                    most = max(most, samples)
                    common = min(common, samples if group[members[i + l]] == group[members[i]] else 0)
                if common >= LEAST:
                    count, longest = LANES, most
            done = 0
            while done < longest:
                stretch, is_done = longest - done, False
                if count == LANES and done < common:
                    before, taken, stretch = disagreements(), 0, min(common - done, STRETCH)
                    for l in range(LANES):
                        row = rows[members[i + l]]
                        for c in range(width):
                            space[LANES * c + l] = row[c]
                    state8, work8 = open_row(form, wide[:width]), open_scratch(form, wide[width:Y])
                    while taken < stretch:
                        for l in range(LANES):
                            t = starts[i + l] + done + taken
                            t = order[t] if order.size else t
                            for c in range(outputs):
                                space[LANES * (Y + c) + l] = ys[t, c]
                            for c in range(inputs):
                                space[LANES * (U + c) + l] = us[t, c]
                        is_clean = True
                        for c in range(outputs + inputs):
                            is_clean = is_clean and finite(wide[Y + c])
                        if not is_clean:
                            break
                        advance(form, noise, memory, gate, scale, detector, state8, work8, y8, u8, out8, 0)
                        for l in range(LANES):
                            t = starts[i + l] + done + taken
                            t = order[t] if order.size else t
                            for c in range(columns):
                                outs[t, c] = space[LANES * (O + c) + l]
                        taken += 1
                    is_done = taken > 0 and disagreements() == before
                    if is_done:
                        stretch = taken
                        for l in range(LANES):
                            row = rows[members[i + l]]
                            for c in range(width):
                                row[c] = space[LANES * c + l]
                    else:
                        stretch = min(RESCUE, common - done)
                if not is_done:
                    scratch = open_scratch(form, buffer)
                    for l in range(count):
                        state = open_row(form, rows[members[i + l]])
                        first = starts[i + l] + done
                        for j in range(first, min(first + stretch, starts[i + l + 1])):
                            t = order[j] if order.size else j
                            advance(form, noise, memory, gate, scale, detector, state, scratch, ys, us, outs, t)
                done += stretch
            i += count
        return version

    return advance_members


@functools.cache
def lane_crew(kinds: tuple[type, ...], sizes: tuple[float, ...], shapes: tuple[int, ...]) -> Callable:
    """Return the compiled loop of `compile.crew`, the same bits, with one more array at its end: `room` to work in."""
    simd.bind()
    dimensions = (2, "index", "index", "index", 2, 2, 2, 2, "index", 1, 1)
    return jit.compiled(_make(kinds, sizes, shapes, compile.fingerprint(kinds)), dimensions)


def room(shapes) -> np.ndarray:
    """Return memory to interleave states and samples in, aligned as lanes must be."""
    width, outputs, inputs, columns, _, own = shapes
    size = LANES * (width + own + outputs + inputs + columns)
    whole = np.empty(size + LANES)
    first = -(whole.ctypes.data // 8) % LANES
    return whole[first : first + size]
