"""The error a user meets at the door."""

import re

QUOTED = re.compile(r"""(?<!\w)(?:'[^'\n]{81,}'|"[^"\n]{81,}")(?!\w)""")
WORD = re.compile(r"\S{301,}")
CELL, LINE = 80, 2500  # characters that are repeated of what came with the data, and of a line as a whole


def brief(text: str) -> str:
    """Return a text that repeats no more of what it quotes than is needed to know it again."""
    text = QUOTED.sub(lambda found: f"{found[0][: CELL - 20]} .. {found[0][-17:]}", text)
    text = WORD.sub(lambda found: f"{found[0][:200]} .. {found[0][-60:]}", text)
    lines = text.split("\n")
    return "\n".join(line if len(line) <= LINE else f"{line[: LINE - 400]} .. {line[-390:]}" for line in lines)


class InputError(ValueError):
    """Data or a setting handed over by the user cannot be used; the message says which, why and the likely cause.

    Examples
    --------
    >>> import driftwise as dw
    >>> try:
    ...     dw.ARX(-1)
    ... except dw.InputError as error:
    ...     print(error)
    na must be a whole number of at least 0, got -1
    """

    def __init__(self, text: object = ""):
        super().__init__(brief(str(text)))


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
