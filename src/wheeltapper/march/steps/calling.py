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
ONE = types.Tuple((*(types.float64,) * 4, types.boolean))(
    _FLOATS[1], _FLOATS[2], types.float64, types.int64, _FLOATS[2], _FLOATS[1]
)
"""The type of a function that makes steps of one wheel (`scalar`)."""
EIGHT = types.none(_FLOATS[1])
"""The type of a function that does something with eight cells at a time (`lanes`)."""
TURNED = types.none(_FLOATS[1], _FLOATS[1], _FLOATS[2])
"""The type of a function that differentiates a step of one wheel (`tangents`)."""

_known: list[Callable[..., Any]] = []


def address_of(made: Any, signature: Any) -> float:
    """Return the address of a kernel's machine code, compiled or loaded for a signature; it stays there.

    Where Numba is switched off, it is a number that the calls below know the function by.
    """
    _known.append(made)
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        return float(len(_known))
    made.compile(signature.args)
    result = made.overloads[signature.args]
    return float(code_of(result).get_pointer_to_function(result.fndesc.llvm_func_name))


def _call(context: Any, builder: Any, signature: Any, given: Any, values: Any) -> Any:
    """Write code that calls the function at an address, the first value; `given` has the types of the others."""
    place, *others = values
    kind = context.call_conv.get_function_type(signature.return_type, signature.args)
    pointer = builder.inttoptr(builder.fptoui(place, cgutils.intp_t), ir.PointerType(kind))
    others = [
        context.cast(builder, value, has, needs)
        for value, has, needs in zip(others, given, signature.args, strict=True)
    ]
    return context.call_conv.call_function(builder, pointer, signature.return_type, signature.args, others)[1]


if config.DISABLE_JIT:  # type: ignore[attr-defined]

    def call_one(address: float, *arguments: Any) -> Any:
        """Call a function by its number."""
        return _known[int(address) - 1](*arguments)

    call_eight = call_turned = call_one

else:

    @intrinsic  # type: ignore[misc]
    def call_one(
        typing: Any, address: Any, numbers: Any, pieces: Any, until: Any, limit: Any, steps: Any, S: Any
    ) -> Any:
        """Call a function that makes steps of one wheel by the address of its machine code, a float."""
        given = numbers, pieces, until, limit, steps, S

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            return _call(context, builder, ONE, given, values)

        return ONE.return_type(address, *given), generate

    @intrinsic  # type: ignore[misc]
    def call_eight(typing: Any, address: Any, L: Any) -> Any:
        """Call a function that does something with eight cells at a time."""

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            _call(context, builder, EIGHT, (L,), values)
            return context.get_dummy_value()

        return types.none(address, L), generate

    @intrinsic  # type: ignore[misc]
    def call_turned(typing: Any, address: Any, numbers: Any, S: Any, D: Any) -> Any:
        """Call a function that differentiates a step of one wheel."""
        given = numbers, S, D

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            _call(context, builder, TURNED, given, values)
            return context.get_dummy_value()

        return types.none(address, *given), generate
