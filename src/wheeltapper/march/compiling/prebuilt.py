"""Kernels that an installed package brings, compiled for a level of processors, where this one has all of it.

They lie in a folder for each level, as in the folder of compiled kernels, and `tools/prebuild.py` puts them there.
They are of one version of Python, Numba and the sources; any other compiles. A processor that Numba is told of
(NUMBA_CPU_NAME) is compiled for, too; so are all with WHEELTAPPER_PREBUILT=off.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numba

from wheeltapper.ground.errors import InputError
from wheeltapper.march.compiling.sources import FOLDER
from wheeltapper.march.compiling.store import content_of
from wheeltapper.march.compiling.telling import say_once

PLACE = FOLDER / "prebuilt"
V3 = "avx avx2 bmi bmi2 cx16 f16c fma lzcnt movbe popcnt sahf sse3 sse4.1 sse4.2 ssse3 xsave"
LEVELS = {"x86-64-v4": f"{V3} avx512bw avx512cd avx512dq avx512f avx512vl", "x86-64-v3": V3}
"""What a processor of a level has, as LLVM calls it; the best level first."""
OFF = "off"


def levels_of_host() -> list[str]:
    """Return the levels that are there and that this machine has."""
    has = llvm.get_host_cpu_features()
    return [level for level, needs in LEVELS.items() if (PLACE / level).is_dir() and all(map(has.get, needs.split()))]


@cache
def level() -> str:
    """Return the level whose kernels are used, "" for none.

    Raises
    ------
    InputError
        If another one is asked for by WHEELTAPPER_PREBUILT.
    """
    there = levels_of_host()
    asked = os.environ.get("WHEELTAPPER_PREBUILT")
    if asked and asked not in (OFF, *there):
        raise InputError("the environment", "WHEELTAPPER_PREBUILT", asked, f"one of {', '.join((OFF, *there))}")
    if asked == OFF or numba.config.CPU_NAME:  # type: ignore[attr-defined]
        return ""
    if not there and PLACE.is_dir():
        say_once(f"the prebuilt kernels are for {' and '.join(LEVELS)}, which this processor is not; it compiles")
    return asked or next(iter(there), "")


def read(folder: str, name: str) -> bytes | None:
    """Return a kernel that was brought along, from the folder of its march's sources, or None."""
    place = PLACE / level() / folder
    if not place.is_dir():
        say_once(f"the prebuilt kernels are of {_made_by()}; these sources, or what compiles them, differ; it compiles")
        return None
    return content_of(place / name)


def _made_by() -> str:
    try:
        return ", ".join(json.loads((PLACE / "made.json").read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return "unknown origin"


def counted(place: Path) -> dict[str, Counter[str]]:
    """Return how many versions of each kernel each level has; of damaged ones none counts."""
    return {
        level: Counter(
            f"{file.parent.name}/{file.name.rsplit('.', 2)[0]}"
            for file in (place / level).rglob("*.code")
            if content_of(file) is not None
        )
        for level in LEVELS
    }


def told() -> str:
    """Return which kernels are used, for those who ask."""
    return f"prebuilt for {level()}" if level() else "compiled for this machine"


def magic(generator: Any) -> tuple[str, str, str]:
    """Return what Numba distinguishes processors by, for the level."""
    return generator.magic_tuple()[0], level(), ""
