"""Pages that no table of contents names are how-to guides: they need no more than to be written."""

import re
from pathlib import Path

TOCTREE = re.compile(r"^(?:```|:::)\{toctree\}\n(.*?)^(?:```|:::)$", re.S | re.M)


def entries(page: Path) -> list[str]:
    """Return the pages that the tables of contents of a page name, patterns resolved, relative to ``docs``."""
    found = []
    for block in TOCTREE.findall(page.read_text()):
        for line in (line.strip() for line in block.splitlines()):
            if not line or line.startswith((":", "%")):
                continue
            name = re.sub(r".*<(.*)>$", r"\1", line)
            matches = sorted(page.parent.glob(f"{name}.md")) if "*" in name else [page.parent / f"{name}.md"]
            found += [match.with_suffix("") for match in matches if match != page]
    docs = page.parent if page.parent.name == "docs" else page.parent.parent
    return [str(path.relative_to(docs)) for path in found]


def named(docs: Path) -> list[str]:
    """Return every page that a table of contents names, as often as it does."""
    return [name for page in sorted(docs.rglob("*.md")) for name in entries(page)]


def left(docs: Path) -> list[str]:
    """Return the pages of the folder that no table of contents names."""
    known = {*named(docs), "index"}
    return [page.stem for page in sorted(docs.glob("*.md")) if page.stem not in known]


def take_in(app, name, source):
    """Put the pages that are left where how-to guides end."""
    if name == "howto":
        source[0] = source[0].replace("% the rest", "\n".join(left(Path(app.srcdir))))


def setup(app):
    """Watch pages as they are read."""
    app.connect("source-read", take_in)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
