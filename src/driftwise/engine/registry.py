"""What is public by name: policies of the package and those of users, so that files and commands find them."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from .errors import InputError


class Registry(dict[str, Any]):
    """Entries of public types by the names of their classes; ``package.__all__`` lists those of driftwise."""

    def __init__(self, package: str, what: str):
        self.package, self.what = package, what

    def add(self, entry: Any) -> None:
        """Write an entry down, whose ``kind`` is the type; two types of one name are refused."""
        kind, known = entry.kind, self.get(entry.kind.__name__)
        if known and (known.kind.__module__, known.kind.__qualname__) != (kind.__module__, kind.__qualname__):
            raise InputError(
                f"there is a {self.what} {kind.__name__} already, in {known.kind.__module__}: take another name"
            )
        self[kind.__name__] = entry

    def public(self) -> dict[str, Any]:
        """Return all entries: driftwise's own, loaded now and in the order of the package, then those of users."""
        package = import_module(self.package)
        for name in package.__all__:  # loads the file of each
            getattr(package, name)
        return {name: self[name] for name in package.__all__ if name in self} | self
