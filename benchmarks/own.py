"""wheeltapper's side of the comparison: the same cases as scenarios, lowered before the clock starts."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from problems import CASES, Case, Outcome

import wheeltapper as wt
from wheeltapper.lower.build import lower
from wheeltapper.march.common.program import (
    CONTACT,
    DONE,
    EVENT_KIND,
    EVENT_TIME,
    IMPACT,
    LOSS,
    PEAK_CORNER,
    PEAK_FORCE,
    PEAK_TIME,
    PHASE,
    A,
    B,
)
from wheeltapper.march.wheel.single import March, march

Method = Literal["default", "strict"]
DECK = "mass", "stiffness", "damping"


def scenario(case: Case) -> wt.Scenario:
    """Return a case as a user would write it."""
    height, length = float(case.height), float(case.length)
    return wt.Scenario(
        vehicle=wt.Wheelset(
            mass=float(case.mass),
            load=float(case.load),
            stiffness=float(case.stiffness),
            damping=float(case.damping),
            gravity=float(case.gravity),
        ),
        track=wt.FloatingDeck(**dict(zip(DECK, map(float, case.deck), strict=True))) if case.deck else wt.StiffTrack(),
        contact=wt.Hertz(constant=float(case.constant), hysteresis=float(case.hysteresis or 0)),
        irregularity=(
            wt.CosineBump(height=height, length=length, start=0.0)
            if case.is_bump
            else wt.Corrugation(amplitude=height, wavelength=length, start=0.0)
        ),
        rolling="point",
        speed=float(case.speed),
        duration=float(case.duration),
    )


class Marched:
    """The march alone, with one method, prepared for one case."""

    def __init__(self, case: Case, method: Method) -> None:
        self.lowered = lower(scenario(case), method)

    def __call__(self) -> March:
        """March the case once."""
        return march(self.lowered.program)

    def read(self, raw: March) -> Outcome:
        """Put an answer into SI units; maxima at corners of the rail are no zeros of the rate and do not count."""
        if raw.status != DONE:
            raise RuntimeError(f"the march ended with status {raw.status}")
        seconds, newtons = self.lowered.time, self.lowered.force
        times, kinds = raw.events[:, EVENT_TIME] * seconds, raw.events[:, EVENT_KIND]
        smooth = raw.peaks[raw.peaks[:, PEAK_CORNER] == 0.0]
        peak_times, peak_forces = smooth[:, PEAK_TIME] * seconds, smooth[:, PEAK_FORCE] * newtons
        end = np.array([raw.state[A] ** 2, raw.state[B]]) if raw.state[PHASE] == CONTACT else np.full(2, np.nan)
        return Outcome(times[kinds == LOSS], times[kinds == IMPACT], peak_times, peak_forces, end)


class Simulated:
    """What a user calls: `simulate`, from the scenario to the record, prepared for one case."""

    def __init__(self, case: Case, method: Method) -> None:
        self.scene, self.method = scenario(case), method

    def __call__(self) -> wt.Record:
        """Simulate the case once."""
        return wt.simulate(self.scene, method=self.method)

    def read(self, raw: Any) -> Outcome:
        """Return the record's tables."""
        times, kinds = raw.events["time"].to_numpy(), raw.events["kind"].to_numpy()
        smooth = ~raw.peaks["corner"].to_numpy()
        peak_times, peak_forces = (raw.peaks[name].to_numpy()[smooth] for name in ("time", "normal_force"))
        return Outcome(times[kinds == "loss"], times[kinds == "impact"], peak_times, peak_forces, np.full(2, np.nan))


def march_case(name: str, method: Method) -> Marched:
    """Return the march of a case, ready to be called again and again."""
    return Marched(CASES[name], method)


def simulate_case(name: str, method: Method) -> Simulated:
    """Return the whole simulation of a case, ready to be called again and again."""
    return Simulated(CASES[name], method)
