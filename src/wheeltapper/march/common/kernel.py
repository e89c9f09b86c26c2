"""The decorators of all kernels: compiled once, kept on disk, and compiled again when any kernel's source changes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba

from wheeltapper.march.compiling.guests import Kernel

FASTMATH = {"contract", "reassoc", "arcp", "nsz", "afn"}
"""Flags of the compiler. Never nnan or ninf, because infinities and NaN are data here (open ends, failures)."""


COMMON = {"nopython": True, "error_model": "numpy", "nogil": True, "forceinline": False}
"""Options of all kernels. Where Numba is not told whether to inline one, it does as for the kernel that first calls it:
what code a kernel became would depend on the order in which kernels are compiled."""


def _decorator(is_shared: bool = False, **options: Any) -> Callable[[Any], Any]:
    def decorate(function: Any) -> Any:
        if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
            return function
        made = Kernel(function, targetoptions=COMMON | options)
        made.is_shared = is_shared
        return made

    return decorate


kernel = _decorator(fastmath=FASTMATH)
inlined_kernel = _decorator(fastmath=FASTMATH, forceinline=True)
"""For a kernel that does less than its call costs."""
shared_kernel = _decorator(is_shared=True, fastmath=FASTMATH)
"""For a large kernel that several others call: all call one copy of it, which is optimised once."""
uncounted_kernel = _decorator(fastmath=FASTMATH, _nrt=False)
inlined_uncounted_kernel = _decorator(fastmath=FASTMATH, _nrt=False, forceinline=True)
shared_uncounted_kernel = _decorator(is_shared=True, fastmath=FASTMATH, _nrt=False)
"""For kernels that make no arrays: nobody counts the references to those that they are given. Counts take time, and are
most of the code where many arrays are passed on."""
plain_kernel = _decorator()
"""For results that must be exact to the last digit: sums keep the order in which they are written."""
