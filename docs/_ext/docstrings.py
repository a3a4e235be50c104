"""Docstrings as they read on a terminal, for the site: an indented formula stays as it was typed, a bar is a bar."""

import re

HEAD = re.compile(r"^[A-Z][A-Za-z ]+$")
PROSE = {"Notes", "References", ""}


def as_typed(lines: list[str]) -> list[str]:
    """Return the lines of a docstring with indented blocks of prose marked as literal, and bars escaped elsewhere."""
    found: list[str] = []
    section, is_literal = "", False
    for at, line in enumerate(lines):
        below = lines[at + 1] if at + 1 < len(lines) else ""
        if HEAD.match(line) and below and set(below) == {"-"}:
            section = line
        is_inner = line.startswith("    ") and section in PROSE
        if is_inner and not is_literal and (not found or not found[-1].strip()):
            before = next((text for text in reversed(found) if text.strip()), "")
            if not before.rstrip().endswith("::") and not re.match(r"\s|\.\. |[-*] |\d+\. ", before):
                found += ["::", ""]
                is_literal = True
        elif line.strip() and not line.startswith("    "):
            is_literal = False
        found.append(line if is_literal or ">>>" in line else bars(line))
    return found


def bars(line: str) -> str:
    """Return a line whose bars are no substitutions, but within double backticks."""
    parts = re.split(r"(``.*?``)", line)
    return "".join(part if part.startswith("``") else part.replace("|", r"\|") for part in parts)


def setup(app):
    """Before numpydoc reads them."""
    app.connect("autodoc-process-docstring", lambda *args: args[-1].__setitem__(slice(None), as_typed(args[-1])), 100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
