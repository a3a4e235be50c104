"""What a smoother found in a record, in words: drift, memory, noise, jumps, and what cannot be told."""

from __future__ import annotations

import math

KINDS = {"walk": "a random walk", "integrated": "an integrated random walk"}


def paragraph(found) -> str:
    """Return drift, memory, noise, jumps and what cannot be told, of `SmoothedParameters`."""
    used = int(found.is_used.sum())
    samples = f"{len(found)} samples" if used == len(found) else f"{len(found)} samples, of which {used} teach"
    parts = [f"In hindsight ({samples}), the parameters take {KINDS[found.drift]}{_why(found)}."]
    parts.append(f"{_memories(found)}.")
    parts.append(f"The noise has standard deviation {found.noise_std:.3g}.")
    parts.append(f"Jumps: {'. '.join(jump.text for jump in found.jumps)}." if found.jumps else "No jump.")
    untold = found.separability.words
    parts += untold or ["The record tells each drift, and the noise, from the others."]
    if found.hindsight.hyper == "average":
        parts.append("Values and bars are averaged over the drifts that the record leaves open.")
    elif found.hindsight.hyper == "ml" and untold:
        parts.append("The bars take the drift for known all the same; those of hyper='average' do not.")
    return " ".join(parts)


def _why(found) -> str:
    """Say by how much the drift beat the other one."""
    if len(found.logliks) < 2:
        return ""
    (other,) = (kind for kind in found.logliks if kind != found.drift)
    lead = found.logliks[found.drift] - found.logliks[other]
    return f", of which the log-likelihood is {lead:.1f} higher than of {KINDS[other]}"


def _memories(found) -> str:
    """Say how many samples count for each parameter."""
    still = [name for name, memory in zip(found.names, found.memory) if math.isinf(memory)]
    moving = [
        f"{name} {memory:.{0 if memory >= 10 else 1}f}"
        for name, memory in zip(found.names, found.memory)
        if math.isfinite(memory)
    ]
    said = []
    if moving:
        said.append(f"memory in samples: {', '.join(moving)}")
    if still:
        said.append(f"constant: {', '.join(still)}")
    text = "; ".join(said)
    return text[0].upper() + text[1:]
