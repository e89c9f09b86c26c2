"""Records whose arrays nobody counts references of (`wheeltapper.march.borrowed`)."""

from __future__ import annotations

from typing import Any

from numba import config, extending, types
from numba.core import cgutils
from numba.np import arrayobj


def _without_counts(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, types.Array):
        view = arrayobj.make_array(kind)(context, builder, value)
        view.meminfo = context.get_constant_null(types.MemInfoPointer(kind.dtype))
        return view._getvalue()
    if isinstance(kind, types.BaseTuple):
        parts = cgutils.unpack_tuple(builder, value)
        kinds = iter(kind)  # type: ignore[call-overload]
        kept = [_without_counts(context, builder, one, part) for one, part in zip(kinds, parts, strict=True)]
        return context.make_tuple(builder, kind, kept)
    return value


def _borrowed_record(typingctx: Any, record: Any) -> Any:
    """Return a named tuple, of arrays and of such tuples, without the places where references are counted."""
    if not isinstance(record, types.BaseTuple):
        return None

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _without_counts(context, builder, record, arguments[0])

    return record(record), code


borrowed_record: Any = extending.intrinsic(_borrowed_record)
if config.DISABLE_JIT:  # type: ignore[attr-defined]

    def borrowed_record(record: Any) -> Any:
        """Return the record: without compilation nothing is counted by hand."""
        return record
