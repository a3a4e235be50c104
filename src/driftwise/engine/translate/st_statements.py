"""Statements of Structured Text, as lines."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

WORD = re.compile(r"[A-Za-z_][A-Za-z_0-9]*\b(?! :=)")  # what is read or written; not a parameter named in a call
WIDTH = 110


@dataclass
class Set:
    """``target := value``; ``variable`` where the target is one, not an element."""

    target: str
    value: str
    variable: str = ""


@dataclass
class Test:
    """IF."""

    test: str
    then: list[Any]
    other: list[Any] = field(default_factory=list)


@dataclass
class Count:
    """FOR; ``last`` is included."""

    variable: str
    first: str
    last: str
    step: int
    body: list[Any]


@dataclass
class Ever:
    """WHILE TRUE."""

    body: list[Any]


@dataclass
class Plain:
    """EXIT, RETURN."""

    text: str


@dataclass
class Comment:
    """What the next statements are about; one without text is where that ends."""

    text: str
    is_over: bool = False


def blocks(one) -> list[list[Any]]:
    """Return the blocks of a statement."""
    return [one.then, one.other] if isinstance(one, Test) else [one.body] if isinstance(one, Count | Ever) else []


def texts(one) -> str:
    """Return what a statement itself reads, as text."""
    if isinstance(one, Set):
        return one.value if one.variable else f"{one.target} {one.value}"
    return one.test if isinstance(one, Test) else f"{one.first} {one.last}" if isinstance(one, Count) else ""


def with_blocks(one, inner: list[list[Any]]) -> Any:
    """Return a statement with other blocks."""
    if isinstance(one, Test):
        return Test(one.test, *inner)
    if isinstance(one, Count):
        return Count(one.variable, one.first, one.last, one.step, inner[0])
    return Ever(inner[0]) if isinstance(one, Ever) else one


def with_texts(one, name: str, new: str) -> Any:
    """Return a statement, and all inside, that reads another variable."""

    def changed(text: str) -> str:
        return WORD.sub(lambda found: new if found[0] == name else found[0], text)

    one = with_blocks(one, [[with_texts(each, name, new) for each in block] for block in blocks(one)])
    if isinstance(one, Set):
        return Set(one.target if one.variable else changed(one.target), changed(one.value), one.variable)
    if isinstance(one, Test):
        return Test(changed(one.test), one.then, one.other)
    if isinstance(one, Count):
        return Count(one.variable, changed(one.first), changed(one.last), one.step, one.body)
    return one


def about_something(block: list[Any]) -> list[Any]:
    """Return a block without comments on nothing, and without their ends."""
    left: list[Any] = []
    for one in block:
        one = with_blocks(one, [about_something(inner) for inner in blocks(one)])
        if isinstance(one, Comment) and not one.text:
            begin = next(
                k for k in range(len(left) - 1, -1, -1) if isinstance(left[k], Comment) and not left[k].is_over
            )
            if begin == len(left) - 1:
                left.pop()
            else:
                left[begin] = Comment(left[begin].text, True)
        else:
            left.append(one)
    return left


def lines(block, indent: str = "") -> Iterator[str]:
    """Yield the lines of a block."""
    for one in block:
        if isinstance(one, Set):
            yield from folded(f"{indent}{one.target} := {one.value};")
        elif isinstance(one, Plain):
            yield f"{indent}{one.text};"
        elif isinstance(one, Comment):
            yield from folded(f"{indent}(* {comment(one.text)} *)")
        elif isinstance(one, Test):
            yield from folded(f"{indent}IF {one.test} THEN")
            yield from lines(one.then, indent + "    ")
            while len(one.other) == 1 and isinstance(one.other[0], Test):
                one = one.other[0]
                yield from folded(f"{indent}ELSIF {one.test} THEN")
                yield from lines(one.then, indent + "    ")
            if one.other:
                yield f"{indent}ELSE"
                yield from lines(one.other, indent + "    ")
            yield f"{indent}END_IF;"
        else:
            is_count = isinstance(one, Count)
            by = f" BY {one.step}" if is_count and one.step != 1 else ""
            yield (
                f"{indent}FOR {one.variable} := {one.first} TO {one.last}{by} DO"
                if is_count
                else f"{indent}WHILE TRUE DO"
            )
            yield from lines(one.body, indent + "    ")
            yield f"{indent}{'END_FOR' if is_count else 'END_WHILE'};"


def folded(line: str) -> list[str]:
    """Return a line, or several of a readable width."""
    indent = line[: len(line) - len(line.lstrip())]
    return textwrap.wrap(line, WIDTH, initial_indent="", subsequent_indent=indent + "        ", drop_whitespace=True,
                         break_long_words=False, break_on_hyphens=False)  # fmt: skip


def comment(text: str) -> str:
    """Return a text as it may stand in a comment."""
    return text.replace("*)", "* )").replace("(*", "( *").encode("ascii", "replace").decode()
