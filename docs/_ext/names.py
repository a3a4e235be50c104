"""Public names in running text, `dw.ARX(2, 2)` or `AutoMemory()`, lead to their pages."""

import re

from docutils import nodes
from sphinx import addnodes
from sphinx.transforms import SphinxTransform

from scripts import reference

DOTTED = re.compile(r"^(?:dw|driftwise)\.([\w.]+)(?:\(.*\))?$", re.S)
CAPITAL = re.compile(r"^([A-Z]\w+)(?:\(.*\))?$", re.S)
PATHS = {path: each.path for room in reference.names().values() for each in room for path in each.places}
SHORT = {path.rpartition(".")[2]: path for path in PATHS.values()}


def path_of(text: str, page: str) -> str | None:
    """Return the name that a piece of code is about, if it has a page of its own, and that is not this one."""
    dotted, capital = DOTTED.match(text), CAPITAL.match(text)
    path = PATHS.get(f"driftwise.{dotted[1]}") if dotted else SHORT.get(capital[1]) if capital else None
    return None if path is None or page.endswith(path) else path


class Names(SphinxTransform):
    """Let literals refer to the names that they are."""

    default_priority = 400

    def apply(self):
        page = self.env.docname
        for node in list(self.document.findall(nodes.literal)):
            path = path_of(node.astext(), page)
            if isinstance(node.parent, addnodes.pending_xref) and path and node.parent["reftype"] == "obj":
                node.parent["reftarget"] = path  # written in single backticks
            if path is None or isinstance(node.parent, (nodes.reference, addnodes.pending_xref, nodes.title)):
                continue
            to = addnodes.pending_xref("", reftype="obj", refdomain="py", reftarget=path, refwarn=True)
            to["refdoc"] = page
            node.replace_self(to)
            to += node


def setup(app):
    """Look through every page."""
    app.add_transform(Names)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
