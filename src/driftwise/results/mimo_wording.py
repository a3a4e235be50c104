"""A run of several outputs in plain words."""

from __future__ import annotations

import math

from .numbers import chance, plain
from .wording import fit_words, lost_words, pole_words, size_words, times


def paragraph(s) -> str:
    """Return the sentences of a `SummaryMIMO`."""
    est, model = s.estimator, s.model
    if not s.is_enough:
        counts = " and ".join(f"{one.observed}" for one in s.outputs)
        return (
            f"{counts} measured outputs are too few for {' and '.join(map(str, est.unknowns))} unknowns: "
            "nothing can be said yet."
        )
    modes = [pole_words(p, std, est.dt) for p, std in s.poles if p.imag >= 0]
    run = "one filter for each output" if est.is_split else "one filter for all outputs"
    text = f"Structure {model.form.nu}, {run}: {', '.join(modes)}."
    for i, one in enumerate(s.outputs):
        text += f" {_output(f'y{i + 1}', one, s.samples)}"
    settles = all(abs(p) + 2 * std < 1 for p, std in s.poles)
    if s.gains and settles and all(math.isfinite(std) for *_, std in s.gains):
        listed = ", ".join(f"y{i} from u{l} {g:.3g} ± {std:.2g}" for i, l, g, std in s.gains)
        text += f" Steady-state gain: {listed}."
    text += "".join(f" {note[0].upper()}{note[1:]}." for note in s.notes)
    if s.unlearned:
        text += f" The data did not teach {'; '.join(d for d, _ in s.unlearned)}: nothing in the record excites them."
    return text + (f" {s.missing_inputs} of {s.samples} samples lack an input." if s.missing_inputs else "")


def _output(name, one, samples) -> str:
    text = f"{name}: the next sample is predicted with {fit_words(one)}"
    if math.isfinite(one.nis):
        size = size_words(one.nis_interval)
        white = one.whiteness.is_white or not math.isfinite(one.whiteness.p_value)
        good = "the error bars can be believed" if white else "the bands of the predictions hold"
        bars = f"the error bars are {size}" if size else good
        text += f"; {bars} (NIS {plain(one.nis, 2)}, {100 * one.coverage:.0f} % inside the 95 % band)"
    w = one.whiteness
    if math.isfinite(w.p_value):
        text += (
            "; the innovations are white"
            if w.is_white
            else f"; the innovations are not white ({chance(w.p_value)}): try a larger index, another noise, or "
            "walking parameters"
        )
    if one.drift:
        text += f"; drift: {one.drift.words}"
    if one.jumps:
        text += f"; its parameters jumped {one.jumps} time{'s' * (one.jumps > 1)}"
    rises, when = one.happened["noise_rises"]
    if rises:
        text += f"; its noise level rose {times(rises, when)}"
    lost = [f"{count} {what}" for count, what in ((one.missing, "missing"), (one.bad_values, "absurd values")) if count]
    lost += lost_words(one)
    return text + (f"; of {samples} samples {', '.join(lost)}." if lost else ".")
