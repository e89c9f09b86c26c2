"""Errors of identified parameters against the Cramér-Rao bound, over many computed recordings.

uv run python benchmarks/identification.py [--count 1000] [--level calibrated] [--workers 2]

At the reference site (deck of 15 t, bump of 0.2 mm x 50 mm, 9 m/s, 40 dB, 20 kHz) mass and damping are unknown, and
what else is uncertain grows from level to level. Each recording's truth is drawn from what is uncertain.
"""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np
from options import parser_of

import wheeltapper as wt
from wheeltapper.diagnosis import identify
from wheeltapper.diagnosis.inference.estimate import priors_of
from wheeltapper.diagnosis.inference.fitting import covariance_of
from wheeltapper.diagnosis.inference.problem import FitProblem
from wheeltapper.diagnosis.processes import in_processes

UNKNOWN = ("vehicle.mass", "vehicle.damping")
TRUE = (1500.0, 5e4)
KNOWN = {"speed": 0.01, "vehicle.load": 0.05, "vehicle.stiffness": 0.2}
LEVELS = {
    "calibrated": KNOWN,
    "h, C": KNOWN | {"irregularity.0.height": 0.05, "contact.constant": 0.05},
    "all": KNOWN
    | {
        "irregularity.0.height": 0.05, "contact.constant": 0.1, "vehicle.radius": 0.04, "track.mass": 0.01,
        "track.stiffness": 0.05, "track.damping": 0.2,
    },
}  # fmt: skip
GOALS = {"calibrated": (0.1, 0.3), "h, C": (2.5, 3.0), "all": (4.0, 4.0)}
SIGMA, RATE = 0.0666, 20e3


def site(level: str) -> wt.diagnosis.Site:
    """Return the reference site."""
    passage = wt.Scenario(
        vehicle=wt.Wheelset(mass=TRUE[0], load=91_307, stiffness=2.44e6, damping=TRUE[1]),
        contact=wt.Hertz(constant=1.405e11),
        track=wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4),
        irregularity=wt.CosineBump(height=2e-4, length=0.05, start=0.009),
        speed=9.0,
        duration=0.2111,
    )
    sensor = wt.diagnosis.Sensor(rate=RATE, noise=SIGMA / np.sqrt(RATE / 2))
    return wt.diagnosis.Site(passage=passage, sensor=sensor, uncertainty=LEVELS[level])


def one(where: wt.diagnosis.Site, seed: int) -> dict[str, Any]:
    """Return errors and bounds of ln m and ln c, and whether intervals cover, of one recording."""
    (recording,) = wt.synthesise(where, seed=seed)
    begun = perf_counter()
    found = identify(recording, where)
    took = perf_counter() - begun
    truth = FitProblem(recording, where.sensor, SIGMA, recording.truth["scenario"], priors_of(where, UNKNOWN))
    whole = truth.jacobian(np.zeros(len(truth.paths)), len(recording.samples), SIGMA)
    assert whole is not None
    errors = [np.log(found[path] / true) for path, true in zip(UNKNOWN, TRUE, strict=True)]
    ends = [found.interval(path) for path in UNKNOWN]
    return {
        "errors": errors,
        "bounds": np.sqrt(np.diag(covariance_of(whole)))[:2],
        "covered": [low < true < high for (low, high), true in zip(ends, TRUE, strict=True)],
        "converged": found.converged,
        "seconds": took,
    }


def main() -> None:
    """Print one line per level."""
    parser = parser_of(__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--level", choices=LEVELS)
    parser.add_argument("--workers", type=int)
    options = parser.parse_args()
    if options.smallest:
        options.count, options.level, options.workers = 2, "calibrated", 1
    heads = (("rms m, c [%]", 16), ("goal", 9), ("over bound", 14), ("90 % cover", 15), ("conv.", 7), ("s", 5))
    print("level".ljust(11), *(head.rjust(width) for head, width in heads))
    for level in [options.level] if options.level else LEVELS:
        found = [entry for _, entry in in_processes(one, site(level), range(options.count), options.workers)]
        errors, bounds = (np.array([entry[name] for entry in found]) for name in ("errors", "bounds"))
        rms = 100 * np.sqrt((errors**2).mean(axis=0))
        ratio = np.sqrt(((errors / bounds) ** 2).mean(axis=0))
        cover = 100 * np.mean([entry["covered"] for entry in found], axis=0)
        converged = 100 * np.mean([entry["converged"] for entry in found])
        print(
            f"{level:11} {rms[0]:8.4f} {rms[1]:7.4f} {GOALS[level][0]:4g} {GOALS[level][1]:4g} {ratio[0]:7.3f} "
            f"{ratio[1]:6.3f} {cover[0]:8.1f} {cover[1]:6.1f} {converged:7.1f} "
            f"{np.median([entry['seconds'] for entry in found]):5.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
