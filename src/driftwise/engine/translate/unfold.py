"""Run a tree in the mind with what is known: calls unfold, views become places in arrays, sizes and settings constants.

What is left are statements over numbers and arrays alone (`st_statements`), for languages that know no views, structs
or early ends: Structured Text.
"""

from __future__ import annotations

from typing import Any

from .frame import Frame
from .st_statements import Comment, Count, Ever, Plain, Set, Test
from .st_tidy import words, writes
from .st_values import ATOM, Array, Number, Region, Table, add, known
from .tree import Call, Do, For, Function, If, Leave, Let, Loop, Name, Return, blocks, children, statements, walk
from .types import BOOL, FLOAT, INT, Scalar, is_number
from .unfold_values import Values

SHORT = 3  # a kernel of numbers with more statements than these becomes a function
FALLS, DONE, LEFT, MAYBE = "falls", "done", "left", "maybe"  # to its end; returned; jumped; perhaps returned


class Unfold(Values):
    """The body of one unit: variables, arrays and statements; ``names`` makes names that its language allows."""

    def __init__(self, names, functions: dict[str, Any], is_function: bool = False):
        self.names, self.functions, self.is_function = names, functions, is_function
        self.block: list[Any] = []
        self.kinds: dict[str, Scalar] = {}  # of the variables
        self.busy: set[str] = set()
        self.temporary: list[str] = []
        self.regions: list[Region] = []
        self.gives = FLOAT  # a function

    # --- variables -----------------------------------------------------------------------------------------

    def variable(self, title: str, kind: Scalar) -> str:
        """Return a variable of this kind that nothing else uses at present."""
        count = 1
        while True:
            name = self.names.local(title, count)
            if (
                name not in self.busy
                and self.kinds.get(name, kind) == kind
                and not self.names.is_taken(name, self.kinds)
            ):
                self.kinds[name] = kind
                self.busy.add(name)
                return name
            count += 1

    def spare(self, kind: Scalar, title: str = "") -> Number:
        """Return a variable for the rest of the statement."""
        name = self.variable(title or {FLOAT: "x", INT: "m", BOOL: "is_so"}[kind], kind)
        self.temporary.append(name)
        return Number(kind, name)

    def storage(self, frame: Frame, key: str, kind: Scalar) -> Number:
        """Return the variable of a frame's variable."""
        if key not in frame.stored:
            frame.stored[key] = self.variable(key, kind)
        return Number(kind, frame.stored[key])

    def set(self, variable: Number, value: Number) -> None:
        """Give a variable a value."""
        self.block.append(Set(variable.text, value.within(), variable.text))

    def bind(self, frame: Frame, name: str, value: Any, pin: bool = False) -> Any:
        """Return a value as that of a variable: what is not known of it is stored."""
        if isinstance(value, Number):
            if value.is_known and not pin:
                return value
            found = self.storage(frame, name, value.kind)
            if value.text != found.text or value.value:
                self.set(found, value)
            return found
        if isinstance(value, Table):
            base = known(value.array.start if value.array else 0)
            parts = {
                "at": add(value.at, base, -1),
                "step": value.step,
                **{f"n{i}": n for i, n in enumerate(value.sizes)},
            }
            new: dict[str, Any] = {
                k: n if n is None else self.bind(frame, f"{name}_{k}", n, pin) for k, n in parts.items()
            }
            sizes = tuple(new[f"n{i}"] for i in range(len(value.sizes)))
            return Table(value.region, add(new["at"], base), sizes, new["step"], value.array)
        if isinstance(value, tuple):
            titles = [f"{name}_{i + 1}" for i in range(len(value))]
            own = [frame.stored.get(title, "") for title in titles]
            if any(set(own[:i]) & words(part.text) for i, part in enumerate(value) if isinstance(part, Number)):
                value = tuple(self.kept(p) if isinstance(p, Number) and p.text != o else p for p, o in zip(value, own))
            return tuple(self.bind(frame, t, part, pin) for t, part in zip(titles, value))
        return value

    def kept(self, value: Number) -> Number:
        """Return a value in a variable of its own for the rest of the statement."""
        if value.is_known:
            return value
        found = self.spare(value.kind)
        self.set(found, value)
        return found

    def joined(self, frame: Frame, name: str, one, two, first: list[Any], second: list[Any]) -> Any:
        """Return what a variable is after two ways; ``first`` and ``second`` are their blocks."""
        if one is None or two is None or one == two:
            return two if one is None else one
        found = []
        for value, block in ((one, first), (two, second)):
            outer, self.block = self.block, block
            if isinstance(value, Table):
                value = Table(value.region, value.at, value.sizes, value.step, value.array)
                if one.region is not two.region or one.array is not two.array:
                    self.refuse(f"{name} is a view of one array or of another")
            found.append(self.bind(frame, name, value, pin=True))
            self.block = outer
        return found[0]

    # --- statements ----------------------------------------------------------------------------------------

    def inner(self, frame: Frame, body: list[Any]) -> tuple[list[Any], dict[str, Any], str]:
        """Return the block of some statements, what variables are after it, and how it ends."""
        outer, values = self.block, frame.values
        self.block, frame.values = [], dict(values)
        ending = self.run(frame, body)
        found = self.block, frame.values, ending
        self.block, frame.values = outer, values
        return found

    def run(self, frame: Frame, body: list[Any]) -> str:
        """Unfold statements; say how they end."""
        for k, one in enumerate(body):
            mark, rest = len(self.temporary), body[k + 1 :]
            ending, is_all = getattr(self, f"run_{type(one).__name__}")(frame, one, rest)
            self.busy.difference_update(self.temporary[mark:])
            del self.temporary[mark:]
            if is_all or ending in (DONE, LEFT):
                return ending
            if ending == MAYBE and frame.loops:
                self.block.append(Test(self.storage(frame, "done", BOOL).text, [Plain("EXIT")]))
            elif ending == MAYBE and rest:
                block, values, _ = self.inner(frame, rest)
                self.block.append(Test(f"NOT {self.storage(frame, 'done', BOOL).text}", block))
                frame.values = values
                return MAYBE
            elif ending == MAYBE:
                return MAYBE
        return FALLS

    def run_Let(self, frame: Frame, one: Let, rest) -> tuple[str, bool]:
        """A variable gets a value."""
        pin = one.name in frame.pinned
        if isinstance(one.value, Call):
            value = self.call(one.value, frame, one.name)
        else:
            kind = frame.function.variables.get(one.name)
            value = self.value(frame, one.value, (frame, one.name) if isinstance(kind, Scalar) else None)
        frame.values[one.name] = self.bind(frame, one.name, value, pin)
        return FALLS, False

    def run_Do(self, frame: Frame, one: Do, rest) -> tuple[str, bool]:
        """A call."""
        self.call(one.call, frame, "given")
        return FALLS, False

    def run_Store(self, frame: Frame, one, rest) -> tuple[str, bool]:
        """A number is written."""
        target = self.element(frame, one.view, one.indices)
        if target.is_known:
            self.refuse("a setting is written")
        self.block.append(Set(target.text, self.value(frame, one.value).within()))
        return FALLS, False

    def run_If(self, frame: Frame, one: If, rest) -> tuple[str, bool]:
        """One of two ways; where one has returned, what follows belongs to the other."""
        test = self.value(frame, one.test)
        if test.is_known:
            ending = self.run(frame, one.then if test.value else one.other)
            return ending, False
        ways = [self.inner(frame, body) for body in (one.then, one.other)]
        endings, is_all = [way[2] for way in ways], False
        for here, there in ((0, 1), (1, 0)):
            if endings[there] == DONE and endings[here] == FALLS and rest:
                outer, values = self.block, frame.values
                self.block, frame.values = ways[here][0], ways[here][1]
                endings[here], is_all = self.run(frame, rest), True
                ways[here] = self.block, frame.values, endings[here]
                self.block, frame.values = outer, values
                break
        (first, a, _), (second, b, _) = ways
        over = [ending in (DONE, LEFT) for ending in endings]
        if over[0] or over[1]:
            frame.values = b if over[0] else a
        else:
            merged = {n: self.joined(frame, n, a.get(n), b.get(n), first, second) for n in {**a, **b}}
            frame.values = merged
        self.block.append(Test(test.within(), first, second))
        if over[0] and over[1]:
            return (LEFT if endings == [LEFT, LEFT] else DONE), is_all
        if MAYBE in endings or DONE in endings:
            return MAYBE, is_all
        return FALLS, is_all

    def run_For(self, frame: Frame, one: For, rest) -> tuple[str, bool]:
        """A count; of one turn it is no loop."""
        start, stop = self.value(frame, one.start), self.value(frame, one.stop)
        has_exit = any(isinstance(s, Leave) for s in statements(one.body))
        if start.is_known and stop.is_known:
            turns = len(range(start.value, stop.value, one.step))
            if turns == 0:
                return FALLS, False
            if (
                turns == 1
                and not has_exit
                and one.name not in {s.name for s in statements(one.body) if isinstance(s, Let | For)}
            ):
                frame.values[one.name] = start
                return self.run(frame, one.body), False
        is_free = self.only_counts(frame, one)
        counter = self.storage(frame, one.name, INT) if is_free else self.spare(INT, f"{one.name}_count")
        last = Number(INT, stop.text, stop.value + (1 if one.step < 0 else -1), stop.binds)
        if abs(one.step) != 1:
            self.refuse("a range with a step")
        body = self.loop(frame, one, counter, is_free)
        if words(last.text) & writes(body):
            last = self.bind(frame, f"last_{one.name}", last)
        self.block.append(Count(counter.text, start.within(), last.within(), one.step, body))
        return (MAYBE if frame.returns_inside else FALLS), False

    def run_Loop(self, frame: Frame, one: Loop, rest) -> tuple[str, bool]:
        """For ever."""
        body = self.loop(frame, one)
        self.block.append(Ever(body))
        return (MAYBE if frame.returns_inside else FALLS), False

    def loop(self, frame: Frame, one: For | Loop, counter: Number | None = None, is_free: bool = True) -> list[Any]:
        """Return the block of a loop: what changes in it is stored, not known."""
        changed = {s.name for s in statements(one.body) if isinstance(s, Let | For)}
        pinned = {n for n in changed if n in frame.values or frame.lets[n] > 1}
        for name in sorted(pinned & set(frame.values)):
            frame.values[name] = self.bind(frame, name, frame.values[name], pin=True)
        before, frame.pinned = frame.pinned, frame.pinned | pinned
        outer, self.block = self.block, []
        values = frame.values = dict(frame.values)
        if isinstance(one, For) and counter is not None:
            values[one.name] = counter if is_free else self.bind(frame, one.name, counter, pin=True)
        frame.loops, was, frame.returns_inside = frame.loops + 1, frame.returns_inside, False
        self.run(frame, one.body)
        frame.loops, frame.returns_inside = frame.loops - 1, was or frame.returns_inside
        body, self.block, frame.pinned = self.block, outer, before
        return body

    def only_counts(self, frame: Frame, loop: For) -> bool:
        """Say whether nobody changes the count, or reads it behind its loop."""

        def look(body) -> bool:
            for one in body:
                names = {e.name for c in children(one) for e in walk(c) if isinstance(e, Name)}
                if isinstance(one, For) and one.name == loop.name:
                    if one.name in names or any(
                        isinstance(s, Let | For) and s.name == one.name for s in statements(one.body)
                    ):
                        return False
                elif loop.name in names or (isinstance(one, Let) and one.name == loop.name):
                    return False
                elif not all(look(block) for block in blocks(one)):
                    return False
            return True

        return look(frame.function.body)

    def run_Leave(self, frame: Frame, one: Leave, rest) -> tuple[str, bool]:
        """``break``."""
        if one.word != "break":
            self.refuse("continue")
        self.block.append(Plain("EXIT"))
        return LEFT, False

    def run_Return(self, frame: Frame, one: Return, rest) -> tuple[str, bool]:
        """The end of a kernel, perhaps with a value."""
        into = frame.into if frame.is_straight and isinstance(frame.function.result, Scalar) else None
        value: Any = None if one.value is None else self.value(frame, one.value, into)
        if frame.into is None and self.is_function:
            self.block.append(Set(self.names.unit, value.within(), self.names.unit))
            self.block.append(Plain("RETURN"))
            return LEFT, False
        if frame.is_straight or value is None:
            frame.results.append(value)
        else:
            assert frame.into is not None
            frame.results.append((value, self.bind(*frame.into, value, pin=True)))
        if frame.is_straight:
            return DONE, False
        self.set(self.storage(frame, "done", BOOL), known(True))
        if frame.loops:
            frame.returns_inside = True
            self.block.append(Plain("EXIT"))
            return LEFT, False
        return DONE, False

    # --- calls ---------------------------------------------------------------------------------------------

    def call(self, call: Call, frame: Frame, name: str) -> Any:
        """Return what a call gives: a function of numbers is called, everything else unfolds here."""
        function = call.function
        given = [self.value(frame, argument) for argument in call.args]
        if self.is_apart(function) and not all(isinstance(g, Number) and g.is_known for g in given):
            return self.called(function, given)
        inside = Frame(function, (frame, name))
        begin, busy = len(self.block), set(self.busy)
        assigned = set(inside.lets) | {s.name for s in statements(function.body) if isinstance(s, For)}
        for (parameter, _), value in zip(function.params, given):
            is_alias = parameter not in assigned and (not isinstance(value, Number) or value.is_plain)
            if is_alias and isinstance(value, tuple | Table):
                inside.values[parameter] = value if self.is_settled(value) else self.bind(inside, parameter, value)
            else:
                inside.values[parameter] = value if is_alias else self.bind(inside, parameter, value)
        if not inside.is_straight:
            self.set(self.storage(inside, "done", BOOL), known(False))
            busy.add(inside.stored["done"])  # of this call alone
        self.run(inside, function.body)
        value = self.result(inside)
        value = self.bind(frame, name, value)
        if function.title and len(self.block) > begin + 1:
            self.block.insert(begin, Comment(function.title.removeprefix("Return ")))
            self.block.append(Comment(""))
        self.busy = busy | set(frame.stored.values()) | set(self.temporary)
        return value

    def result(self, frame: Frame) -> Any:
        """Return what a kernel returned: what is the same at all its ends stays known."""
        if not frame.results or frame.results[0] is None:
            return None
        if frame.is_straight:
            return frame.results[0]

        def common(values, stored):
            if isinstance(stored, tuple):
                return tuple(common([v[i] for v in values], s) for i, s in enumerate(stored))
            is_one = isinstance(stored, Number) and all(v.is_known and repr(v) == repr(values[0]) for v in values)
            return values[0] if is_one else stored

        return common([value for value, _ in frame.results], frame.results[-1][1])

    def is_settled(self, value) -> bool:
        """Say whether a tuple or a view is made of constants and variables."""
        if isinstance(value, tuple):
            return all(map(self.is_settled, value))
        if isinstance(value, Table):
            return all(n is None or n.is_known or n.text.isidentifier() for n in (value.at, value.step, *value.sizes))
        return not isinstance(value, Number) or value.is_plain

    def is_apart(self, function: Function) -> bool:
        """Say whether a kernel is made a function: of numbers, to a number, and not short."""
        is_plain = all(is_number(kind) for _, kind in function.params) and isinstance(function.result, Scalar)
        return is_plain and bool(function.params) and len(statements(function.body)) > SHORT

    def called(self, function: Function, given: list[Number]) -> Number:
        """Return the call of a function, which is unfolded once."""
        if function.name not in self.functions:
            unit = Unfold(self.names.unit_of(function.name), self.functions, is_function=True)
            assert isinstance(function.result, Scalar)
            unit.gives = function.result
            frame = Frame(function)
            for name, kind in function.params:
                frame.values[name] = unit.storage(frame, name, kind)  # type: ignore[arg-type]  # numbers: `is_apart`
            inputs = list(frame.stored.values())
            unit.run(frame, function.body)
            self.functions[function.name] = unit, inputs, function
        unit, inputs, _ = self.functions[function.name]
        arguments = ", ".join(f"{name} := {value.within()}" for name, value in zip(inputs, given))
        return Number(unit.gives, f"{unit.names.unit}({arguments})", 0, ATOM, False)

    # --- memory --------------------------------------------------------------------------------------------

    def region(self, name: str, size: int, values=None) -> Region:
        """Add memory that kernels are given."""
        found = Region(name, size, values)
        self.regions.append(found)
        return found

    def array(self, region: Region, title: str, start: int, size: int, labels: list[str] | None = None) -> Array:
        """Name a stretch of memory."""
        names = [self.names.array(label) for label in labels or ()]
        found = Array("" if labels else self.names.array(title), start, size, names or None)
        region.arrays.append(found)
        return found
