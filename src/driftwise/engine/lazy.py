"""Names of a package that load their module when first asked for, so that importing the package costs nothing.

Without annotations, as `typing` takes longer to import than all that is loaded here.
"""

import importlib
import sys


def lazily(package, home):
    """Return ``__getattr__`` and ``__dir__`` of a package; ``home`` says in which module of it each name lives."""
    scope = vars(sys.modules[package])

    def load(name):
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        scope[name] = getattr(importlib.import_module(f"{package}.{home[name]}"), name)
        return scope[name]

    return load, lambda: sorted({*scope, *home})
