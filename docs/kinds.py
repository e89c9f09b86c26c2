"""The directive ``.. kinds:: irregularities``: what a room of the front door offers to be made, from the registry."""

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import wheeltapper as wt
from wheeltapper.describe.manual import listed


class Kinds(SphinxDirective):
    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        return self.parse_text_to_nodes(listed(getattr(wt, self.arguments[0]).__name__))


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("kinds", Kinds)
    return {"parallel_read_safe": True}
