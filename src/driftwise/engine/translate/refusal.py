"""What the translator does not understand, it says: file, line, construct, and what to write instead."""


class Refusal(Exception):
    """A construct that cannot be translated; its text names file, line and what stands there."""

    def __init__(self, message: str, file: str = "", line: int = 0):
        where = f"{file}, line {line}: " if file else ""
        super().__init__(f"{where}{message}")


# constructs of Python that kernels do without, in words, and what stands in their place
_DISPLAY = "write a tuple, or into a view that is handed in"
_COMPREHENSION = "write a loop that fills a view"
_FAILURE = "kernels do not fail: test before, and write a status"
_INSTEAD = {
    "List": ("a list", _DISPLAY), "Dict": ("a dict", "write a named tuple"), "Set": ("a set", _DISPLAY),
    "ListComp": ("a list comprehension", _COMPREHENSION), "SetComp": ("a set comprehension", _COMPREHENSION),
    "DictComp": ("a dict comprehension", _COMPREHENSION), "GeneratorExp": ("a generator", _COMPREHENSION),
    "Lambda": ("a lambda", "write a function and mark it with @kernel"),
    "FunctionDef": ("a function inside", "write it outside and mark it with @kernel"),
    "ClassDef": ("a class inside", "write a named tuple outside"),
    "Yield": ("a generator", _COMPREHENSION), "YieldFrom": ("a generator", _COMPREHENSION),
    "Await": ("await", "call the function"), "JoinedStr": ("a text", "kernels know numbers alone"),
    "NamedExpr": ("an assignment inside", "write it on a line before"),
    "Starred": ("a star", "write the items one by one"), "Slice": ("a stretch here", "write a loop"),
    "Try": ("try", _FAILURE), "Raise": ("raise", _FAILURE), "Assert": ("assert", _FAILURE),
    "With": ("with", "kernels open nothing"), "Delete": ("del", "leave it out"), "Match": ("match", "write if"),
    "AnnAssign": ("a type", "leave it out: types are found"), "Import": ("import", "write it outside"),
    "ImportFrom": ("import", "write it outside"), "Global": ("global", "hand the value in and return it"),
    "Nonlocal": ("nonlocal", "hand the value in and return it"),
    "Is": ("is", "compare numbers with =="), "IsNot": ("is not", "compare numbers with !="),
    "In": ("in", "compare with each"), "NotIn": ("not in", "compare with each"),
    "MatMult": ("@ of matrices", "write loops"), "Invert": ("~", "write -x - 1"), "UAdd": ("+x", "write x"),
}  # fmt: skip


def refused(construct: str) -> str:
    """Say that a construct of Python (by its name in `ast`) is none of the kernels', and what to write instead."""
    what, instead = _INSTEAD.get(construct, (construct, "write it with numbers, views and loops"))
    return f"{what} is not in the kernels' part of Python; {instead}"
