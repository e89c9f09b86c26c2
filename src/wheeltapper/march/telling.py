"""How a march tells how far it is: its kernel returns after some steps, and goes on."""

from __future__ import annotations

from collections.abc import Callable

CHUNK = 20_000
"""Steps of a wheelset's march after which its kernel returns: far below a tenth of a second."""
WAGON_CHUNK = 4_000
"""The same of a wagon's, whose steps take longer."""
Tell = Callable[[float], bool]
"""Called with the time (of the program) that a march has reached; where it returns True, the march ends as FULL."""


def untold(reached: float) -> bool:
    """Tell nobody, and go on."""
    return False
