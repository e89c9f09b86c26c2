"""The directive ``.. validation::``: comparisons with figures of others, measured by the build."""

from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

from wheeltapper.faces.validation.report import lines_of, measured_all, page_of

LOGGER = logging.getLogger(__name__)


class Validation(SphinxDirective):
    """A table for each kind of comparison; a difference that is too large is a warning."""

    def run(self) -> list[nodes.Node]:
        found = list(measured_all())
        for line in lines_of([one for one in found if not one.agrees]):
            LOGGER.warning(line, location=self.get_location())
        return self.parse_text_to_nodes(page_of(found), allow_section_headings=True)


def setup(app: Sphinx) -> dict[str, Any]:
    app.add_directive("validation", Validation)
    return {"parallel_read_safe": True}
