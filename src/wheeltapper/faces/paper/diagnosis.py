"""The paper's practical aim: diagnosis of a wheelset from its impacts (section 6)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from math import pi, sqrt
from typing import TYPE_CHECKING

import numpy as np

import wheeltapper as wt
from wheeltapper.diagnosis.finding import Finding
from wheeltapper.faces.findings import draw_evidence
from wheeltapper.faces.paper.claims import PINNED, Measure, analysis, claim, said
from wheeltapper.faces.paper.setting import CONSTANT, STATIC_INDENTATION, bump, scene
from wheeltapper.faces.paper.single import DIGITS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ADDED = 670.0
"""Mass, kg, that a rigid link in place of a broken spring adds."""
SITE = wt.diagnosis.Site(
    name="the paper's bump on a deck of ten wheelsets",
    passage=scene(
        wt.CosineBump(height=2e-4, length=0.05, start=0.009), 5e4, 9.0, 0.2,
        track=wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4),
    ),
    sensor=wt.sensors.DeckAcceleration(rate=20e3, noise=6.66e-4),
    uncertainty={"speed": 0.1, "vehicle.load": 0.1, "irregularity.0.height": 0.05, "contact.constant": 0.05},
)  # fmt: skip
"""Speed and load differ by ±10 % between passages; bump and contact are known to ±5 %."""


def _with_added_mass(added: float) -> dict[str, float]:
    """Return the vehicle of a passage with more unsprung mass under the same static force."""
    return {"mass": 1500.0 + added, "load": 91_307.0 - 9.81 * added}


def resonance(added: float) -> float:
    """Return the frequency of small oscillations of the wheel on its contact, Hz."""
    start = {"displacement": -(1.0 + 1e-4) * STATIC_INDENTATION}
    record = wt.simulate(scene(None, 0.0, 9.0, 0.1, vehicle=_with_added_mass(added), start=start), "strict")
    return 1.0 / float(np.diff(record.peaks.time.values).mean())


@cache
def finding_on_passage(fault: str) -> Finding:
    """Return the finding on one computed passage."""
    (recording,) = wt.synthesise(SITE, fault=fault, seed=41)
    return wt.diagnose(recording, SITE)


@claim("C41", "diagnosis", "a broken spring shows as a larger unsprung mass")
def broken_spring() -> Iterator[Measure]:
    """Measure resonance and impact interval with a rigid link, and the verdict on a recording of such a passage."""
    healthy, broken = (bump(5e4, 0.12, vehicle=_with_added_mass(added)) for added in (0.0, ADDED))
    for words, added in (("healthy", 0.0), ("broken", ADDED)):
        linear = sqrt((1.5 * CONSTANT * sqrt(STATIC_INDENTATION) + 2.44e6) / (1500.0 + added)) / (2 * pi)
        source = analysis("√((1.5·C·√δ₀ + k)/m)/2π")
        yield source.relative(f"contact resonance, {words} [Hz]", resonance(added), linear, 1e-6)
    before, after = (1e3 * float(record.impacts.interval[0]) for record in (healthy, broken))
    yield said(
        "lower", "section 6", "frequency of impacts with a broken spring, over that of a healthy one", before / after
    )
    yield DIGITS.relative("first impact interval, healthy [ms]", before, 8.703293, 1e-6)
    yield PINNED.relative("first impact interval, broken [ms]", after, 10.9635)
    found = finding_on_passage("broken spring")
    likely = found.probabilities["broken spring"]
    yield said(
        "in most cases", "section 6: can be detected", "probability of a broken spring, from a recording", likely
    )
    yield PINNED.within("probability of a broken spring, from a recording", likely, 0.99, 1.0, "one noisy recording")
    noisy = "one noisy recording, of which the standard deviation is 34 kg"
    yield PINNED.absolute("added mass, from a recording [kg]", found.size, ADDED, 100.0, noisy)


def _draw_evidence(figure: Figure) -> None:
    """Draw the evidence for a broken spring."""
    draw_evidence(figure, finding_on_passage("broken spring"))
    figure.suptitle("C41: a computed passage with a broken spring, diagnosed")


DRAW: dict[str, Callable[[Figure], None]] = {"diagnosis": _draw_evidence}
