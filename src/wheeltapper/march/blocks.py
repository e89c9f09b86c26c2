"""Blocks of cells on threads: the kernels release the interpreter's lock."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


def core_count() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_blocks(total: int, size: int, threads: int, one: Callable[[slice], None]) -> None:
    """Call `one` for each block of at most `size` cells, on `threads` threads."""
    blocks = [slice(begin, min(begin + size, total)) for begin in range(0, total, size)]
    if threads == 1 or len(blocks) < 2:
        for block in blocks:
            one(block)
        return
    with ThreadPoolExecutor(threads) as pool:
        for _ in pool.map(one, blocks):  # errors in a block are raised here
            pass
