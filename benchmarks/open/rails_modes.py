"""Write cases/rails_modes.csv: the modes of the ring of bays that this package makes of a published track.

python benchmarks/open/rails_modes.py
"""

from __future__ import annotations

from itertools import product

import numpy as np
from reading import HERE

import wheeltapper as wt
from wheeltapper.lower.track.ring import ring_of
from wheeltapper.lower.track.section import section_of

TRACK, BAYS, CUTOFF = "rolland_UIC60_example", 12, 1000.0


def main() -> None:
    ring = ring_of(section_of(wt.tracks.Ballasted.named(TRACK)), BAYS, CUTOFF).ring
    rows: list[tuple[object, ...]] = []
    for n, rate in enumerate(ring.rates.tolist()):
        rows += [("rate", "", n, "re", rate.real), ("rate", "", n, "im", rate.imag)]
        number = round(float(np.angle(ring.turns[n])) * BAYS / (2 * np.pi))  # of the wave, of the ring
        rows += [("wave", "", n, "re", float(number)), ("weight", "", n, "re", float(ring.weights[n]))]
    shapes = (("Phi", ring.deflection), ("Psi", ring.drive))
    for (name, shape), element in product(shapes, range(len(ring.residual))):
        for n, part in product(range(len(ring.rates)), ("re", "im")):
            values = shape[element, :, n].real if part == "re" else shape[element, :, n].imag
            rows.append((name, element, n, part, *values.tolist()))
    rows += [("r", element, "", "re", *values) for element, values in enumerate(ring.residual.tolist())]
    head = "quantity,element,mode,part," + ",".join(f"p{k}" for k in range(ring.residual.shape[1]))
    lines = [head, *(",".join(map(str, row)) for row in rows)]
    (HERE / "cases" / "rails_modes.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(f"{len(ring.rates)} modes")


if __name__ == "__main__":
    main()
