"""The decorator of all kernels: compiled once, cached on disk, and compiled again when any kernel's source changes.

Numba stamps a cached function with its own file only. After an edit of a callee in another file, the old machine code
would silently stay in use. The locators below stamp every kernel with all sources of its march: those of this folder,
or for the general march those of its folders and what they import of this one. An edit of one march does not compile
the other again. If the package's folder cannot be written, the cache goes to the user's cache directory.

Each kernel runs its own copies of its callees. Numba leaves it to the linker which of several copies runs, and they
round differently; an answer would depend on which kernels the process used before, and on which it compiled itself.

Such a copy is optimised once, with the kernel that Python calls. Numba would optimise it at each of several levels of
calls. What is compiled as a part of other kernels is therefore not optimised, and is not what Python calls: that is
compiled for itself. So it does not depend on what else was compiled before what code a kernel becomes.
"""

from __future__ import annotations

import atexit
import hashlib
import re
import tempfile
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numba
from numba.core import caching, codegen, sigutils
from numba.core.compiler_lock import global_compiler_lock

OURS = "_ZN11wheeltapper5march"
"""How the names of all compiled kernels begin."""
FOLDER = Path(__file__).resolve().parent
GENERAL = FOLDER / "general"
"""The general march, with folders of its own in it."""
RAILS = FOLDER / "rails"
"""The wagon's march on rails, which takes kernels of both."""
FASTMATH = {"contract", "reassoc", "arcp", "nsz", "afn"}
"""Flags of the compiler. Never nnan or ninf, because infinities and NaN are data here (open ends, failures)."""


def digest_of(files: Iterable[Path]) -> str:
    """Return a digest of sources, and of Numba's version."""
    digest = hashlib.sha256(numba.__version__.encode())
    for file in sorted(files):
        digest.update(file.relative_to(FOLDER).as_posix().encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


_IMPORTED = re.compile(r"^from wheeltapper\.march([\w.]*) import ([\w, ]*)", re.MULTILINE)
_KERNEL = re.compile(r"^@\w*kernel$", re.MULTILINE)


def with_imports(files: Iterable[Path]) -> set[Path]:
    """Return sources, with those of the marches that they import, and that these import."""
    wanted, found = list(files), set[Path]()
    while wanted:
        file = wanted.pop()
        if file in found or not file.exists():
            continue
        found.add(file)
        for module, names in _IMPORTED.findall(file.read_text(encoding="utf-8")):
            place = FOLDER.joinpath(*module.split("."))
            wanted.append(place.with_suffix(".py"))
            wanted += [place / f"{part.split()[0]}.py" for part in names.split(",") if part.strip()]
    return found


def rails_stamp() -> str:
    """Return a digest of the sources of the wagon's march on rails, and of all that they import."""
    return digest_of(with_imports(RAILS.glob("*.py")))


def source_stamp() -> str:
    """Return a digest of the sources of all kernels in this folder, which the door is not, and what they import."""
    return digest_of(with_imports({*FOLDER.glob("*.py")} - {FOLDER / "run.py"}))


def general_stamp() -> str:
    """Return a digest of the sources of the general march that have kernels, and of all that they import."""
    sources = GENERAL.rglob("*.py")
    return digest_of(with_imports(file for file in sources if _KERNEL.search(file.read_text(encoding="utf-8"))))


STAMP = source_stamp()
GENERAL_STAMP = general_stamp()
RAILS_STAMP = rails_stamp()


class _Stamped:
    """Claims the functions of this folder and of those in it, and stamps them with all of their sources."""

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> Any:
        file = Path(py_file).resolve()
        if FOLDER not in file.parents:
            return None
        locator = super().from_function(py_func, py_file)  # type: ignore[misc]
        if locator is not None:
            locator.stamp = STAMP if file.parent == FOLDER else RAILS_STAMP if file.parent == RAILS else GENERAL_STAMP
        return locator

    def get_source_stamp(self) -> str:
        return self.stamp  # type: ignore[attr-defined, no-any-return]


class _Environment(_Stamped, caching.UserProvidedCacheLocator):
    """The folder that NUMBA_CACHE_DIR names."""


class _InTree(_Stamped, caching.InTreeCacheLocator):
    """Beside the sources."""


class _UserWide(_Stamped, caching.UserWideCacheLocator):
    """The user's cache directory."""


class _ForThisProcess(_Stamped, caching.UserWideCacheLocator):
    """If nothing else can be written: a temporary folder of this process."""

    def get_cache_path(self) -> str:
        return temporary_folder()


@cache
def temporary_folder() -> str:
    """Return a folder that is removed when the process ends."""
    folder = tempfile.TemporaryDirectory(prefix="wheeltapper-")
    atexit.register(folder.cleanup)
    return folder.name


caching.CacheImpl._locator_classes[:0] = [_Environment, _InTree, _UserWide, _ForThisProcess]

_LIBRARY: Any = codegen.JITCodeLibrary
_finalize_shared = _LIBRARY._finalize_final_module


def _finalize_private(library: Any) -> None:
    """Hide a kernel's copies of its callees from the linker, but not from the kernels that will inline them."""
    module = library._final_module
    if any(function.name.startswith(OURS) for function in module.functions):
        library._shared_module = module.clone()
        for function in library._shared_module.functions:
            if not function.is_declaration and function.linkage == llvm.Linkage.external:
                function.linkage = llvm.Linkage.linkonce_odr
        for function in module.functions:
            if function.linkage == llvm.Linkage.linkonce_odr:
                function.linkage = llvm.Linkage.internal
    _finalize_shared(library)


_LIBRARY._finalize_final_module = _finalize_private
_optimize = _LIBRARY._optimize_final_module


class _Levels(threading.local):
    """How many kernels are under way whose compilation has asked for that of the next one."""

    count = 0


_levels = _Levels()


def _is_part() -> bool:
    """Return True while a kernel is compiled, or loaded, as a part of another one."""
    return _levels.count > 1


@contextmanager
def for_itself() -> Iterator[None]:
    """Compile kernels as if Python called them, also where another one asks for it."""
    before, _levels.count = _levels.count, 0
    try:
        yield
    finally:
        _levels.count = before


def _optimize_once(library: Any) -> None:
    """Optimise a kernel's code, but not that of one that is always inlined, or a part: it is optimised where it is."""
    functions = library._final_module.functions
    own = [one for one in functions if one.linkage == llvm.Linkage.external and one.name.startswith(OURS)]
    inlined = any(b"alwaysinline" in attributes for one in own for attributes in one.attributes)
    if not inlined and not (own and _is_part()):
        _optimize(library)


_LIBRARY._optimize_final_module = _optimize_once

_DISPATCHER: Any = numba.core.dispatcher.Dispatcher
_compile, _add_overload, _get_overload = _DISPATCHER.compile, _DISPATCHER.add_overload, _DISPATCHER.get_overload
_signatures = _DISPATCHER.nopython_signatures
_index_key: Any = caching.Cache._index_key


def _is_ours(py_func: Any) -> bool:
    return str(py_func.__module__).startswith("wheeltapper.march")  # what `exec` has made has no module


def _parts_of(kernel: Any) -> dict[Any, Any]:
    """Return the machine code of a kernel as a part of others, by the types of its arguments."""
    return kernel.__dict__.setdefault("parts", {})  # type: ignore[no-any-return]


def _compile_or_load(self: Any, sig: Any) -> Any:
    """Compile or load a kernel, for Python or as a part of another one."""
    if not _is_ours(self.py_func):
        return _compile(self, sig)
    with global_compiler_lock:
        overloads = self.overloads
        _levels.count += 1
        try:
            if _is_part():
                self.overloads = _parts_of(self)
            return _compile(self, sig)
        finally:
            _levels.count -= 1
            self.overloads = overloads


def _keep_overload(self: Any, result: Any) -> None:
    """Keep machine code; Python does not see that of a part, and its call compiles the kernel for itself."""
    if _is_ours(self.py_func) and _is_part():
        self.overloads[tuple(result.signature.args)] = result
    else:
        _add_overload(self, result)


def _called_overload(self: Any, sig: Any) -> Any:
    """Return what is called: by a kernel that is being compiled a part, whatever else there is."""
    if not (_is_ours(self.py_func) and _levels.count):
        return _get_overload(self, sig)
    return _parts_of(self)[tuple(sigutils.normalize_signature(sig)[0])].entry_point


def _called_signatures(self: Any) -> Any:
    """Return the signatures of what can be called."""
    if not (_is_ours(self.py_func) and _levels.count):
        return _signatures.fget(self)
    return [result.signature for result in _parts_of(self).values()]


def _key_of_part(self: Any, sig: Any, codegen: Any) -> Any:
    """Return what machine code is found by in a cache: parts, and what Python calls, lie beside each other."""
    key = _index_key(self, sig, codegen)
    return (*key, "part") if _is_ours(self._py_func) and _is_part() else key


_DISPATCHER.compile, _DISPATCHER.add_overload = _compile_or_load, _keep_overload
_DISPATCHER.get_overload, _DISPATCHER.nopython_signatures = _called_overload, property(_called_signatures)
caching.Cache._index_key = _key_of_part  # type: ignore[method-assign]

kernel = numba.njit(cache=True, error_model="numpy", fastmath=FASTMATH, nogil=True)
inlined_kernel = numba.njit(cache=True, error_model="numpy", fastmath=FASTMATH, nogil=True, forceinline=True)
"""For a kernel that does less than its call costs."""
_njit: Any = numba.njit  # whose types leave out an argument
uncounted_kernel = _njit(cache=True, error_model="numpy", fastmath=FASTMATH, nogil=True, _nrt=False)
inlined_uncounted_kernel = _njit(
    cache=True, error_model="numpy", fastmath=FASTMATH, nogil=True, _nrt=False, forceinline=True
)  # fmt: skip
"""For kernels that make no arrays: nobody counts the references to those that they are given. Counts take time, and are
most of the code where many arrays are passed on."""
plain_kernel = numba.njit(cache=True, error_model="numpy", nogil=True)
"""For results that must be exact to the last digit: sums keep the order in which they are written."""


def is_compiled(dispatcher: Any, arguments: tuple[Any, ...]) -> bool:
    """Return True if machine code of the kernel for such arguments is in memory or in the cache already."""
    if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
        return True
    types = tuple(numba.typeof(argument) for argument in arguments)
    if types in dispatcher.overloads:
        return True
    cache = dispatcher._cache
    return cache._index_key(types, dispatcher.targetctx.codegen()) in cache._cache_file._load_index()
