"""How long a recording takes to be diagnosed, in a running process, and a folder of recordings.

uv run python benchmarks/folder.py [--count 1000] [--workers 2]
"""

from __future__ import annotations

import tempfile
from collections import Counter
from pathlib import Path
from time import perf_counter

import numpy as np
from options import parser_of

import wheeltapper as wt

MIXED = ("broken spring", "lost damper", "weak damper", "mass deviation", "wheel flat", "free play")
"""Faults of every tenth recording, in turn; the others are healthy."""


def written(site: wt.diagnosis.Site, folder: Path, count: int) -> list[Path]:
    """Write recordings as netCDF files; return them."""
    files = []
    for number in range(count):
        fault = MIXED[number // 10 % len(MIXED)] if number % 10 == 0 else None
        (recording,) = wt.synthesise(site, fault=fault, seed=number)
        files.append(folder / f"{number:04d}.nc")
        wt.diagnosis.write_recording(recording, files[-1])
    return files


def main() -> None:
    """Print times."""
    parser = parser_of(__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    faults, repeats = (None, *MIXED, "rounded flat", "soft bush", "out of round"), 6
    if options.smallest:
        options.count, options.workers, faults, repeats = 2, 1, (None,), 2
    site = wt.load("examples/site.toml")
    for fault in faults:
        took = []
        for seed in range(repeats):
            (recording,) = wt.synthesise(site, fault=fault, seed=seed)
            begun = perf_counter()
            wt.diagnose(recording, site)
            took.append(perf_counter() - begun)
        print(
            f"{fault or 'healthy':16} median {np.median(took[1:]):5.2f} s, longest {max(took[1:]):5.2f} s", flush=True
        )
    with tempfile.TemporaryDirectory() as place:
        files = written(site, Path(place), options.count)
        begun = perf_counter()
        found = wt.diagnosis.diagnose_all(files, site, output=Path(place) / "found", workers=options.workers)
        took_all = perf_counter() - begun
    verdicts = dict(Counter(entry["verdict"] for entry in found))
    print(f"{options.count} recordings of 0.4 s on {options.workers} processes: {took_all:.0f} s, {verdicts}")


if __name__ == "__main__":
    main()
