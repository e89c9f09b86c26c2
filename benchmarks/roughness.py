"""Compare the force on a rough rail with linear theory, in third-octaves, over many realisations of the roughness.

    uv run python benchmarks/roughness.py [--realisations 20] [--parts 6 1]

Zhai's track, and the same with each seat split into six, 0.1 m apart; 20 m/s, roughness at the limit of ISO 3095:2013,
filtered by a patch of contact of 5 mm. Printed are the differences in dB for each band from 50 to 2000 Hz. With
seats 0.6 m apart the run over a level rail, which passes sleepers at 33 Hz and its multiples, is not in the theory.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from options import parser_of

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests import roughness


def compare(parts: int, realisations: int) -> None:
    """Print the mean difference of levels, and its spread."""
    rails = roughness.track(parts)
    response = roughness.linear_response(rails, rails.spacing * (np.arange(4) + 0.5) / 4)
    found, lost, took = [], 0, 0.0
    for seed in range(1, realisations + 1):
        rough = roughness.roughness(seed)
        began = time.perf_counter()
        record = roughness.marched(rough, rails)
        took += time.perf_counter() - began
        lost += int((record.events.kind == "loss").sum())
        found.append(roughness.marched_levels(record) - roughness.linear_levels(rough, response))
    power = np.mean(found, axis=0)
    seconds = realisations * (roughness.SETTLING + roughness.LENGTH / roughness.SPEED)
    print(f"seats {rails.spacing:g} m apart: {realisations} realisations, {seconds:.3g} s of running in {took:.3g} s")
    print(f"  losses of contact: {lost}; largest difference {np.abs(power).max():.3f} dB")
    for middle, mean, spread in zip(roughness.BANDS, power, np.std(found, axis=0), strict=True):
        print(f"  {middle:6.0f} Hz  {mean:+.3f} dB, spread {spread:.3f}")


def main() -> None:
    """Run what was asked."""
    parser = parser_of(__doc__)
    parser.add_argument("--realisations", type=int, default=20)
    parser.add_argument("--parts", type=int, nargs="+", default=[6, 1])
    asked = parser.parse_args()
    if asked.smallest:
        asked.realisations, asked.parts = 1, [1]
    for parts in asked.parts:
        compare(parts, asked.realisations)


if __name__ == "__main__":
    main()
