"""Whether a version of Numba compiles the kernels, keeps them, and finds them again; `.ci/numba` runs it for versions.

    uv run --isolated --no-default-groups --with numba==0.62.1 python tools/smoke.py

marches over a bump in two processes with one folder of kernels, empty at first: the second one compiles nothing, and
answers with the same bits; both close the balance of energy. Of Numba's classes none is changed.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile

SCRIPT = """
import json
from numba.core import caching, codegen, compiler, dispatcher, registry
theirs = [caching.Cache, codegen.JITCodeLibrary, compiler.Compiler, dispatcher.Dispatcher, registry.CPUDispatcher]
before = [dict(vars(one)) for one in theirs]
import wheeltapper as wt
scene = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91307, stiffness=2.44e6, damping=5e4),
    contact=wt.Hertz(constant=1.405e11),
    irregularity=wt.CosineBump(height=2e-4, length=0.05, start=0.02),
    rolling="point", speed=9, duration=0.03,
)
record = wt.simulate(scene)
assert abs(float(record.energy.relative_imbalance)) < 1e-9
assert [dict(vars(one)) for one in theirs] == before
print(json.dumps([time.hex() for time in record.events.time.values.tolist()]))
"""


def main() -> None:
    """Run the two processes, and say how it went."""
    import numba

    with tempfile.TemporaryDirectory() as folder:
        place = os.environ | {"WHEELTAPPER_CACHE": folder}
        first, second = (
            subprocess.run([sys.executable, "-c", SCRIPT], env=place, capture_output=True, text=True) for _ in range(2)
        )
    if first.returncode or second.returncode:
        sys.exit(f"numba {numba.__version__}: {first.stderr}{second.stderr}")
    if "compiling" not in first.stderr or second.stderr:
        sys.exit(f"numba {numba.__version__}: first {first.stderr!r}, then {second.stderr!r}")
    if first.stdout != second.stdout or len(json.loads(first.stdout)) < 4:
        sys.exit(f"numba {numba.__version__}: {first.stdout} and {second.stdout}")
    print(f"numba {numba.__version__}: compiled once, found again, the same events")


if __name__ == "__main__":
    main()
