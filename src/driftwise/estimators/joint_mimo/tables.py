"""Several outputs: the tables and the factored prior that the kernel works with, made once."""

from __future__ import annotations

import numpy as np

from ...engine.dispatch import flatten
from ..common.priors import factors_of
from .row import MimoForm


def tables(form, groups, noise, floor, spent, prior, settle, detector_size, memories, **kept) -> MimoForm:
    """Return the kernel's sizes and tables for a `Structure`.

    ``groups`` lists the outputs filtered together, ``memories`` the memory of each, with how many numbers it keeps.
    """
    x_at, theta_at, k = form.x_at, form.theta_at, form.inputs
    U_at, work_at, block_at, blocks = [0], [0], [0], []
    for group in groups:
        x0, theta0 = x_at[group[0]], theta_at[group[0]]
        n = x_at[group[-1] + 1] - x0
        N = n + theta_at[group[-1] + 1] - theta0
        long = N + form.outputs + k + len(group)
        for b in form.blocks:
            if b.output in group:
                row = x_at[b.output] + b.lag - 1 - x0 if b.lag else -(1 + b.output)
                blocks.append((n + b.first - theta0, b.size, row, b.source))
        U_at.append(U_at[-1] + N * (N - 1) // 2)
        work_at.append(work_at[-1] + 2 * long + long * (long - 1) // 2)
        block_at.append(len(blocks))
    first = [group[0] for group in groups] + [form.outputs]
    is_light = len(groups) == form.outputs and not np.any(noise.kappa) and not noise.G.size

    def row_of(values):
        return np.array(values, float).ravel()

    return MimoForm(
        outputs=form.outputs,
        inputs=k,
        groups=len(groups),
        unknowns=form.N,
        light=float(is_light),
        floor=floor,
        exact=float(np.any(noise.R == 0)),
        first=row_of(first),
        x_at=row_of(x_at),
        theta_at=row_of(theta_at),
        U_at=row_of(U_at),
        work_at=row_of(work_at),
        block_at=row_of(block_at),
        blocks=row_of(blocks),
        spent=spent,
        Px=np.diag(prior)[x_at[:-1]].copy(),
        least=1e-60 * np.repeat(noise.R, form.nu),
        settle=settle,
        detector_size=detector_size,
        memory_at=np.cumsum([0, *(size for _, size in memories)]).astype(float),
        spec_at=np.cumsum([0, *(len(flatten([memory])) for memory, _ in memories)]).astype(float),
        spec=flatten([memory for memory, _ in memories]),
        **kept,
    )


def prior_factors(prior, owner, groups):
    """Return D (N,) and U of the prior, U packed group after group; ``owner`` names each unknown's output."""
    D, columns = np.zeros(len(prior)), []
    for group in groups:
        mine = np.flatnonzero(np.isin(owner, group))
        U, D[mine] = factors_of(prior[np.ix_(mine, mine)])
        columns.append(U)
    return D, np.concatenate(columns)
