"""What ``--memory gain-floor:100`` says: a word, and behind a colon numbers."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..engine.errors import InputError
from .registry import public
from .settings import EKF


class Words(NamedTuple):
    """What the command line says of a memory."""

    text: str

    @property
    def kind(self) -> str:
        """The word before the colon."""
        return self.text.partition(":")[0]

    @property
    def rest(self) -> str:
        """What stands behind the colon."""
        return self.text.partition(":")[2]

    def numbers(self, text: str | None = None, where: str = "") -> list[float]:
        """Return the numbers of a list with commas."""
        try:
            return [float(part) for part in (self.rest if text is None else text).split(",")]
        except ValueError:
            raise InputError(
                f"--memory {self.kind}:{where} takes numbers separated by commas, for example 0.5,-0.2; got "
                f"{self.rest if text is None else text!r}."
            ) from None

    def number(self, text: str | None = None) -> float:
        """Return the only number."""
        values = self.numbers(text)
        if len(values) != 1:
            raise InputError(f"--memory {self.text}: one number is expected there, got {self.rest!r}.")
        return values[0]

    def whole(self) -> int:
        """Return the only number, a whole one."""
        number = self.number()
        if not float(number).is_integer():
            raise InputError(f"--memory {self.text}: a whole number of samples is expected.")
        return int(number)

    def each(self, text: str | None = None, where: str = "") -> Any:
        """Return one number for all parameters, or one for each."""
        values = self.numbers(text, where)
        return values[0] if len(values) == 1 else tuple(values)

    def jump_every(self) -> tuple[Any, float]:
        """Return (jump, every) of "0.3/1000", or of "0.3,0.1/1000": one jump for each parameter."""
        jump, _, every = self.rest.partition("/")
        if not jump or not every:
            raise InputError(
                f"--memory {self.kind}:JUMP/EVERY takes two numbers, for example {self.kind}:0.3/1000; got "
                f"{self.text!r}."
            )
        return self.each(jump), self.number(every)


def read(text: str) -> Any:
    """Return the memory that a text such as "exponential:0.99" names."""
    words = Words(text)
    for entry in public().values():
        if text in entry.forms and ":" not in text:
            return entry.kind()
        if words.rest and any(form.startswith(f"{words.kind}:") for form in entry.forms):
            return entry.read(words)
    if words.kind == "ekf":
        raise InputError(f"--memory ekf: {EKF}.")
    raise InputError(f"--memory must be {all_forms()}; got {text!r}.")


def all_forms() -> str:
    """Return how every memory is written, and what it is, in one sentence."""
    return ", ".join(f"{' or '.join(entry.forms)} ({entry.about})" for entry in public().values() if entry.forms)
