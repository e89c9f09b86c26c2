"""What every test process needs."""

import os
import sys
from collections import Counter

import pytest

# Hundreds of processes start in these tests. Where Python may not keep byte-code, each compiles all modules anew.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
# The test processes occupy the cores already.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Of a test that has `few(n)`, mark all cases but the first n as slow and `whole`."""
    cases = Counter()
    for item in items:
        few = item.get_closest_marker("few")
        if few is not None:
            cases[item.parent, item.originalname] += 1
            if cases[item.parent, item.originalname] > few.args[0]:
                item.add_marker("slow")
                item.add_marker("whole")
