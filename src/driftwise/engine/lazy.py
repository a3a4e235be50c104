"""Names of a package that load their module when first asked for, so that importing the package costs nothing.

Without annotations, as `typing` takes longer to import than all that is loaded here.
"""

import importlib
import sys


def lazily(package, home, rooms=()):
    """Return ``__getattr__`` and ``__dir__`` of a package; ``home`` says in which module each name lives.

    A module is that of the package, or with a dot before it of driftwise; ``rooms`` are packages that load by name.
    """
    scope = vars(sys.modules[package])

    def load(name):
        if name in rooms:
            return importlib.import_module(f"{package}.{name}")
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        root = package.partition(".")[0] if home[name].startswith(".") else f"{package}."
        scope[name] = getattr(importlib.import_module(root + home[name]), name)
        return scope[name]

    return load, lambda: sorted({*scope, *home, *rooms})
