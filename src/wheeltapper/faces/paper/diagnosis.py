"""The paper's practical aim: diagnosis of a wheelset from its impacts (section 6)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

import wheeltapper as wt
from wheeltapper.diagnosis.finding import Finding
from wheeltapper.faces.findings import evidence
from wheeltapper.faces.paper.claims import Measure, absolute, claim, relative, within
from wheeltapper.faces.paper.setting import bump, scene

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
    sensor=wt.diagnosis.Sensor(rate=20e3, noise=6.66e-4),
    uncertainty={"speed": 0.1, "vehicle.load": 0.1, "irregularity.0.height": 0.05, "contact.constant": 0.05},
)  # fmt: skip
"""Speed and load differ by ±10 % between passages; bump and contact are known to ±5 %."""


def _heavier(added: float) -> dict[str, float]:
    """Return the vehicle of a passage with more unsprung mass under the same static force."""
    return {"mass": 1500.0 + added, "load": 91_307.0 - 9.81 * added}


def resonance(added: float) -> float:
    """Return the frequency of small oscillations of the wheel on its contact, Hz."""
    indentation = 8.27804275e-5
    record = wt.simulate(
        scene(None, 0.0, 9.0, 0.1, vehicle=_heavier(added), start={"displacement": -1.01 * indentation})
    )
    return 1.0 / float(np.diff(record.peaks.time.values).mean())


@cache
def finding(fault: str) -> Finding:
    """Return the finding on one computed passage."""
    (recording,) = wt.synthesise(SITE, fault=fault, seed=41)
    return wt.diagnose(recording, SITE)


@claim("C41", "diagnosis", "a broken spring shows as a larger unsprung mass")
def broken_spring() -> Iterator[Measure]:
    """Measure resonance and impact interval with a rigid link, and the verdict on a recording of such a passage."""
    healthy, broken = (bump(5e4, 0.12, vehicle=_heavier(added)) for added in (0.0, ADDED))
    yield relative("contact resonance, healthy [Hz]", resonance(0.0), 180.0, 5e-3)
    yield relative("contact resonance, broken [Hz]", resonance(ADDED), 149.7, 5e-3)
    yield relative("first impact interval, healthy [ms]", 1e3 * float(healthy.impacts.interval[0]), 8.703, 5e-3)
    yield relative("first impact interval, broken [ms]", 1e3 * float(broken.impacts.interval[0]), 10.964, 5e-3)
    found = finding("broken spring")
    yield within("probability of a broken spring, from a recording", found.probabilities["broken spring"], 0.9, 1.0)
    yield absolute("added mass, from a recording [kg]", found.size, ADDED, 100.0)


def _draw(figure: Figure) -> None:
    """Draw the evidence for a broken spring."""
    evidence(figure, finding("broken spring"))


DRAW: dict[str, Callable[[Figure], None]] = {"diagnosis": _draw}
