"""How well the reference site tells faults: areas under the ROC, false calls, flats by size.

uv run python benchmarks/faults.py [--count 250] [--healthy 1000] [--output faults.jsonl] [--workers 2]

Speed and load differ by ±10 % from passage to passage, bump and contact constant are known to ±5 %, the deck is known.
"""

from __future__ import annotations

import numpy as np
from options import parser_of

import wheeltapper as wt
from wheeltapper.diagnosis.performance import Sizes

PLAIN: dict[str, tuple[str, Sizes, float]] = {
    "broken spring": ("broken spring", None, 0.999),
    "lost damper": ("lost damper", 0.2, 0.999),
    "damper at 0.7 c": ("weak damper", 0.7, 0.99),
    "mass +10 %": ("mass deviation", 1.1, 0.99),
    "mass -10 %": ("mass deviation", 0.9, 0.99),
    "free play 50 um": ("free play", 5e-5, 0.99),
    "free play 20 to 300 um": ("free play", (2e-5, 3e-4), 0.99),
}
"""Fault, its size, and the goal for the area; of free play, which is only to be named, the others'."""
FLATS = {"20 to 80 mm": (0.02, 0.08)}


def site(duration: float, clips: bool) -> wt.diagnosis.Site:
    """Return the reference site, with a sensor that clips at 80 m/s² or without bound."""
    held = wt.load("examples/site.toml")
    sensor = held.sensor if clips else held.sensor.model_copy(update={"range": None, "bits": None})
    passage = held.passage.replaced({"duration": duration})
    return wt.diagnosis.Site.model_validate(held.model_dump() | {"passage": passage, "sensor": sensor})


def main() -> None:
    """Print one line per fault."""
    parser = parser_of(__doc__)
    parser.add_argument("--count", type=int, default=250)
    parser.add_argument("--healthy", type=int, default=1000)
    parser.add_argument("--output")
    parser.add_argument("--workers", type=int)
    options = parser.parse_args()
    plain, flats = PLAIN, FLATS
    if options.smallest:
        options.count, options.healthy, options.workers = 2, 2, 1
        plain, flats = {"lost damper": PLAIN["lost damper"]}, {}
    often = {"count": options.count, "output": options.output, "workers": options.workers}
    sound = None
    print(f"{'fault':24} {'AUC':>8} {'95 % from':>10} {'goal':>6} {'named':>7} {'rms size error':>15}")
    for words, (fault, size, area) in plain.items():
        found = wt.diagnosis.assess(site(0.2111, True), {fault: size}, healthy=options.healthy, seed=1, **often)
        one, sound = found.faults[fault], found
        print(
            f"{words:24} {one.roc.auc:8.5f} {one.roc.interval()[0]:10.4f} {area:6g} {one.named:7.3f} "
            f"{one.size_error:15.3g}",
            flush=True,
        )
    assert sound is not None
    calls = sound.false_calls
    print(f"false calls: {calls.count} of {calls.axles}, per 1,000 (95 %): {calls.lower:.3g} to {calls.upper:.3g}")
    for words, size in flats.items():
        for clips in (False, True):
            found = wt.diagnosis.assess(site(0.4, clips), {"wheel flat": size}, healthy=2, seed=2, **often)
            one = found.faults["wheel flat"]
            errors = np.array([p.estimated - p.size for p in one.passages])
            worst = np.nanmax(np.abs(errors))
            print(
                f"flats of {words}, {'clipped' if clips else 'not clipped'}: named {one.named:.3f}, rms "
                f"{1e3 * one.size_error:.4f} mm, worst {1e3 * worst:.4f} mm, {np.isnan(errors).sum()} not sized",
                flush=True,
            )


if __name__ == "__main__":
    main()
