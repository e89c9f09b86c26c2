"""The command `cache`: where compiled kernels are kept, how many, and their removal."""

from __future__ import annotations

import sys
from typing import Annotated

from cyclopts import Parameter

from wheeltapper.faces.exits import DONE, NOT_FINISHED


def cache(*, empty: Annotated[bool, Parameter(negative="")] = False) -> int:
    """Show where compiled kernels are kept, and how much that is; or remove them.

    Parameters
    ----------
    empty
        Remove all of them, those of other versions too. What is needed is compiled again.
    """
    from wheeltapper.march.compiling import kept
    from wheeltapper.march.compiling.store import root

    print(f"compiled kernels in {root()}")
    found = kept.empty() if empty else kept.kept()
    left = {one.folder for one in kept.kept()}
    for one in found:
        old = "" if one.is_current else ", of other sources"
        gone = "" if one.folder in left else ", removed"
        print(f"  {kept.MARCHES[one.march]}: {one.kernels} kernels, {one.size / 2**20:.1f} MB{old}{gone}")
    if not found:
        print("  none")
    if empty and left:
        print(f"wheeltapper: {root()}: could not be emptied, it cannot be written", file=sys.stderr)
        return NOT_FINISHED
    return DONE
