"""How a kernel becomes machine code: subclasses of Numba's compiler and of its libraries of code.

Each kernel runs its own copies of its callees. Numba leaves it to the linker which of several copies runs, and they
round differently; an answer would depend on which kernels the process used before, and on which it compiled itself.

Such a copy is optimised once, with the kernel that Python calls. Numba would optimise it, and make machine code of it,
at each of several levels of calls. What is compiled as a part of other kernels is therefore kept as it is, for others
to inline; nobody can call it.
"""

from __future__ import annotations

import threading
from functools import cache
from types import CodeType
from typing import Any, NamedTuple

import llvmlite.binding as llvm
from numba import extending
from numba.core import codegen, compiler, errors, types
from numba.core.compiler_machinery import PassManager
from numba.core.targetconfig import ConfigStack


class _Levels(threading.local):
    """How many kernels are under way whose compilation has asked for that of the next one."""

    count = 0


levels = _Levels()


def is_part() -> bool:
    """Return True while a kernel is compiled, or loaded, as a part of another one."""
    return levels.count > 1


class _Nowhere:
    """Stands for the code generator of a part: no code of it is in memory that an environment could be given."""

    def __init__(self, generator: Any) -> None:
        self._generator = generator

    def __getattr__(self, name: str) -> Any:
        return getattr(self._generator, name)

    def set_env(self, name: str, environment: Any) -> None:
        """Do nothing."""


class Shared(NamedTuple):
    """A kernel of which there is one copy, which all others call: where it is, for which types, and its symbol."""

    module: str
    name: str
    types: tuple[Any, ...]
    symbol: str


class Library(codegen.JITCodeLibrary):  # type: ignore[misc]
    """The code of a kernel; of a part only what other kernels inline, of a shared kernel nothing.

    Attributes
    ----------
    is_part
        Whether it is one.
    called
        The shared kernels that it calls, by their symbols: they have to be in memory before its machine code is.
    itself
        What others call, if it is that of a shared kernel.
    """

    def __init__(self, generator: Any, name: str, is_part: bool) -> None:
        super().__init__(generator, name)
        self.is_part = is_part
        self.called: dict[str, Shared] = {}
        self.itself: Shared | None = None
        self.enable_object_caching()

    def add_linking_library(self, library: Any) -> None:
        """Take what is called with the code of a callee, or its symbol alone where it is shared."""
        if isinstance(library, Library) and library.itself is not None:
            self.called[library.itself.symbol] = library.itself
            return
        if isinstance(library, Library):
            self.called |= library.called
        super().add_linking_library(library)

    @property
    def codegen(self) -> Any:
        """The code generator."""
        return _Nowhere(self._codegen) if self.is_part else self._codegen

    def _optimize_final_module(self) -> None:
        if not self.is_part:
            super()._optimize_final_module()

    def _finalize_final_module(self) -> None:
        """Hide the copies of callees from the linker; or, of a part, keep all for the kernels that inline it."""
        if not self.is_part:
            for function in self._final_module.functions:
                if function.linkage == llvm.Linkage.linkonce_odr:
                    function.linkage = llvm.Linkage.internal
            super()._finalize_final_module()
            return
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == llvm.Linkage.external:
                function.linkage = llvm.Linkage.linkonce_odr
        self._shared_module, self._finalized = self._final_module, True

    def get_pointer_to_function(self, name: str) -> int:
        """Return where the machine code of a function is, 0 for that of a part."""
        self._ensure_finalized()
        return 0 if self.is_part else int(super().get_pointer_to_function(name))

    def serialize_using_object_code(self) -> tuple[str, bool, bytes, bytes]:
        """Return name, kind, machine code (none of a part) and the code that others inline, or only its names."""
        self._ensure_finalized()
        if self.is_part:
            return self.name, True, b"", self._final_module.as_bitcode()
        return self.name, False, self._get_compiled_object(), _names_of(self._final_module)

    @classmethod
    def _unserialize(cls, generator: Any, state: tuple[str, bool, bytes, bytes]) -> Library:
        name, is_part, machine_code, inlined = state
        library = cls(generator, name, is_part)
        library._shared_module = llvm.parse_bitcode(inlined)
        if is_part:
            library._final_module, library._finalized = library._shared_module, True
            return library
        library._set_compiled_object(machine_code)
        codegen.CPUCodeLibrary._finalize_final_module(library)
        library._codegen._engine._load_defined_symbols(library._shared_module)
        return library


def code_of(result: Any) -> Library:
    """Return the code of a kernel that was compiled or loaded."""
    return result._asdict()["library"]  # type: ignore[no-any-return]


def _names_of(module: Any) -> bytes:
    """Return a module that defines the names of what can be called, without their code."""
    lines = [f'target triple = "{module.triple}"', f'target datalayout = "{module.data_layout}"']
    names = [one.name for one in module.functions if not one.is_declaration and one.linkage == llvm.Linkage.external]
    lines += [f'define void @"{name}"() {{ unreachable }}' for name in names]
    return bytes(llvm.parse_assembly("\n".join(lines)).as_bitcode())


class _Flags(compiler.Flags):  # type: ignore[misc]
    """Numba's flags, compared without a list of all that could be set: Numba compares them for each operation."""

    __slots__ = ("_token",)

    @property
    def token(self) -> str:
        """What is set, where nothing more is set."""
        if not hasattr(self, "_token"):
            self._token = self.summary()
        return self._token

    def _changed(self) -> dict[str, Any]:
        return {name: value for name, value in self._values.items() if value != self.options[name].default}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, _Flags):
            return bool(super().__eq__(other))
        return bool(self._values == other._values) or self._changed() == other._changed()

    def __hash__(self) -> int:
        return EQUAL_FLAGS


EQUAL_FLAGS = hash(compiler.Flags())
"""Numba's flags all have this hash."""


class _Operation(types.Function):  # type: ignore[misc]
    """An operation such as a sum or an index; its types are found once. A wheel's march asks 16 600 times, for 232."""

    def __init__(self, function: types.Function) -> None:
        super().__init__(function.templates)
        self._known: dict[Any, Any] = {}

    def get_call_type(self, context: Any, args: Any, kws: Any) -> Any:
        """Return the signature of a call, as Numba finds it."""
        flags = ConfigStack.top_or_none()
        if not isinstance(flags, _Flags):  # of a function of Numba's own
            return super().get_call_type(context, args, kws)
        key = tuple(args), tuple(kws.items()), flags.token
        if key not in self._known:
            try:
                signature = super().get_call_type(context, args, kws)
            except errors.TypingError as error:
                self._known[key] = None, error.msg
                raise
            self._known[key] = signature, self._impl_keys[signature.args]
        signature, code = self._known[key]
        if signature is None:
            raise errors.TypingError(code)
        self._impl_keys[signature.args] = code  # other flags may have meant other code
        return signature


class _Typing:
    """Numba's typing context, with such operations."""

    def __init__(self, context: Any) -> None:
        self._context = context

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)

    def resolve_value_type(self, value: Any) -> Any:
        """Return the type of what a name means."""
        found = self._context.resolve_value_type(value)
        return operation(found) if type(found) is types.Function and _is_operator(value) else found


operation = cache(_Operation)
extending.register_model(_Operation)(extending.models.OpaqueModel)


def _is_operator(function: Any) -> bool:
    return getattr(function, "__module__", "") in ("_operator", "builtins")


IDLE = {
    "WithLifting", "InlineClosureLikes", "InlineInlinables", "MakeFunctionToJitFunction", "FindLiterallyCalls",
    "LiteralUnroll", "LiteralPropagationSubPipelinePass", "DumpParforDiagnostics",
}  # fmt: skip
"""Passes of Numba's compiler that find nothing to do in a kernel without functions inside: a tenth of the time."""


class Pipeline(compiler.Compiler):  # type: ignore[misc]
    """Numba's compiler, into a library as above; C calls no kernel, and Python no part."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes."""
        (whole,) = super().define_pipelines()
        if any(isinstance(constant, CodeType) for constant in self.state.func_id.code.co_consts):
            return [whole]
        busy = PassManager(whole.pipeline_name)
        for one, what in whole.passes:
            if one.__name__ not in IDLE:
                busy.add_pass(one, what)
        busy.finalize()
        return [busy]

    def compile_extra(self, func: Any) -> Any:
        """Compile a function."""
        state = self.state
        state.flags = _Flags(state.flags)
        state.flags.no_cfunc_wrapper, state.flags.no_cpython_wrapper = True, is_part()
        state["library"] = Library(state.targetctx.codegen(), func.__qualname__, is_part())
        context = state.typingctx
        state.typingctx = state.targetctx.typing_context = _Typing(context)
        return super().compile_extra(func)._replace(typing_context=context)
