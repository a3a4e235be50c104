"""A stretch of another level, told by both of its ends at once."""

from __future__ import annotations

import math

import numpy as np

from .change_effects import LEVEL, effects
from .change_places import PLACES, apart
from .noise_jumps import LEAST, SURE
from .response import Response
from .response_record import long_run


def stretch(now: Response) -> tuple[int, int] | None:
    """Return the two places between which another level explains most beside all else; None where that is not sure.

    Each end alone explains little of a level that comes back, and what it leaves looks like slow noise: the ends are
    looked for together (circular binary segmentation; Olshen et al., 2004), each with a size of its own. Bad at: more
    than two at once.
    """
    rows, n = now.rows, len(now.rows)
    if n < 3 * LEAST:
        return None
    inside = np.flatnonzero(now.used)
    inside = inside[(inside >= rows[LEAST]) & (inside <= rows[n - LEAST])]
    grid = apart(np.unique(inside[np.linspace(0, len(inside) - 1, PLACES).astype(int)]), now.dates)
    Q, r = now.basis, now.left * now.weight
    r = r - Q @ (Q.T @ r)
    d = effects(now, LEVEL, 0, grid)[0] * now.weight
    d -= (d @ Q) @ Q.T
    G, g = d @ d.T, d @ r
    own = G.diagonal()
    free = own[:, None] * own - G * G
    is_pair = (np.subtract.outer(grid, grid) <= -LEAST) & (free > 1e-6 * own[:, None] * own)
    taken = np.where(is_pair, own * (g * g)[:, None] - 2 * G * g[:, None] * g + own[:, None] * g * g, 0.0)
    taken = 0.5 * taken / np.where(is_pair, free, 1.0)
    i, j = np.unravel_index(int(np.argmax(taken)), taken.shape)
    if not taken[i, j] - math.log(n) > SURE:
        return None
    part = d[[i, j]].T @ np.linalg.solve(G[np.ix_([i, j], [i, j])], g[[i, j]])
    calm = max(long_run(part * (r - part)) / max(float(np.mean(part**2)), 1e-300), 1.0)
    return (int(grid[i]), int(grid[j])) if taken[i, j] / calm - math.log(n) > SURE else None
