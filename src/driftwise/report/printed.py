"""The one way to the terminal: what came with the data cannot steer it, and lines are as long as it is wide.

Names of columns, files and series, and cells, are other people's text. On their way here characters that a terminal
obeys rather than shows (escapes, other controls, what turns the direction of writing) become pictures of themselves,
and nothing is taken for markup.
"""

from __future__ import annotations

import functools
import json
import os
import re
import sys
import textwrap
from typing import Any

UNSEEN = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f"  # controls but tab and new line
    "\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufff9-\ufffb"  # direction, lines, notes between them
    "\U000e0000-\U000e007f\ud800-\udfff]"  # tags; halves of characters, of which no encoding knows
)
WHOLE: Any = dict(break_long_words=False, break_on_hyphens=False)
ENDLESS = re.compile(r"\S{400,}")
WIDTH = 110  # where there is no terminal, and COLUMNS does not say
NARROWEST, WIDEST = 20, 500  # what it may say


def visible(text: str) -> str:
    """Return text with pictures of the characters that a terminal would obey.

    >>> visible("pump\\x1b[31m 7")
    'pump␛[31m 7'
    """
    return UNSEEN.sub(_picture, text)


def _picture(found: re.Match) -> str:
    code = ord(found[0])
    return chr(0x2400 + code) if code < 0x20 else "\u2421" if code == 0x7F else "\ufffd"


def as_json(content: Any, indent: int | None = None) -> str:
    """Return JSON in which such characters are escaped, which says the same."""
    text = json.dumps(content, indent=indent, ensure_ascii=False, allow_nan=False)
    return UNSEEN.sub(lambda found: json.dumps(found[0])[1:-1], text)


@functools.cache
def _kind() -> type:
    from rich.console import Console
    from rich.segment import Segment

    class Terminal(Console):
        """A console on which all text is `visible`."""

        def render(self, renderable, options=None):
            for part in list(super().render(renderable, options)):
                yield part if part.control else Segment(visible(part.text), part.style)

    return Terminal


def console(stderr: bool = False) -> Any:
    """Return where to print; plain text where that is no terminal."""
    file, told = sys.stderr if stderr else sys.stdout, columns(os.environ.get("COLUMNS", ""))
    is_known = file is not None and file.isatty()
    width = told or (None if is_known else WIDTH)
    return _kind()(stderr=stderr, highlight=False, markup=False, emoji=False, width=width)


def columns(told: str) -> int | None:
    """Return the width that an environment tells, within what can be read; None where that is no number.

    >>> columns("0"), columns("132"), columns("9" * 5000), columns("wide")
    (20, 132, 500, None)
    """
    return min(max(int(told[:9]), NARROWEST), WIDEST) if told.isdecimal() else None


def say(text: str, stderr: bool = False) -> None:
    """Print sentences: in lines as long as the terminal is wide, in one each where there is none.

    Words stay whole, so that a path can be copied; of one of hundreds of characters, which is none, its ends are shown.
    """
    text = ENDLESS.sub(lambda word: f"{word[0][:100]}\u2026{word[0][-20:]}", text)
    try:
        from rich.text import Text

        out = console(stderr)
    except OSError:  # no file can be opened, not even that of a module
        print(visible(text), file=sys.stderr if stderr else sys.stdout)
        return
    if out.is_terminal:
        lines = [textwrap.fill(line, out.width, **WHOLE) for line in visible(text).split("\n")]
        text = "\n".join(lines)
    out.print(Text(text), soft_wrap=True)
