"""Blocks of cells on threads: the kernels release the interpreter's lock."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


def in_blocks(total: int, size: int, threads: int, one: Callable[[slice], None]) -> None:
    """Call `one` for each block of at most `size` cells, on so many threads."""
    blocks = [slice(begin, min(begin + size, total)) for begin in range(0, total, size)]
    if threads == 1 or len(blocks) < 2:
        for block in blocks:
            one(block)
        return
    with ThreadPoolExecutor(threads) as pool:
        for _ in pool.map(one, blocks):  # an error in a block comes up here
            pass
