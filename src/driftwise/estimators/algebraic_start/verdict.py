"""Which parameters a record can tell, and what to do about those it cannot: in words."""

from __future__ import annotations

import numpy as np

BLIND = 1e-9  # a direction of the unknowns (columns of length one) that leaves no trace in y
SHARE = 0.1  # part of such a direction that makes an unknown one of those concerned
MISFIT = 1.5  # errors so many times the stated noise are not noise


def blind(names: list[str], s, directions) -> list[list[str]]:
    """Return the unknowns of each direction that the record cannot see."""
    found = []
    for direction in directions[s <= BLIND * s[0]]:
        found.append(list(dict.fromkeys(n for n, share in zip(names, abs(direction)) if share > SHARE)))
    return found


def words(hidden, parameters, values, std, units, u, error: float, noise: float | None, spread: float) -> str:
    """Return what a record says about each parameter."""
    sentences = []
    lost = list(dict.fromkeys(name for group in hidden for name in group))
    if len(hidden) == 1 and len(lost) > 1:
        sentences.append(f"Not identifiable: {lost[0]} cannot be told from {_list(lost[1:])}.")
    elif lost:
        sentences.append(f"Not identifiable: {_list(lost)}.")
    weak = [
        f"{name} ({value:.3g} ± {s:.2g})"
        for name, value, s, unit in zip(parameters, values, std, units)
        if name not in lost and s > max(abs(value), unit)
    ]
    if weak:
        sentences.append(f"Hardly known: {_list(weak)}.")
    still = [str(l + 1) for l in range(u.shape[1]) if np.ptp(u[:, l]) == 0]
    if still and (lost or weak):
        sentences.append(f"Input {_list(still)} never changes, which excites next to nothing.")
    elif lost or weak:
        sentences.append("More excitation (a longer record, more switches of the input) or a lower order would help.")
    if noise is not None and error > MISFIT * noise:
        sentences.append(
            f"The errors ({error:.3g}) are {error / noise:.1f} times the stated noise: wrong order, hold or "
            "disturbance."
        )
    elif error > 0.5 * spread > 0:
        sentences.append(f"The model explains little: its errors are {error / spread:.0%} of the output's own spread.")
    if not sentences:
        worst = max(zip(std / np.maximum(abs(values), units), parameters), default=(0.0, ""))
        sentences.append(f"All parameters are identifiable; the least certain is {worst[1]} (to {worst[0]:.1%}).")
    return " ".join(sentences)


def _list(names) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
