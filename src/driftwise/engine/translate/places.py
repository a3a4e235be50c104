"""Where the variables of a function are declared: where they first get a value, if all that use them stand behind."""

from __future__ import annotations

from typing import Any

from .tree import For, Function, Let, Load, Name, blocks, children, statements, walk


class Places:
    """Declarations of one function.

    Attributes
    ----------
    here : statements (by identity) that declare their variable
    top : variables that are declared at the top
    apart : loops whose variable lives on, with the name of their own counter
    kept_stop : loops whose end is worked out once, with its name
    """

    def __init__(self, function: Function):
        self.own: dict[int, set[str]] = {}  # the variables of each statement
        self.all: dict[int, set[str]] = {}  # with those of statements inside
        self.note(function.body)
        self.here: set[int] = set()
        self.top: list[str] = []
        self.apart: dict[int, str] = {}
        self.kept_stop: dict[int, str] = {}
        params = {name for name, _ in function.params}
        names = {name: None for one in statements(function.body) for name in sorted(self.own[id(one)])}
        counters = {one.name for one in statements(function.body) if isinstance(one, For)}
        free = {name for name in counters if self.only_counts(function.body, name)}
        for name in names:
            if name in params or name in free:
                continue
            place = self.first(function.body, name)
            if place is not None:
                self.here.add(id(place))
            else:
                self.top.append(name)
        for one in statements(function.body):
            if isinstance(one, For):
                if one.name not in free:
                    self.apart[id(one)] = f"{one.name}_count_"
                changed = {s.name for s in [one, *statements(one.body)] if isinstance(s, Let | For)}
                if not _stands_still(one.stop, changed):
                    self.kept_stop[id(one)] = f"end_{len(self.kept_stop) + 1}_"

    def note(self, body: list[Any]) -> set[str]:
        """Note the variables of statements; return them all."""
        found: set[str] = set()
        for one in body:
            own = {e.name for c in children(one) for e in walk(c) if isinstance(e, Name)}
            if isinstance(one, Let | For):
                own.add(one.name)
            self.own[id(one)] = own
            self.all[id(one)] = own.union(*(self.note(block) for block in blocks(one)))
            found |= self.all[id(one)]
        return found

    def only_counts(self, body: list[Any], name: str) -> bool:
        """Say whether a variable is only met inside loops that count it, and is not changed there."""
        for one in body:
            if name not in self.all[id(one)]:
                continue
            if isinstance(one, For) and one.name == name:
                outside = {e.name for c in children(one) for e in walk(c) if isinstance(e, Name)}
                if name in outside or any(isinstance(s, Let | For) and s.name == name for s in statements(one.body)):
                    return False
                continue
            if name in self.own[id(one)] or not all(self.only_counts(block, name) for block in blocks(one)):
                return False
        return True

    def first(self, body: list[Any], name: str) -> Let | None:
        """Return the statement that can declare a variable, or None: then it is declared at the top."""
        having = [one for one in body if name in self.all[id(one)]]
        first = having[0]
        if isinstance(first, Let) and first.name == name:
            value = {e.name for e in walk(first.value) if isinstance(e, Name)}
            return None if name in value else first
        if len(having) > 1 or name in self.own[id(first)]:
            return None
        inside = [block for block in blocks(first) if any(name in self.all[id(one)] for one in block)]
        return self.first(inside[0], name) if len(inside) == 1 else None


def _stands_still(value, changed: set[str]) -> bool:
    """Say whether the end of a loop stays what it is while the loop runs."""
    for one in walk(value):
        if isinstance(one, Load) or (isinstance(one, Name) and one.name in changed):
            return False
    return True
