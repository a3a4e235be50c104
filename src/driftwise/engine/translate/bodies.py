"""What a kernel is made of: its source before, its statements after; what of them is needed."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable
from typing import Any

from .refusal import Refusal
from .tree import Call, Do, For, Function, If, Let, Loop, Name, Operation, Return, Store, children, statements, walk


def source_of(function: Callable) -> tuple[ast.FunctionDef, str, int]:
    """Return a function's syntax, its file and the line before it."""
    file, line = function.__code__.co_filename, function.__code__.co_firstlineno
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    except (OSError, SyntaxError) as trouble:
        raise Refusal(f"the source of {function.__qualname__} is not to be had ({trouble})", file, line) from None
    found = next((node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)), None)
    if found is None:
        raise Refusal(f"{function.__qualname__} is not a def", file, line)
    return found, file, line - 1


def scope_of(function: Callable) -> dict[str, Any]:
    """Return what names mean in a function, apart from its own variables."""
    known = inspect.getclosurevars(function)
    return {**known.builtins, **function.__globals__, **known.nonlocals}


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
        before = sum(1 for _ in statements(body))
        body = _without(body, read)
        if sum(1 for _ in statements(body)) == before:
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
            if not one.body and isinstance(one, For):
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
        isinstance(one, Store | Return | Loop)
        or (isinstance(one, Do) and one.call.function.has_effects)
        or (isinstance(one, Let) and isinstance(one.value, Call) and one.value.function.has_effects)
        for one in statements(body)
    )
