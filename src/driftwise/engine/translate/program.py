"""All kernels that one loop needs, each translated once for the types it is called with."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

from .. import dispatch
from .reader import Reader
from .refusal import Refusal
from .tree import Function
from .types import Type, widen


class Program:
    """Kernels as typed trees; `function` adds one, and whatever it calls.

    ``is_sized``: sizes are constants, and what is large is no call.
    """

    def __init__(self, is_sized: bool = True) -> None:
        self.apart = dispatch.apart if is_sized else dispatch.apart | dispatch.large
        self.functions: dict[Any, Function] = {}
        self.resolvers = dict(dispatch.resolvers())
        self.names: dict[str, int] = {}
        self.open: list[Any] = []

    def call(self, known: Callable, types: list[Type]) -> Function:
        """Return the kernel that answers ``known`` for arguments of these types."""
        resolve = self.resolvers.get(known)
        if resolve is None:
            name = getattr(known, "__qualname__", repr(known))
            if not isinstance(known, FunctionType) or known.__module__.split(".")[0] in ("numpy", "scipy", "math"):
                raise Refusal(f"{name} is not known to kernels; they call each other, and some of math")
            raise Refusal(f"{name} is not a kernel; mark it with @kernel")
        implementation = resolve(*types)
        if implementation is None:
            kind = getattr(types[0], "instance_class", None)
            raise Refusal(f"a {getattr(kind, '__name__', kind or types[0])} has no {known.__name__}")
        return self.function(implementation, types, known in self.apart or implementation in self.apart)

    def function(self, implementation: Callable, types: list[Type], is_rare: bool = False) -> Function:
        """Return a function for arguments of these types; a known number becomes any number."""
        types = [widen(kind) for kind in types]
        key = implementation, tuple(types)
        if key not in self.functions:
            if key in self.open:
                raise Refusal(f"{implementation.__qualname__} calls itself; write a loop")
            self.open.append(key)
            self.functions[key] = Reader(self, implementation, types, is_rare).read()
            self.open.remove(key)
        return self.functions[key]

    def name(self, title: str) -> str:
        """Return a name that no other function has."""
        count = self.names[title] = self.names.get(title, 0) + 1
        return title if count == 1 else f"{title}_{count}"
