"""What every test process needs."""

import functools
import hashlib
import os
import sys
import tempfile
from pathlib import Path

from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher

# Hundreds of processes start in these tests. Where Python may not keep byte-code, each compiles all modules anew.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
# The test processes occupy the cores already.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def waiting_for_others(compile_kernel):
    """Let one test process compile a kernel while others that want the same one wait for it, and then load it.

    Locks are taken in the order of calls from kernel to kernel, and within that of this process: nobody waits in a
    circle.
    """

    @functools.wraps(compile_kernel)
    def compile_once(self, sig):
        code = self.py_func.__code__
        name = hashlib.sha256(f"{code.co_filename} {code.co_qualname} {sig}".encode()).hexdigest()
        with global_compiler_lock, (LOCKS / name).open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            return compile_kernel(self, sig)

    return compile_once


try:
    import fcntl
except ImportError:  # Windows, where each process compiles by itself
    pass
else:
    LOCKS = Path(tempfile.gettempdir()) / f"wheeltapper-compiling-{os.getuid()}"
    LOCKS.mkdir(exist_ok=True)
    Dispatcher.compile = waiting_for_others(Dispatcher.compile)
