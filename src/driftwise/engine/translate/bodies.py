"""What a kernel is made of: its source before, its statements after; what of them is needed."""

from __future__ import annotations

import ast
import builtins
import functools
import inspect
import linecache
import textwrap
from collections import ChainMap
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NamedTuple

from .refusal import Refusal
from .tree import (
    Call,
    Differ,
    Do,
    For,
    Function,
    If,
    Let,
    Loop,
    Move,
    Name,
    Operation,
    Return,
    Store,
    children,
    statements,
    walk,
)


class Source(NamedTuple):
    """A function as it is written."""

    node: ast.FunctionDef
    file: str
    before: int  # the line before its text
    assigned: frozenset[str]  # the names that it gives values


def source_of(function: Callable) -> Source:
    """Return a function's syntax, and where it stands."""
    return _source(function.__code__.co_filename, function.__code__)


@functools.lru_cache(maxsize=4096)
def _source(file: str, code) -> Source:  # by its file, too: codes are equal where only files differ
    line = code.co_firstlineno
    try:
        found, before = _definitions("".join(linecache.getlines(file))).get(line), 0
    except SyntaxError:  # a cell of a notebook, with what is not Python
        found = None
    if found is None or found.name != code.co_name:
        found, before = _alone(code, file, line), line - 1
    names = (one for one in ast.walk(found) if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store))
    return Source(found, file, before, frozenset(one.id for one in names))


@functools.lru_cache(maxsize=256)
def _definitions(text: str) -> dict[int, ast.FunctionDef]:
    """Return all functions of a file by their first lines, decorators included."""
    found = {}
    for node in ast.walk(parsed(text)):
        if isinstance(node, ast.FunctionDef):
            found[min([node.lineno, *(one.lineno for one in node.decorator_list)])] = node
    return found


def parsed(text: str) -> ast.Module:
    """Return the syntax of a text; up to Python 3.12 another thread that parses, too, may cost a try or two."""
    for _ in range(9):
        with suppress(SystemError):  # "AST constructor recursion depth mismatch": its count is of all threads
            return ast.parse(text)
    return ast.parse(text)


def _alone(code, file: str, line: int) -> ast.FunctionDef:
    """Return the syntax of a function whose file cannot be read as a whole."""
    try:
        tree = parsed(textwrap.dedent(inspect.getsource(code)))
    except (OSError, SyntaxError) as trouble:
        raise Refusal(f"the source of {code.co_qualname} is not to be had ({trouble})", file, line) from None
    found = next((node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)), None)
    if found is None:
        raise Refusal(f"{code.co_qualname} is a lambda: a kernel is written with def", file, line)
    return found


def scope_of(function: Callable) -> dict[str, Any]:
    """Return what names mean in a function, apart from its own variables."""
    code, scope = function.__code__, ChainMap(function.__globals__, vars(builtins))
    known = {name: scope[name] for name in code.co_names if name in scope}
    for name, cell in zip(code.co_freevars, function.__closure__ or ()):
        try:
            known[name] = cell.cell_contents
        except ValueError:
            continue  # it has no value yet
    return known


def is_left(nodes: list[ast.stmt], words: tuple[type, ...] = (ast.Break, ast.Continue)) -> bool:
    """Say whether the loop with this body is left by one of these words: those of loops inside leave only them."""
    for node in nodes:
        if isinstance(node, words):
            return True
        if isinstance(node, ast.If) and (is_left(node.body, words) or is_left(node.orelse, words)):
            return True
    return False


def reachable(entry: Function) -> list[Function]:
    """Return a function and all it calls, those called first."""
    order: dict[str, Function] = {}

    def visit(function: Function) -> None:
        if function.name not in order:
            for callee in function.calls:
                visit(callee)
            order[function.name] = function

    visit(entry)
    return list(order.values())


def prune(body: list[Any]) -> list[Any]:
    """Return a body without variables that nobody reads; calls stay for what they do."""
    while True:
        read = {e.name for s in statements(body) for c in children(s) for e in walk(c) if isinstance(e, Name)}
        before = len(statements(body))
        body = _without(body, read)
        if len(statements(body)) == before:
            return body


def _without(body: list[Any], read: set[str]) -> list[Any]:
    kept: list[Any] = []
    for one in body:
        if isinstance(one, Let) and one.name not in read:
            if isinstance(one.value, Call) and one.value.function.has_effects:
                kept.append(Do(one.value))
            continue
        if isinstance(one, If):
            one.then, one.other = _without(one.then, read), _without(one.other, read)
            if not one.then and not one.other:
                continue
            if not one.then:
                one.test, one.then, one.other = negated(one.test), one.other, []
        elif isinstance(one, For | Loop):
            one.body = _without(one.body, read)
            if not one.body and isinstance(one, For) and one.name not in read:
                continue
        kept.append(one)
    return kept


def negated(test):
    """Return the opposite of a test."""
    if isinstance(test, Operation) and test.op == "not":
        return test.args[0]
    return Operation(test.type, "not", [test])


def has_effects(body: list[Any]) -> bool:
    """Say whether statements change anything but variables of their own."""
    return any(
        isinstance(one, Store | Return | Loop | Differ | Move)
        or (isinstance(one, Do) and one.call.function.has_effects)
        or (isinstance(one, Let) and isinstance(one.value, Call) and one.value.function.has_effects)
        for one in statements(body)
    )
