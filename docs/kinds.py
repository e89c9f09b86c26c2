"""The directives ``.. kinds:: irregularities`` and ``.. faults::``: what a room offers, from the registry."""

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import wheeltapper as wt
from wheeltapper.describe.manual import room_table
from wheeltapper.diagnosis.faults import base


class Kinds(SphinxDirective):
    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        return self.parse_text_to_nodes(room_table(getattr(wt, self.arguments[0]).__name__))


class Faults(SphinxDirective):
    def run(self) -> list[nodes.Node]:
        return self.parse_text_to_nodes(base.listed())


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("kinds", Kinds)
    app.add_directive("faults", Faults)
    return {"parallel_read_safe": True}
