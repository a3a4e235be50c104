"""What stands behind `--model`, `--memory` and `--jumps`: a word, a colon, numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from driftwise import estimators as families
from driftwise import memory as memories
from driftwise import models
from driftwise.engine.bounds import whole
from driftwise.engine.errors import CommandError, InputError

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
ALONE = ("ar:", "arma:")  # models without an input


def refusal(error: InputError, **given: Any) -> CommandError:
    """Return the error with the options it is about, where it names none itself; what was not given is None."""
    text = str(error)
    said = " ".join(f"--{name} {value}" for name, value in given.items() if value is not None)
    return CommandError(text if not said or "--" in text or text.startswith("SPEC ") else f"{said}: {text}")


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
    from driftwise.engine import validation

    values = [value.strip() for value in part.split("/")]
    numbers = [whole(value) for value in values]
    if None in numbers or (len(values) > 1 and name not in PER_INPUT):
        raise InputError(f"--model {text}: {name} = {part!r} must be a whole number"
                         + (", or one for each input as in 2/1." if name in PER_INPUT else "."))  # fmt: skip
    for number in numbers:
        validation.count(name, number)
    if name not in PER_INPUT:
        return numbers[0]
    if len(values) not in (1, inputs):
        raise InputError(f"--model {text}: {name} lists {len(values)} numbers for {inputs} input(s).")
    return tuple(numbers * (inputs if len(values) == 1 else 1))


def policy(text: str, jumps: str | None) -> Any:
    """Return the memory that --memory and --jumps ask for together."""
    found = memory(text)
    if jumps is None:
        return found
    if not isinstance(found, memories.Constant | memories.RestartOnChange):
        raise InputError(
            f"--jumps {jumps} restarts a memory that forgets nothing in between, and --memory {text} forgets all the "
            "time: leave one of them out, or say --memory restart:STEP."
        )
    watching = detector(jumps)
    return (
        found._replace(detector=watching)
        if isinstance(found, memories.RestartOnChange)
        else memories.RestartOnChange(watching)
    )


def detector(text: str) -> Any:
    """Return the detector that a text such as "level:10000,0.5" names: what, false alarms, size."""
    from driftwise.detect.registry import by_word

    known, (kind, _, numbers) = by_word(), text.partition(":")
    rate, comma, size = (part.strip() for part in numbers.partition(","))
    if kind not in known or not rate or (comma and not size):
        raise InputError(
            "--jumps is written DETECTOR:RATE or DETECTOR:RATE,SIZE, for example parameters:10000,0.5 (one false alarm "
            f"in 10 000 samples); DETECTOR is one of {', '.join(known)}; got {text!r}."
        )
    sizes = floats(f"--jumps {kind}:RATE,", size) if size else []
    entry = known[kind]
    if len(sizes) > 1 and not entry.is_each:
        raise InputError(f"--jumps {text}: one SIZE is expected ({entry.size}).")
    if entry.is_whole and sizes and sizes[0] % 1:
        raise InputError(f"--jumps {text}: SIZE is {entry.size}, a whole number.")
    given = [tuple(sizes)] if len(sizes) > 1 else map(int, sizes) if entry.is_whole else sizes
    try:
        found = entry.read(rate, *given)
        if hasattr(found, "resolve"):
            found.resolve(max(len(sizes), 1) if entry.is_each else 0)
    except InputError as error:
        raise InputError(f"--jumps {text}: {error}") from None
    return found


def memory(text: str) -> Any:
    """Return the memory policy that a text such as "exponential:0.99" names."""
    from driftwise.memory.words import read

    return read(text)


# --- whole estimators, as `driftwise compare` takes them -----------------------------------------------------


def recursive(text: str, inputs: tuple[str, ...], **options) -> Any:
    """Return the recursive estimator that a text such as "arx:2,2,1" names."""
    kind, orders = model(text, len(inputs))
    kinds = {"ar": "AR", "arx": "ARX", "arma": "ARMA", "armax": "ARMAX", "oe": "OE", "bj": "BJ"}
    if kind == "regression":
        return families.Regression(list(inputs), **options)
    return getattr(families, kinds[kind])(**orders, **options)


def _last(others: dict[str, Any], dt: float) -> Any:
    """Return the forecaster that expects the last value again."""
    return families.AR(1, theta0=[-1.0], P0=1e-24, dt=dt)


def _mean(others: dict[str, Any], dt: float) -> Any:
    """Return the forecaster that expects the mean so far."""
    return families.ARX(0, (), (), offset=True, dt=dt)


def _average(others: dict[str, Any], dt: float) -> Any:
    """Return the average of the other estimators; last value and mean are in it anyway."""
    members = {name: est for name, est in others.items() if name not in NAMED}
    if not members:
        raise InputError("average needs something to average: name other estimators too, such as arx:1,1 arx:2,2.")
    return families.ModelAverage(list(members.values()), names=list(members))


# forecasters that go by a word alone, each made of (the other estimators by name, dt)
NAMED: dict[str, Callable[[dict[str, Any], float], Any]] = {"last": _last, "mean": _mean, "average": _average}
NOISES = {"equation-error": "EquationError", "output-error": "OutputError", "unknown": "UnknownPolynomial"}


def estimators(texts: list[str], inputs: tuple[str, ...], dt: float) -> dict[str, Any]:
    """Return what SPECs such as "arx:2,2,1@exponential:0.995", "joint:3@restart" or "last" name, by their text."""
    if len(set(texts)) < len(texts):
        twice = next(text for text in texts if texts.count(text) > 1)
        raise InputError(f"SPEC {twice} was given twice; each estimator is compared once.")
    found = {text: _estimator(text, inputs, dt) for text in texts if text not in NAMED}
    return {text: NAMED[text](found, dt) if text in NAMED else found[text] for text in texts}


def _estimator(text: str, inputs: tuple[str, ...], dt: float) -> Any:
    what, at, kept = text.partition("@")
    kind, _, numbers = what.partition(":")
    if at and not kept:
        raise InputError(f"SPEC {text}: a memory is expected behind @, for example {what}@exponential:0.99.")
    if kind not in MODELS and kind != "joint":
        raise InputError(
            f"SPEC {text!r} is not known: it is written KIND:ORDERS or KIND:ORDERS@MEMORY, for example "
            f"arx:2,2,1@restart; KIND is one of joint, {', '.join(MODELS)}, or all of it is one of {', '.join(NAMED)}."
        )
    if kind != "joint":
        seen = () if kind in ("ar", "arma") else inputs  # compared with others that look at inputs
        try:
            return recursive(what, seen, memory=policy(kept or "auto", None), dt=dt)
        except InputError as error:
            raise InputError(f"SPEC {text}: {error}") from None
    order, _, noise = numbers.partition(",")
    if whole(order) is None or (noise or "equation-error") not in NOISES:
        raise InputError(
            f"SPEC {text}: the joint filter is written joint:N or joint:N,NOISE, for example joint:2,unknown; NOISE is "
            f"one of {', '.join(NOISES)}."
        )
    how = getattr(models, NOISES[noise or "equation-error"])()
    return families.Joint(whole(order), len(inputs), noise=how, memory=policy(kept or "constant", None), dt=dt)
