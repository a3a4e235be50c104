"""The error a user meets at the door."""


class InputError(ValueError):
    """Data or a setting handed over by the user cannot be used; the message says which, why and the likely cause."""


class CommandError(InputError):
    """An option of a command cannot be what it is; no data were looked at."""


class Stopped(BaseException):
    """The process was asked to end; ``code`` is its exit code, the words say what is left to go on with."""

    def __init__(self, code: int, words: str = ""):
        super().__init__(words)
        self.code = code


def refuse_class(name, value) -> None:
    """Raise `InputError` where a class came instead of one of its kind: the brackets were forgotten."""
    if isinstance(value, type):
        call = f"{value.__name__}(..)"
        raise InputError(f"{name} must be {call}, got the class {value.__name__} itself; were the brackets forgotten?")
