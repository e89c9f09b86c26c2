"""Calls of a function by the address of its machine code: what a kernel calls is then chosen while it runs.

A kernel that named its callees would have to be compiled with all of them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.extending import intrinsic

from wheeltapper.march.compiling.pipeline import code_of

_FLOATS = {dimensions: types.Array(types.float64, dimensions, "C") for dimensions in (1, 2)}
STEP = types.Tuple((*(types.float64,) * 4, types.boolean))(
    _FLOATS[1], _FLOATS[2], types.float64, types.int64, _FLOATS[2], _FLOATS[1]
)
"""The type of a function that makes contact steps (`scalar`)."""

_known: list[Callable[..., Any]] = []


def address_of(made: Any) -> float:
    """Return the address of a kernel's machine code, compiled or loaded for the types of a step; it stays there.

    Where Numba is switched off, it is a number that `call_step` knows the function by.
    """
    _known.append(made)
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        return float(len(_known))
    made.compile(STEP.args)
    result = made.overloads[STEP.args]
    return float(code_of(result).get_pointer_to_function(result.fndesc.llvm_func_name))


if config.DISABLE_JIT:  # type: ignore[attr-defined]

    def call_step(address: float, *arguments: Any) -> Any:
        """Call a function by its number."""
        return _known[int(address) - 1](*arguments)

else:

    @intrinsic  # type: ignore[misc]
    def call_step(
        typing: Any, address: Any, numbers: Any, pieces: Any, until: Any, limit: Any, steps: Any, S: Any
    ) -> Any:
        """Call a function that makes steps by the address of its machine code, a float."""

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            place, *given = values
            kind = context.call_conv.get_function_type(STEP.return_type, STEP.args)
            pointer = builder.inttoptr(builder.fptoui(place, cgutils.intp_t), ir.PointerType(kind))
            given = [
                context.cast(builder, value, has, needs)
                for value, has, needs in zip(given, signature.args[1:], STEP.args, strict=True)
            ]
            _, out = context.call_conv.call_function(builder, pointer, STEP.return_type, STEP.args, given)
            return out

        return STEP.return_type(address, numbers, pieces, until, limit, steps, S), generate
