"""How tests draw cases: always the same ones; more of them where WHEELTAPPER_DRAWN says how many times as many."""

import os
from collections.abc import Callable
from typing import Any

from hypothesis import Phase, settings

TIMES = int(os.environ.get("WHEELTAPPER_DRAWN", "1"))


def drawn(cases: int) -> Callable[[Any], Any]:
    """Return a decorator of a test with `given`: so many cases, none of them made smaller when one fails."""
    return settings(
        max_examples=TIMES * cases, deadline=None, derandomize=True, phases=[Phase.explicit, Phase.generate]
    )  # fmt: skip
