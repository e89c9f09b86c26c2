"""Kernels that are called by their address, and so compiled once, whoever calls them.

Numba links a callee's code into its caller's and optimises it there again, at every level of calls, and once more in
each kernel that uses it. Of a large callee deep in several kernels this is most of the time of compilation. Through an
address the caller knows the callee's types only. Every caller also runs the same copy, which rounds the same.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numba
from numba import config, extending, types
from numba.core import cgutils, errors

from wheeltapper.march.kernel import for_itself, is_compiled

_INTERPRETED = bool(config.DISABLE_JIT)  # type: ignore[attr-defined]


class ByAddress:
    """A kernel that others call by its address.

    Attributes
    ----------
    call
        For kernels: `call(address, *arguments)` calls it.
    """

    def __init__(self, dispatcher: Any, example: Callable[[], tuple[Any, ...]]) -> None:
        """Make a kernel such a one; `example` returns arguments of the only types that it is compiled for."""
        self._dispatcher, self._example = dispatcher, example
        self.call: Callable[..., Any] = _direct(dispatcher) if _INTERPRETED else extending.intrinsic(_by_address(self))

    @cached_property
    def kinds(self) -> tuple[Any, ...]:
        """The types of the arguments."""
        return tuple(numba.typeof(argument) for argument in self._example())

    @cached_property
    def compiled(self) -> Any:
        """The kernel, compiled or loaded."""
        with for_itself():
            self._dispatcher.compile(self.kinds)
        return self._dispatcher.overloads[self.kinds]

    @property
    def address(self) -> int:
        """Where its machine code is."""
        if _INTERPRETED:
            return 0
        parts = self.compiled._asdict()
        return int(parts["library"].get_pointer_to_function(parts["fndesc"].llvm_func_name))

    def is_compiled(self) -> bool:
        """Return True if its machine code is in memory or in the cache."""
        return is_compiled(self._dispatcher, self._example())


def _direct(dispatcher: Any) -> Callable[..., Any]:
    def call(address: int, *arguments: Any) -> Any:
        return dispatcher(*arguments)

    return call


def _by_address(kernel: ByAddress) -> Callable[..., Any]:
    """Return what Numba asks of an intrinsic function: the types of a call, and how its code is written."""

    def call(typingctx: Any, address: Any, *arguments: Any) -> Any:
        wrong = [f"{own}, not {given}" for given, own in zip(arguments, kernel.kinds, strict=True) if given != own]
        if wrong:
            raise errors.TypingError(f"an argument has to be {'; '.join(wrong)}")
        result = kernel.compiled.signature.return_type

        def code(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            convention = context.call_conv
            function = convention.get_function_type(result, kernel.kinds)
            pointer = builder.inttoptr(values[0], function.as_pointer())
            given = cgutils.unpack_tuple(builder, values[1])
            status, answer = convention.call_function(builder, pointer, result, kernel.kinds, given)
            with cgutils.if_unlikely(builder, status.is_error):
                convention.return_status_propagate(builder, status)
            return answer

        return result(address, types.StarArgTuple(kernel.kinds)), code

    return call
