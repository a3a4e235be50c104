"""Equations as MathML, which browsers draw themselves: no script, no font, no network."""

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml


def inline(self, node):
    """Write an equation within a line."""
    self.body.append(str(tex2mathml(node.astext())))
    raise nodes.SkipNode


def display(self, node):
    """Write an equation on a line of its own."""
    self.body.append(self.starttag(node, "div", CLASS="math"))
    self.body.append(str(tex2mathml(node.astext(), as_block=True)))
    self.body.append("</div>\n")
    raise nodes.SkipNode


def setup(app):
    """Offer the renderer ``mathml``."""
    app.add_html_math_renderer("mathml", (inline, None), (display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
