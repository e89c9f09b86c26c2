"""Arrays whose references nobody counts.

Numba counts the references to an array at every call that takes it, by an atomic operation that takes as long as thirty
products. A kernel that calls many others may take its arrays once as borrowed ones: its caller holds them until it
returns.
"""

from __future__ import annotations

from typing import Any

from numba import config, extending, types
from numba.np import arrayobj


def _borrowed(typingctx: Any, array: Any) -> Any:
    """Return the array without the place where its references are counted."""
    if not isinstance(array, types.Array):
        return None

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        view = arrayobj.make_array(array)(context, builder, arguments[0])
        view.meminfo = context.get_constant_null(types.MemInfoPointer(array.dtype))
        return view._getvalue()

    return array(array), code


borrowed: Any = extending.intrinsic(_borrowed)
if config.DISABLE_JIT:  # type: ignore[attr-defined]

    def borrowed(array: Any) -> Any:
        """Return the array: without compilation nothing is counted by hand."""
        return array
