"""The loops that are compiled: over series and samples, with one combination of policy types inside.

A loop closes over *classes*, sizes and an integer fingerprint of the sources (which numba, where it compiles the same
loops, keeps as part of its cache key).
"""

from .dispatch import (
    advance,
    look_back,
    open_row,
    open_scratch,
    pass_over,
    read,
    read_all,
    remember,
    retreat,
    watch,
)
from .recovery import is_sound, settle
from .views import fetch

READ = frozenset("ys us y u zs slopes spec specs group at time bad filled".split())  # what loops never write to

AHEAD = 4  # samples between fetching one and taking it, where they stand in any order


def make_driver(kinds, fingerprint):
    """Return the driver: a loop over series, and a loop over samples inside it."""

    def drive(rows, ys, us, outs, spec, buffer):
        version = fingerprint  # part of the cache key; the code itself does not need it
        form, noise, memory, gate, scale, detector = read_all(kinds, (), spec)
        scratch = open_scratch(form, buffer)
        for i in range(rows.shape[0]):
            state = open_row(form, rows[i])
            y, u, out = ys[i], us[i], outs[i]
            t, count, clock = 0, -1.0, 0.0
            while t < y.shape[0]:
                advance(form, noise, memory, gate, scale, detector, state, scratch, y, u, out, t)
                t += 1
                if not is_sound(out[t - 1], y.shape[1]) or count >= 0.0:
                    count, clock = settle(rows[i], spec, out[t - 1], y.shape[1], count, clock)
                    t -= 1 if count >= 0.0 else 0
        return version

    return drive


def make_crew(kinds, sizes, shapes, fingerprint):
    """Return the loop of a fleet: over its members, and over the samples of each; ``sizes`` are constants."""
    width, outputs, inputs, columns, numbers, room = shapes

    def advance_members(rows, members, starts, order, ys, us, outs, specs, group, buffer):
        version = fingerprint
        if rows.shape[1] != width or buffer.size != room or buffer.shape[0] != room or specs.shape[1] != numbers:
            return -1  # never; but now the compiler knows these as constants too
        if ys.shape[1] != outputs or us.shape[1] != inputs or outs.shape[1] != columns:
            return -1
        for i in range(members.size):
            spec = specs[group[members[i]]]
            form, noise, memory, gate, scale, detector = read_all(kinds, sizes, spec)
            scratch = open_scratch(form, buffer)
            state = open_row(form, rows[members[i]])
            j, count, clock = starts[i], -1.0, 0.0
            while j < starts[i + 1]:
                t = j
                if order.size:
                    t = order[j]
                    ahead = order[min(j + AHEAD, order.size - 1)]
                    fetch(ys, ahead)
                    fetch(us, ahead)
                    fetch(outs, ahead)
                advance(form, noise, memory, gate, scale, detector, state, scratch, ys, us, outs, t)
                j += 1
                if not is_sound(outs[t], outputs) or count >= 0.0:
                    count, clock = settle(rows[members[i]], spec, outs[t], outputs, count, clock)
                    j -= 1 if count >= 0.0 else 0
        return version

    return advance_members


def make_recorder(kinds, fingerprint):
    """Return the loop that steps through one series and keeps every state and what each step did."""

    def record(row, history, y, u, out, spec, buffer):
        version = fingerprint
        form, noise, memory, gate, scale, detector = read_all(kinds, (), spec)
        scratch = open_scratch(form, buffer)
        state = open_row(form, row)
        t, count, clock = 0, -1.0, 0.0
        while t < y.shape[0]:
            for i in range(row.size):
                history[t, i] = row[i]
            advance(form, noise, memory, gate, scale, detector, state, scratch, y, u, out, t)
            remember(form, scale, state, scratch, history[t, row.size :])
            t += 1
            if not is_sound(out[t - 1], y.shape[1]) or count >= 0.0:
                count, clock = settle(row, spec, out[t - 1], y.shape[1], count, clock)
                t -= 1 if count >= 0.0 else 0
        for i in range(row.size):
            history[y.shape[0], i] = row[i]
        return version

    return record


def make_smoother(Form, fingerprint):
    """Return the loop back, over the whole history or ``lag`` samples for each; ``unknown`` is where it starts."""

    def smooth(history, width, count, lag, s2, outs, spec, buffer, unknown, space):
        version = fingerprint
        form, _ = read(Form, spec, 0)
        scratch = open_scratch(form, buffer)
        size = history.shape[0] - 1
        for t in range(count - 1, -1, -1):
            last = t
            if lag >= 0:
                last = min(t + lag, size - 1)
                for i in range(space.shape[0]):
                    for j in range(space.shape[1]):
                        space[i, j] = unknown[i, j]
            for j in range(last, t - 1, -1):
                retreat(form, history[j, :width], history[j + 1, :width], history[j, width:], scratch, space)
            look_back(form, history[t, :width], s2 if lag < 0 else history[last, width], space, outs[t])
        return version

    return smooth


def make_watcher(Detector, fingerprint):
    """Return the loop of a detector on its own: series, and samples inside; ``outs`` takes alarm and first marks."""

    def look(detector_state, zs, slopes, outs, spec):
        version = fingerprint
        detector, _ = read(Detector, spec, 0)
        for i in range(detector_state.shape[0]):
            for t in range(zs.shape[1]):
                outs[i, t, 0] = watch(detector, detector_state[i], zs[i, t], slopes[i, t])
                for c in range(1, outs.shape[2]):
                    outs[i, t, c] = detector_state[i, c - 1]
        return version

    return look


def make_passage(Task, fingerprint):
    """Return a task's way over a record."""

    def go(rows, q, kept, out, numbers, spec):
        version = fingerprint
        task, _ = read(Task, spec, 0)
        pass_over(task, rows, q, kept, out, numbers)
        return version

    return go
