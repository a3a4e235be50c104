"""What can be said of a plant in formulas before its first sample: at its start, with its inputs at rest."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...engine.errors import InputError
from ...models.formula_kernels import evaluate
from ...models.formula_values import undefined
from ...models.state_space import LinearSystem
from .transition import MOST, STRIDE

GROWS = 10.0  # over this many samples, from which a mode that grows is told


def check_numbers(est: Any) -> None:
    """Raise InputError where a formula gives no number at the start, with inputs at 0 and at 1."""
    plant, n, values = est.formulas, est.model.n, [one.start for one in est.formulas.free]
    said = [undefined(plant, est._s0[:n], np.full(est.model.inputs, size), values) for size in (0.0, 1.0)]
    if all(said):
        raise InputError(f"{plant.name}: {said[0]}, which is the plant at its start. Is a start, or a formula, wrong?")


def at_the_start(est: Any) -> list[str]:
    """Return what to know of a plant at its start: unstable, unobservable, too fast for the time between samples."""
    plant, n, k = est.formulas, est.model.n, est.model.inputs
    values = [one.start for one in plant.free]
    _, _, dx, dy = evaluate(plant, est._s0[:n], np.zeros(k), values)
    A, H, said = dx[:, :n], dy[:, :n], []
    if not (np.isfinite(A).all() and np.isfinite(H).all()):
        return []
    system = LinearSystem(A, None, H, None, np.zeros(n), np.ones(len(H)), plant.state_names, None, plant.output_names)
    modes, V = np.linalg.eig(A)
    growth = modes.real * est.dt if plant.is_continuous else np.log(np.maximum(abs(modes), 1e-300))
    if growth.max() > 1e-6:
        state = plant.state_names[int(np.argmax(abs(V[:, int(np.argmax(growth))])))]
        said.append(
            f"At its start the plant is unstable: {state} grows by {np.expm1(growth.max()):.2g} of itself in a sample "
            "where nothing drives it. Is a sign wrong in its formula?"
        )
    if system.hidden:
        said.append(
            f"At its start {', '.join(system.hidden)} cannot be told from {', '.join(plant.output_names)} "
            "(unobservable): what is said of it comes from its start, and from what moves it later."
        )
    reach = abs(A).sum(axis=1).max() * est.dt
    if plant.is_continuous and not plant.is_linear and reach > STRIDE * MOST:
        said.append(
            f"The plant is stiff: its fastest state moves {reach:.0f} times over between samples dt = {est.dt:g} s "
            "apart, and no more steps are taken than a tenth of that takes. Is dt in seconds, and are the units SI?"
        )
    return said
