"""What stands behind `--model`, `--memory` and `--jumps`: a word, a colon, numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from driftwise.errors import InputError

__all__ = ["MEMORIES", "MODELS", "floats", "memory", "model"]

# the numbers of each model, in order; those in PER_INPUT may differ by input: 2/1 is 2 for the first, 1 for the second
MODELS = {
    "ar": ("na",),
    "arx": ("na", "nb", "nk"),
    "arma": ("na", "nc"),
    "armax": ("na", "nb", "nc", "nk"),
    "oe": ("nb", "nf", "nk"),
    "bj": ("nb", "nc", "nd", "nf", "nk"),
    "regression": (),
}
PER_INPUT = ("nb", "nf", "nk")
MEMORIES = (
    "never (constant parameters), limited:N (gain 1/n, then 1/N), weighted:P (a sample fades to P of its weight with "
    "each new one), variable:N, directional:P, walk:Q (they drift; variance per sample, for example walk:1e-6), "
    "walk:JUMP/EVERY (the same for jumps of that size every so many samples), window:T (the last T samples), "
    "jump or jump:STEP (they jump; size to expect, 1 if omitted), runlengths:JUMP/EVERY (jumps of that size)"
)


def floats(option: str, text: str) -> list[float]:
    """Return the numbers of a comma-separated list."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"{option} takes numbers separated by commas, for example 0.5,-0.2; got {text!r}.") from None


def model(text: str, inputs: int) -> tuple[str, dict[str, Any]]:
    """Return the name of a model and its orders: "arx:2,2,1" is ("arx", {na: 2, nb: (2,), nk: (1,)})."""
    kind, _, numbers = text.partition(":")
    if kind not in MODELS:
        raise InputError(f"--model must be one of {', '.join(MODELS)}, with orders as in arx:2,2,1; got {text!r}.")
    names = MODELS[kind]
    if inputs and kind in ("ar", "arma"):
        raise InputError(f"--model {kind} has no input, but --input was given: take {kind}x or leave the input out.")
    if not inputs and ("nb" in names or kind == "regression"):
        raise InputError(f"--model {kind} explains the output by an input; which column is it (--input)?")
    given = numbers.split(",") if numbers else []
    needed = len(names) - ("nk" in names)
    if not needed <= len(given) <= len(names):
        form = f"{kind}:{','.join(names)}" if names else kind
        example = ",".join("1" if name == "nk" else "2" for name in names)
        raise InputError(f"--model is written {form}" + (f", for example {kind}:{example}" * bool(names))
                         + f"; got {text!r}.")  # fmt: skip
    return kind, {name: _order(name, part, inputs, text) for name, part in zip(names, given)}


def _order(name: str, part: str, inputs: int, text: str) -> Any:
    values = part.split("/")
    if not all(v.strip().isdecimal() for v in values) or (len(values) > 1 and name not in PER_INPUT):
        raise InputError(f"--model {text}: {name} = {part!r} must be a whole number"
                         + (", or one for each input as in 2/1." if name in PER_INPUT else "."))  # fmt: skip
    if name not in PER_INPUT:
        return int(part)
    if len(values) not in (1, inputs):
        raise InputError(f"--model {text}: {name} lists {len(values)} numbers for {inputs} input(s).")
    return tuple(int(v) for v in values * (inputs if len(values) == 1 else 1))


def memory(text: str) -> Any:
    """Return the memory policy that a text such as "weighted:0.99" names."""
    import driftwise as dw

    kind, colon, number = text.partition(":")
    plain: dict[str, Callable[[], Any]] = {"never": dw.Never, "jump": dw.UntilJump}
    if kind in plain and not colon:
        return plain[kind]()
    one: dict[str, Callable[[float], Any]] = {
        "limited": dw.LimitedGain,
        "weighted": dw.Weighted,
    }
    if kind in one and number:
        return one[kind](_number(text, number))
    if kind == "walk" and number:
        steps = floats("--memory walk:", number)
        return dw.Walk(steps[0] if len(steps) == 1 else tuple(steps))
    if kind == "jump" and number:
        steps = floats("--memory jump:", number)
        if not all(step > 0 for step in steps):
            raise InputError(f"--memory jump:STEP is the size of jump to expect, a positive number, got {number!r}.")
        return dw.UntilJump(restart=dw.Inflate(steps[0] if len(steps) == 1 else tuple(steps)))
    raise InputError(f"--memory must be {MEMORIES}; got {text!r}.")


def _number(text: str, number: str) -> float:
    values = floats(f"--memory {text.partition(':')[0]}:", number)
    if len(values) != 1:
        raise InputError(f"--memory {text}: one number is expected after the colon.")
    return values[0]
