"""What every test process needs."""

import os
import sys

# Hundreds of processes start in these tests. Where Python may not keep byte-code, each compiles all modules anew.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
# The test processes occupy the cores already.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
