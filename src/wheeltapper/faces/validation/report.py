"""The report: what is compared with whom, how far it agrees, with which version, on which machine."""

from __future__ import annotations

import platform
from collections.abc import Iterator, Sequence
from datetime import date

from wheeltapper._version import __version__
from wheeltapper.faces.validation import closed_forms, programs, published
from wheeltapper.faces.validation.comparison import COMPARISONS, Compared, measured
from wheeltapper.ground.progress import report

ROOMS = (closed_forms, programs, published)
"""The files that hold comparisons: they register them."""
TITLES = {
    "closed form": "Closed forms",
    "another program": "Other programs",
    "published figures": "Published figures",
}
"""Headings by kind."""
MEANING = (
    "Each row compares what this package computes with figures of somebody else. Differences are relative unless the "
    "quantity says its unit."
)


def measured_all() -> Iterator[Compared]:
    """Measure all comparisons, one after the other."""
    for number, one in enumerate(COMPARISONS):
        report("comparisons", number, len(COMPARISONS))
        yield from measured(one)
    report("comparisons", len(COMPARISONS), len(COMPARISONS))


def origin() -> str:
    """Return the versions and the machine, in one sentence."""
    import numba
    import numpy as np

    return (
        f"wheeltapper {__version__} with numba {numba.__version__}, NumPy {np.__version__} and Python "
        f"{platform.python_version()}, on {platform.system()} {platform.machine()}, {date.today().isoformat()}."
    )


def lines_of(found: Sequence[Compared]) -> list[str]:
    """Return lines to print."""
    return [
        f"{'agrees' if one.agrees else 'DIFFERS':8} {one.difference:9.1e} of at most {one.allowed:7.1e}  "
        f"{one.comparison.subject}: {one.quantity}"
        for one in found
    ]


def page_of(found: Sequence[Compared]) -> str:
    """Return the report as reStructuredText, without a title."""
    lines = [origin(), "", MEANING, ""]
    for kind, words in TITLES.items():
        rows = [one for one in found if one.comparison.kind == kind]
        lines += [words, "-" * len(words), "", *_table(rows), ""]
    return "\n".join(lines)


def _table(rows: Sequence[Compared]) -> list[str]:
    out = [".. list-table::", "   :widths: 30 34 18 18", "   :header-rows: 1", ""]
    cells = [("what", "with whom", "difference", "allowed")]
    for i, one in enumerate(rows):
        again = i > 0 and rows[i - 1].comparison is one.comparison
        source = "as above" if again else one.comparison.source
        said = f"{one.difference:.1e}" if one.agrees else f"**{one.difference:.1e}: differs**"
        cells.append((f"{one.comparison.subject}: {one.quantity}", source, said, f"{one.allowed:.1e}"))
    for row in cells:
        out += [f"   {'* -' if i == 0 else '  -'} {cell}" for i, cell in enumerate(row)]
    return out
