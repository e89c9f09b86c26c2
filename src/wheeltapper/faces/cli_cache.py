"""The command `cache`: where compiled kernels are kept, how many; all of them compiled beforehand, or removed."""

from __future__ import annotations

import sys
from contextlib import closing
from typing import Annotated

from cyclopts import Parameter

from wheeltapper.faces.exits import DONE, NOT_FINISHED

LOST = "a process that compiled was lost"
MOST = 4
"""Processes that compile, unless more are asked for: each waits for what another one compiles already."""
Switch = Annotated[bool, Parameter(negative="")]


def cache(*, empty: Switch = False, fill: Switch = False, workers: int | None = None) -> int:
    """Show where compiled kernels are kept and how large they are; compile all, or remove them.

    Parameters
    ----------
    empty
        Remove all kernels, also those of other versions. What is needed later is compiled again.
    fill
        Compile now whatever the commands and analyses of this package need, so that nobody waits for it later.
    workers
        Number of processes that compile; by default one for each processor, at most 4.
    """
    from wheeltapper.march.compiling import kept, prebuilt
    from wheeltapper.march.compiling.store import root

    print(f"compiled kernels in {root()}")
    before = kept.empty() if empty else []
    stuck = any(one.folder.exists() for one in before)
    code = _fill(workers) if fill else DONE
    gone = [one for one in before if not one.folder.exists()]
    found = gone + kept.kept()
    for one in found:
        old = "" if one.is_current else ", of other sources"
        removed = ", removed" if one in gone else ""
        print(f"  {kept.ROOMS[one.room]}: {one.kernels} kernels, {one.size / 2**20:.1f} MB{old}{removed}")
    if not found:
        print("  none")
    for level, kernels in prebuilt.counted(prebuilt.PLACE).items():
        if kernels:
            used = ", used" if level == prebuilt.level() else ""
            print(f"brought along for {level}: {kernels.total()} kernels{used}")
    if stuck:
        print(f"wheeltapper: {root()}: could not be emptied, it cannot be written", file=sys.stderr)
    return NOT_FINISHED if stuck else code


def _fill(workers: int | None) -> int:
    """Ask for whatever is compiled; return the exit code."""
    from wheeltapper.diagnosis.processes import Lost, in_processes
    from wheeltapper.faces.filling import ask, asks
    from wheeltapper.ground.progress import progress_shown, report, say
    from wheeltapper.march.common.blocks import core_count
    from wheeltapper.march.compiling.kept import ROOMS
    from wheeltapper.march.compiling.store import NOT_KEPT, store_of
    from wheeltapper.march.compiling.telling import told_once

    if not all(store_of(room).is_sound for room in ROOMS):
        return NOT_FINISHED  # and it is said why
    said, many = {*told_once()}, len(asks())
    held = min(core_count(), MOST) if workers is None else workers
    with progress_shown(True), closing(in_processes(ask, None, range(many), held)) as answers:
        for done, (_, lines) in enumerate(answers, 1):
            report("compiling", done, many)
            for line in [f"{LOST}: {lines}"] if isinstance(lines, Lost) else lines:
                if line not in said:
                    say(line)
                    said.add(line)
    return NOT_FINISHED if any(NOT_KEPT in line or LOST in line for line in said) else DONE
