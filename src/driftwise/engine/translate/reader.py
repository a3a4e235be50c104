"""Read one kernel for given types: run it in the mind, with types for values."""

from __future__ import annotations

import ast
from collections.abc import Callable
from typing import Any

from .bodies import has_effects, is_left, negated, prune, scope_of, source_of
from .expressions import SHORT, Expressions
from .refusal import Refusal, refused
from .tree import (
    Call,
    Constant,
    Extent,
    For,
    Function,
    If,
    Leave,
    Let,
    Load,
    Loop,
    Name,
    Operation,
    Return,
    Store,
    children,
    statements,
    walk,
)
from .types import BOOL, INT, LANES, MASK, NOTHING, Known, Several, Struct, Type, View, describe, is_number, unify


class Reader(Expressions):
    """The statements of a kernel; `Expressions` has the rest."""

    def __init__(self, program: Any, function: Callable, types: list[Type], is_rare: bool):
        self.program, self.python, self.types, self.is_rare = program, function, types, is_rare
        self.node, self.file, self.first, self.assigned = source_of(function)
        self.current: Any = self.node
        self.scope = scope_of(function)
        self.is_own = (function.__module__ or "").startswith("driftwise.")
        self.variables: dict[str, Type] = {}
        self.result: Type | None = None
        parameters = self.node.args
        self.parameters = [a.arg for a in parameters.args]
        if parameters.vararg or parameters.kwarg or parameters.kwonlyargs or parameters.defaults:
            self.refuse(self.node, "a kernel's parameters have neither defaults nor stars")
        if len(self.parameters) != len(types):
            self.refuse(
                self.node, f"{function.__qualname__} takes {len(self.parameters)} arguments and is given {len(types)}"
            )

    def read(self) -> Function:
        """Return the kernel as a tree."""
        for _ in range(20):
            self.is_settled, self.count, self.calls = True, 0, []
            self.block: list[Any] = []
            for name, kind in zip(self.parameters, self.types):
                self.take(name, kind)
            ended = self.statements_of(self.node.body)
            if not ended:
                self.leave(Constant(NOTHING, None), self.node)
            if self.is_settled:
                return self.finish()
        raise self.error(self.node, "the types of its variables do not settle")

    def take(self, name: str, kind: Type) -> None:
        """Bind a parameter; one that is assigned anew in the body may become wider."""
        if name in self.assigned:
            known = self.variables.setdefault(name, kind)
            if known != kind:
                wider = unify(known, kind)
                if wider is None:
                    raise self.error(self.node, f"{name} is one thing as an argument and another later")
                self.settle(name, wider)
                self.block.append(Let(name, self.convert(Name(kind, f"{name}_given"), wider)))
        else:
            self.variables[name] = kind

    def finish(self) -> Function:
        """Return what was read, without what nobody needs."""
        result = self.result or NOTHING
        body = self.block
        if isinstance(body[-1], Return) and body[-1].value is None:
            body = body[:-1]
        has = has_effects([s for s in body if not isinstance(s, Return)])
        body = prune(body)
        names = {e.name for s in statements(body) for c in children(s) for e in walk(c) if isinstance(e, Name)}
        names |= {s.name for s in statements(body) if isinstance(s, Let | For)}
        params: list[tuple[str, Type]] = []
        used, given = [], {}
        for i, (name, kind) in enumerate(zip(self.parameters, self.types)):
            inside = name if self.variables.get(name, kind) == kind else f"{name}_given"
            if inside in names and not isinstance(kind, Known):
                params.append((inside, kind))
                used.append(i)
                given[inside] = kind
        variables = {**{n: k for n, k in self.variables.items() if n in names}, **given}
        calls = [e.function for s in statements(body) for c in children(s) for e in walk(c) if isinstance(e, Call)]
        title = (self.python.__doc__ or "").strip().split("\n")[0]
        name = self.program.name(self.python.__name__.lstrip("_"))
        effects = has and has_effects([s for s in body if not isinstance(s, Return)])
        return Function(name, title, params, used, result, body, variables, self.is_rare, effects, calls)

    # --- refusing ------------------------------------------------------------------------------------------

    def error(self, node, message: str) -> Refusal:
        """Return the refusal of a construct."""
        line = self.first + getattr(node, "lineno", self.current.lineno)
        text = ast.unparse(node).split("\n")[0] if isinstance(node, ast.stmt | ast.expr) else ""
        return Refusal(f"{message}: {text}" if text else message, self.file, line)

    def refuse(self, node, message: str) -> None:
        """Say what is not understood."""
        raise self.error(node, message)

    # --- statements ----------------------------------------------------------------------------------------

    def statements_of(self, nodes: list[ast.stmt]) -> bool:
        """Read statements; say whether they never come to their end."""
        for node in nodes:
            self.current = node
            read: Any = getattr(self, f"read_{type(node).__name__}", None)
            if read is None:
                self.refuse(node, refused(type(node).__name__))
            try:
                if read(node):
                    return True
            except Refusal as refusal:
                raise refusal if ", line " in str(refusal) else self.error(node, str(refusal)) from None
            except (AttributeError, IndexError, KeyError, TypeError, ValueError) as trouble:
                raise self.error(node, f"this is not understood ({trouble})") from trouble
        return False

    def inner(self, nodes: list[ast.stmt]) -> tuple[list[Any], bool]:
        """Return the statements of a block inside, and whether it never comes to its end."""
        outer, self.block = self.block, []
        ended = self.statements_of(nodes)
        inner, self.block = self.block, outer
        return inner, ended

    def read_Pass(self, node) -> None:
        """Nothing."""

    def read_Expr(self, node) -> None:
        """A call for what it does, or a comment."""
        if not isinstance(node.value, ast.Constant):
            self.expression(node.value)

    def read_Assign(self, node) -> None:
        """``a = b = value``, with tuples on either side."""
        targets = node.targets
        if len(targets) == 1 and isinstance(targets[0], ast.Tuple) and isinstance(node.value, ast.Tuple):
            return self.assign_side_by_side(targets[0].elts, node.value.elts, node)
        value = self.expression(node.value)
        if len(targets) > 1 and not isinstance(value, Constant | Name):
            value = self.keep(value)
        for target in targets:
            if len(targets) > 1 and isinstance(target, ast.Name):
                self.let(target.id, value, node, is_wanted=True)
            else:
                self.assign(target, value, node)
        return None

    def assign_side_by_side(self, targets, nodes, node) -> None:
        """``a, b = c, d``: values that a target before would spoil are kept."""
        if len(targets) != len(nodes):
            self.refuse(node, "as many values as names")
        values = self.ordered(nodes)
        for i, target in enumerate(targets):
            for j in range(i + 1, len(values)):
                if not isinstance(values[j], Constant) and self.spoils(target, values[j]):
                    values[j] = self.keep(values[j])
        for target, value in zip(targets, values):
            self.assign(target, value, node)

    def spoils(self, target, value) -> bool:
        """Say whether writing the target may change a value not yet taken."""
        if isinstance(target, ast.Name):
            return any(isinstance(e, Name) and e.name == target.id for e in walk(value))
        return any(isinstance(e, Load) for e in walk(value))

    def assign(self, target, value, node) -> None:
        """Write one target."""
        if isinstance(target, ast.Name):
            self.let(target.id, value, node)
        elif isinstance(target, ast.Tuple):
            kind = value.type
            count = len(kind.items) if isinstance(kind, Struct | Several) else len(getattr(value, "value", ()))
            if isinstance(kind, View) and kind.dims > 1:  # its rows; how many there are is known to the writer alone
                count = len(target.elts)
            if count != len(target.elts):
                self.refuse(node, f"{len(target.elts)} names for {count} values")
            if not isinstance(value, Constant):
                value = self.keep(value)
            for i, one in enumerate(target.elts):
                self.assign(one, self.part(value, i), node)
        elif isinstance(target, ast.Subscript) and isinstance(target.slice, ast.Slice):
            self.fill(target, value, node)
        elif isinstance(target, ast.Subscript):
            if not isinstance(value, Constant | Name):
                before = len(self.block)
                view, indices = self.place(target)
                if has_effects(self.block[before:]):
                    late, self.block = self.block[before:], self.block[:before]
                    value = self.keep(value)
                    self.block += late
            else:
                view, indices = self.place(target)
            self.block.append(Store(view, indices, self.convert(value, view.type.element)))
        else:
            self.refuse(node, "a name or an element is written, nothing else")

    def fill(self, target, value, node) -> None:
        """``a[i:j] = number``."""
        value = self.keep(value)
        view = self.expression(target)
        if not is_number(value.type) or not isinstance(view.type, View) or view.type.dims != 1:
            self.refuse(node, "a stretch is filled with one number")
        view, i = self.keep(view), self.fresh(INT)
        body: list[Any] = [Store(view, [i], self.convert(value, view.type.element))]
        self.block.append(For(i.name, Constant(INT, 0), Extent(INT, view, 0), 1, body))

    def let(self, name: str, value, node, is_wanted: bool = False) -> None:
        """Give a variable a value, which may be wanted again; its type grows until it holds all of them."""
        kind = value.type
        known = self.variables.get(name)
        if known is None:
            self.variables[name] = kind
        elif known != kind:
            wider = unify(known, kind)
            if wider is None:
                raise self.error(node, f"{name} is a {describe(known)} and later a {describe(kind)}; take two names")
            self.settle(name, wider)
        kind = self.variables[name]
        if isinstance(kind, Known):
            return
        last = self.block[-1] if self.block else None
        if isinstance(value, Name) and value.name[0] == "_" and not is_wanted:
            if isinstance(last, Let) and last.name == value.name:
                self.block.pop()  # a value that was kept only to be named
                value = last.value
        self.block.append(Let(name, self.convert(value, kind)))

    def settle(self, name: str, kind: Type) -> None:
        """Note that a variable's type grew: what was read with the old one is read again."""
        if self.variables[name] != kind:
            self.variables[name] = kind
            self.is_settled = False

    def read_AugAssign(self, node) -> None:
        """``a += b``."""
        target = ast.Name(node.target.id, ast.Load()) if isinstance(node.target, ast.Name) else node.target
        if isinstance(node.target, ast.Name):
            left, right = self.ordered([target, node.value])
            self.let(node.target.id, self.operate(type(node.op).__name__, left, right, node), node)
            return
        view, indices = self.place(node.target)
        before = len(self.block)
        value = self.expression(node.value)
        old: Any = Load(view.type.element, view, indices)
        if has_effects(self.block[before:]):
            late, self.block = self.block[before:], self.block[:before]
            indices[:] = [self.keep(one) for one in indices]
            old = self.keep(old)
            self.block += late
        new = self.operate(type(node.op).__name__, old, value, node)
        self.block.append(Store(view, indices, self.convert(new, view.type.element)))

    def read_If(self, node) -> bool:
        """``if``: a test that is known leaves one way."""
        test = self.test(node.test)
        if isinstance(test, Constant):
            return self.statements_of(node.body if test.value else node.orelse)
        then, one = self.inner(node.body)
        other, two = self.inner(node.orelse)
        if test.type == MASK and self.is_choice(then) and self.is_choice(other):
            self.choose(test, then, other)
            return False
        self.block.append(If(self.convert(test, BOOL), then, other))
        return one and two

    def is_choice(self, way: list[Any]) -> bool:
        """Say whether a way only gives numbers to variables and places: then lanes need not agree to go it."""
        return len(way) <= SHORT and all(
            s.view.type.element == LANES if isinstance(s, Store) else isinstance(s, Let) and self.is_pure(s)
            for s in way
        )

    def is_pure(self, one: Let) -> bool:
        """Say whether a variable of lanes, or one of this way alone, gets a value and nothing else happens."""
        if isinstance(one.value, Call) and (one.value.function.has_effects or one.value.function.is_rare):
            return False
        return one.name[0] == "_" or self.variables[one.name] in (LANES, MASK)

    def choose(self, test, then: list[Any], other: list[Any]) -> None:
        """Write both ways, each lane keeping what the one it takes has given it."""
        test = self.keep(test)
        for way, wanted in ((then, test), (other, negated(test))):
            wanted = self.keep(wanted) if way else wanted
            for one in way:
                if isinstance(one, Store):
                    old: Any = Load(LANES, one.view, one.indices)
                    self.block.append(
                        Store(one.view, one.indices, Operation(LANES, "select", [wanted, one.value, old]))
                    )
                elif one.name[0] == "_":
                    self.block.append(one)
                else:
                    old = Name(self.variables[one.name], one.name)
                    self.block.append(Let(one.name, Operation(old.type, "select", [wanted, one.value, old])))

    def read_While(self, node) -> bool:
        """``while``."""
        if node.orelse:
            self.refuse(node, "while has no else here")
        outer, self.block = self.block, []
        test = self.test(node.test)
        is_endless = isinstance(test, Constant) and bool(test.value)
        test = self.convert(test, BOOL)
        if not is_endless:
            self.block.append(If(Operation(BOOL, "not", [test]), [Leave("break")], []))
        self.statements_of(node.body)
        inner, self.block = self.block, outer
        self.block.append(Loop(inner))
        return is_endless and not is_left(node.body, (ast.Break,))

    def read_For(self, node) -> bool:
        """``for i in range(..)``, or over the items of a tuple, one after the other."""
        if node.orelse or not isinstance(node.target, ast.Name):
            self.refuse(node, "for has one name and no else here")
        call = node.iter
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id in ("range", "abreast"):
            self.count_through(node, call.args, call.func.id == "abreast")
            return False
        if isinstance(call, ast.IfExp):
            ways = [ast.For(node.target, way, node.body, [], lineno=node.lineno) for way in (call.body, call.orelse)]
            return self.read_If(ast.If(call.test, [ways[0]], [ways[1]], lineno=node.lineno))
        if is_left(node.body):
            self.refuse(node, "a loop over a tuple is not left early")
        values = self.expression(call)
        items = getattr(values.type, "items", None)
        if items is None and isinstance(values, Constant) and isinstance(values.value, tuple):
            items = values.value
        if items is None:
            raise self.error(node, "a loop counts through a range or takes the items of a tuple")
        if not isinstance(values, Constant):
            values = self.keep(values)
        for i in range(len(items)):
            self.let(node.target.id, self.part(values, i), node)
            self.statements_of(node.body)
        return False

    def count_through(self, node, args, is_abreast: bool) -> None:
        """``for i in range(start, stop, step)``, or ``abreast(stop)``."""
        values = [self.number(v, INT, node) for v in self.ordered(args)]
        start, stop = (values[0], values[1]) if len(values) > 1 else (Constant(INT, 0), values[0])
        step = self.expression(args[2]) if len(args) > 2 else Constant(INT, 1)
        if not isinstance(step, Constant) or not step.value:
            self.refuse(node, "the step of a range is a number that is known")
        name = node.target.id
        known = self.variables.setdefault(name, INT)
        if known != INT:
            wider = unify(known, INT)
            if wider is None or wider != INT:
                self.refuse(node, f"{name} counts, and is something else elsewhere")
            self.settle(name, INT)
        body, _ = self.inner(node.body)
        self.block.append(For(name, start, stop, int(step.value), body, is_abreast))

    def read_Return(self, node) -> bool:
        """``return``."""
        value = self.expression(node.value) if node.value else Constant(NOTHING, None)
        self.leave(value, node)
        return True

    def leave(self, value, node) -> None:
        """Return a value; the type of the result grows until it holds all."""
        if self.result is None:
            self.result = value.type
        elif self.result != value.type:
            wider = unify(self.result, value.type)
            if wider is None:
                raise self.error(node, f"it returns a {describe(self.result)} and a {describe(value.type)}")
            if wider != self.result:
                self.result, self.is_settled = wider, False
        self.block.append(Return(None if isinstance(self.result, Known) else self.convert(value, self.result)))

    def read_Break(self, node) -> bool:
        """``break``."""
        self.block.append(Leave("break"))
        return True

    def read_Continue(self, node) -> bool:
        """``continue``."""
        self.block.append(Leave("continue"))
        return True
