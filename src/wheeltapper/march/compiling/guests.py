"""Subclasses of Numba's compiler, for the kernels alone: what other people compile is compiled as without them.

What Python calls is compiled for itself, also where other kernels have it as a part. So it does not depend on what else
was compiled before what code a kernel becomes.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from importlib import import_module
from pathlib import Path
from typing import Any

from numba.core import compiler, errors, serialize, sigutils
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher
from numba.core.types import unliteral

from wheeltapper.march.compiling import prebuilt, telling
from wheeltapper.march.compiling.pipeline import Library, Pipeline, Shared, code_of, is_part, levels
from wheeltapper.march.compiling.sources import FOLDER, room_of
from wheeltapper.march.compiling.store import store_of

NOT_CALLED = "a kernel of wheeltapper cannot be called from a function that Numba compiles; call it from Python"


@contextmanager
def for_itself() -> Iterator[None]:
    """Compile kernels as if Python called them, also where another one asks for it."""
    before, levels.count = levels.count, 0
    try:
        yield
    finally:
        levels.count = before


class _Generator:
    """A code generator that makes such libraries of what was kept."""

    def __init__(self, generator: Any) -> None:
        self._generator = generator

    def unserialize_library(self, state: Any) -> Library:
        return Library._unserialize(self._generator, state)


class _Context:
    """A target with such a code generator."""

    def __init__(self, target: Any) -> None:
        self._target = target

    def __getattr__(self, name: str) -> Any:
        return getattr(self._target, name)

    def codegen(self) -> _Generator:
        return _Generator(self._target.codegen())


class _Cache:
    """What is kept of a kernel: parts, and what Python calls, beside each other. It is what Numba asks of a cache."""

    def __init__(self, py_func: Any) -> None:
        file = Path(py_func.__code__.co_filename).resolve()
        self._store = store_of(room_of(file))
        place = file.relative_to(FOLDER).with_suffix("")
        self.kernel = ".".join((*place.parts, py_func.__qualname__))
        self._base = f"{self.kernel} {py_func.__code__.co_firstlineno}"
        self._found: Any = None

    @property
    def has_found(self) -> bool:
        """Whether what is loaded next was kept."""
        return self._found is not None

    @property
    def root(self) -> Path:
        """The folder of all compiled kernels."""
        return self._store.folder.parent

    def name(self, sig: Any, processor: Any) -> str:
        """Return what a kernel is kept by, for arguments of some types and a processor as Numba names it."""
        kind = "part" if is_part() else "code"
        types = sigutils.normalize_signature(sig)[0]
        key = f"{self._base} {kind} {types} {processor}"
        return f"{self.kernel}.{hashlib.sha256(key.encode()).hexdigest()[:16]}.{kind}"

    @contextmanager
    def compiling(self, sig: Any, target: Any) -> Iterator[None]:
        """Load inside what was kept, or compile it, in one process at a time; who waits is told of what is compiled."""
        self._found = self._kept(sig, target)
        with ExitStack() as stack:
            if self._found is None:
                name = self.name(sig, target.codegen().magic_tuple())
                stack.enter_context(self._store.locked(name, lambda: telling.tell_waiting(self.kernel)))
                self._found = self._kept(sig, target)
            if self._found is None:
                stack.enter_context(nullcontext() if is_part() else telling.told(self.kernel, self.root))
            yield
        telling.tick()

    def load_overload(self, sig: Any, target: Any) -> Any:
        """Return a kernel that was kept, or None."""
        found, self._found = self._found, None
        return found

    def _kept(self, sig: Any, target: Any) -> Any:
        target.refresh()
        data, generator = None, target.codegen()
        if prebuilt.level() and not is_part():
            data = prebuilt.read(self._store.folder.name, self.name(sig, prebuilt.magic(generator)))
        data = data or self._store.read(self.name(sig, generator.magic_tuple()))
        if data is None:
            return None
        called, reduced = pickle.loads(data)
        if not all(_is_in_memory(one) for one in called):
            return None
        found = compiler.CompileResult._rebuild(_Context(target), *reduced)
        code_of(found).called = {one.symbol: one for one in called}
        return found._replace(target_context=target)

    def save_overload(self, sig: Any, result: Any) -> None:
        """Keep a kernel, unless addresses of this process are in it."""
        code = code_of(result)
        if not code.has_dynamic_globals:
            kept = tuple(code.called.values()), result._reduce()
            self._store.write(self.name(sig, result.codegen.magic_tuple()), serialize.dumps(kept))


def _is_in_memory(called: Shared) -> bool:
    """Load or compile a shared kernel; return False if it is another one than that which was called."""
    kernel = getattr(import_module(called.module), called.name)
    with for_itself():
        kernel.compile(called.types)
    return code_of(kernel.overloads[called.types]).itself == called


class Kernel(CPUDispatcher):  # type: ignore[misc]
    """Numba's dispatcher, which keeps what Python calls and parts of other kernels apart."""

    is_shared = False
    """Whether others call one copy of it, instead of one of their own each."""
    shortened: Callable[[], Any] | None = None
    """What makes a function that does the same, which is compiled in place of its own where nothing was kept."""

    def __init__(
        self, py_func: Any, locals: Any = None, targetoptions: Any = None, pipeline_class: Any = Pipeline
    ) -> None:
        super().__init__(py_func, locals, targetoptions, pipeline_class)
        self.parts: dict[Any, Any] = {}
        self._cache = _Cache(py_func)

    def compile(self, sig: Any) -> Any:
        """Compile or load a kernel, for Python or as a part of another one."""
        with for_itself() if self.is_shared else nullcontext():
            return self._compile(sig)

    def _compile(self, sig: Any) -> Any:
        with global_compiler_lock, ExitStack() as stack:
            overloads = self.overloads
            levels.count += 1
            try:
                if is_part():
                    self.overloads = self.parts
                types = tuple(sigutils.normalize_signature(sig)[0])
                if types not in self.overloads:
                    stack.enter_context(self._cache.compiling(sig, self.targetctx))
                    if self.shortened is not None and not self._cache.has_found:
                        self._compiler.py_func = self.shortened()
                return super().compile(sig)
            finally:
                self.overloads = overloads
                stack.close()
                levels.count -= 1

    def add_overload(self, cres: Any) -> None:
        """Keep machine code; Python does not see that of a part, and its call compiles the kernel for itself."""
        if is_part():
            self.overloads[tuple(cres.signature.args)] = cres
            return
        for environment in cres._find_referenced_environments():  # those of its parts, which are nowhere else
            code_of(cres).codegen.set_env(environment.env_name, environment)
        if self.is_shared:
            types, symbol = tuple(cres.signature.args), cres.fndesc.llvm_func_name
            code_of(cres).itself = Shared(self.py_func.__module__, self.py_func.__name__, types, symbol)
        super().add_overload(cres)

    def get_overload(self, sig: Any) -> Any:
        """Return what is called: by a kernel that is being compiled a part, whatever else there is."""
        return self._callable()[tuple(sigutils.normalize_signature(sig)[0])].entry_point

    def _callable(self) -> dict[Any, Any]:
        return self.parts if levels.count and not self.is_shared else self.overloads  # type: ignore[no-any-return]

    @property
    def nopython_signatures(self) -> Any:
        """The signatures of what can be called."""
        return [result.signature for result in self._callable().values()]

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return how a kernel is called by another one; other people's functions cannot: its parts are not for them."""
        if not levels.count:
            raise errors.TypingError(NOT_CALLED)
        # a constant is a number: it makes no kernel of its own
        args = tuple(unliteral(one) for one in args)
        return super().get_call_template(args, {name: unliteral(one) for name, one in kws.items()})
