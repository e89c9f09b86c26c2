"""What a designed rail tells more than bumps do: gains in the determinant, and which calibration stands in the way.

uv run python benchmarks/design.py [--number 2] [--length 2] [--budget 3000] [--shapes bump,dip] [--seed 0]

The unknowns are mass and damping, at 6, 9 and 12 m/s, with at most 400 kN. The rails found are judged once more with
one of the uncertain quantities, or all, known exactly.
"""

from __future__ import annotations

from time import perf_counter

from identification import KNOWN, LEVELS, UNKNOWN, site
from options import parser_of

import wheeltapper as wt
from wheeltapper.diagnosis.inference.information import information
from wheeltapper.diagnosis.site.design import Design
from wheeltapper.diagnosis.site.layout import laid_out

SPEEDS = (6.0, 9.0, 12.0)
CALIBRATED = {"irregularity.0.height": 0.005, "contact.constant": 0.02, "vehicle.radius": 0.002, "track.mass": 0.003}
"""Standard deviations over the values where the site has been calibrated."""


def known(uncertainty: dict[str, float]) -> wt.diagnosis.Site:
    """Return the reference site with another state of calibration."""
    return wt.diagnosis.Site.model_validate(site("all").model_dump() | {"uncertainty": uncertainty})


def main() -> None:
    """Print gains."""
    parser = parser_of(__doc__)
    parser.add_argument("--number", type=int, default=2)
    parser.add_argument("--length", type=float, default=2.0)
    parser.add_argument("--budget", type=int, default=3000)
    parser.add_argument("--shapes", default="bump,dip")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", choices=("calibrated", "uncalibrated"))
    options = parser.parse_args()
    if options.smallest:
        options.budget, options.only = 4, "calibrated"
    states = {"uncalibrated": LEVELS["all"], "calibrated": KNOWN | CALIBRATED}
    for state in [options.only] if options.only else states:
        begun = perf_counter()
        found = wt.design_site(
            known(states[state]), UNKNOWN, SPEEDS, budget=options.budget, seed=options.seed,
            rail={"number": options.number, "total_length": options.length, "shapes": options.shapes.split(",")},
        )  # fmt: skip
        print(f"{state}, {perf_counter() - begun:.0f} s: {found}", flush=True)
        if options.smallest:
            return
        in_the_way(found, states[state], tuple(CALIBRATED if state == "calibrated" else LEVELS["all"]))


def in_the_way(found: Design, uncertainty: dict[str, float], paths: tuple[str, ...]) -> None:
    """Print the gains were one of the uncertain quantities exactly known, or all."""
    duration = float(found.site.passage.duration)
    for exact in (*((path,) for path in paths), paths):
        left = known({path: share for path, share in uncertainty.items() if path not in exact})
        told = [
            information(laid_out(left, one.layout, duration), UNKNOWN, SPEEDS)
            for one in (found.single, found.repeated, found.alike, found.best)
        ]
        gains = [told[-1].determinant / one.determinant for one in told[:-1]]
        worst = [100.0 * float(one.deviation(UNKNOWN[0]).max()) for one in told]
        print(
            f"exactly known {', '.join(exact)}: {gains[0]:.2f} x single, {gains[1]:.2f} x repeated, "
            f"{gains[2]:.2f} x alike; mass within {', '.join(f'{share:.3f}' for share in worst)} %",
            flush=True,
        )


if __name__ == "__main__":
    main()
