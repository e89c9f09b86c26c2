"""Free play at the ends of a damper."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.faults.base import DAMPING, Fault
from wheeltapper.diagnosis.faults.lost_damper import LostDamper
from wheeltapper.diagnosis.faults.soft_bush import BUSH, SoftBush
from wheeltapper.diagnosis.inference.fitting import fit_over_windows
from wheeltapper.diagnosis.inference.problem import FitProblem, Prior
from wheeltapper.diagnosis.inference.search import ranked
from wheeltapper.diagnosis.inference.timing import untimed, zero_of
from wheeltapper.record.simulate import simulated_quietly

if TYPE_CHECKING:
    from wheeltapper.diagnosis.inference.estimate import Estimate
    from wheeltapper.diagnosis.scale import Scale

PLAY, START = "vehicle.damper_play", "vehicle.damper_play_start"
PLAYS, PLACES = (0.06, 0.125, 0.25, 0.5, 1.0), (0.2, 0.5, 0.8)
"""Half the free play that is tried, over the height of the site's irregularity, and positions of the end between its
stops at the start, 0 to 1. With more play the end does not reach its stops, because the wheel moves no further."""
FREE, LONG = 120.0, 5.4
"""Distance of stops that are out of reach, in static indentations, and the contact periods after the onset, three
impacts at the example's site, for which a wheelset without a damper must explain the recording before stops are looked
for in its motion."""
REACHED, BEYOND = (0.1, 0.25, 0.4, 0.55, 0.7, 0.8, 0.9, 0.97, 0.99), 1.5
"""Distances of the stops that are tried, over the largest displacement of that wheelset: within reach and beyond it."""
NEARER, AWAY = (1.2, 1.45, 1.75), 2.0
"""Factors on the distance of one stop from which a fit starts again, and a factor beyond which no other prior distance
is likely."""
LATER = 3.0
"""Contact periods behind that part of the recording in which models with stops are still compared with it."""
NOTHING = 7.0
"""If the damping of a lost damper, or the stiffness of a soft bush, is less than this many of its standard deviations
above zero, the damper might as well do nothing, as with stops that are hardly reached: χ² differs by less than 50."""


class FreePlay(Fault):
    """A damper whose end moves freely between two stops."""

    name, part, rank = "free play", "damper", 60.0
    meaning = "the damper has play at its ends and acts only where they strike"
    size, unit, usual, path = "half the play", "m", 5e-5, PLAY
    assessed = True
    fields: ClassVar[dict[str, tuple[str, str, float]]] = {PLAY: ("half the damper's play", "um", 1e6)}

    def made(self, passage: Scenario, size: float, place: float) -> Scenario:
        """Return the passage with play; the end begins at `place` between its stops."""
        return passage.replaced({PLAY: size, START: 2.0 * place - 1.0})

    def believed(self, passage: Scenario) -> dict[str, Prior]:
        """Return the priors of play and start."""
        return {PLAY: Prior(6e-5, 1.2, "lognormal"), START: Prior(0.0, 1.0, "uniform")}

    def tried(self, model: Scenario, scale: Scale) -> list[Scenario]:
        """Return passages with several widths and starts."""
        high = scale.height or self.usual / PLAYS[2]  # on a level rail only the wheel itself moves
        return [self.made(model, play * high, place) for play in PLAYS for place in PLACES]

    def shown(self, problem: FitProblem, begins: float) -> list[Scenario]:
        """Return passages with so much play that several impacts are those of a wheelset without a damper.

        The motion of such a wheelset, fitted to what it explains, tells how far away the stops can be. The nearest
        models with an upper, a lower, and both stops within reach are taken.
        """
        far = FREE * problem.scale.indentation
        free = problem.from_model(self._stopped(problem.start, far, far))
        fit = fit_over_windows(free, begins)
        until = min(fit.held, float(problem.times[-1]))
        if until < begins + LONG * problem.scale.period:
            return []
        times = problem.times[problem.times <= until] - zero_of(fit.scenario)
        record = simulated_quietly(untimed(fit.scenario).replaced({"duration": float(times[-1])}))
        moved = record.at(times[times >= 0.0]).wheel_displacement.values
        up, down = float((moved - moved[0]).max()), float((moved[0] - moved).max())
        sides = (
            [(a, BEYOND) for a in REACHED],
            [(BEYOND, b) for b in REACHED],
            [(a, b) for a in REACHED for b in REACHED],
        )
        models = ([self._stopped(fit.scenario, a * up, b * down) for a, b in side] for side in sides)
        until += LATER * problem.scale.period
        return [near for side in models for near in ranked(free, side, begins, until)[:1]]

    def beside(self, found: Scenario) -> list[Scenario]:
        """Return passages with one stop further away, or nearer: a fit may end where it just comes into reach."""
        return self._moved(found, (*NEARER, *(1.0 / factor for factor in NEARER)))

    def unseen(self, found: Scenario) -> list[Scenario]:
        """Return passages with one stop out of reach."""
        return self._moved(found, (AWAY,))

    def _moved(self, found: Scenario, factors: tuple[float, ...]) -> list[Scenario]:
        """Return passages with one stop at some times its distance."""
        half, start = float(found.vehicle.damper_play), float(found.vehicle.damper_play_start)
        up, down = half * (1.0 - start), half * (1.0 + start)
        pairs = [pair for factor in factors for pair in ((factor * up, down), (up, factor * down))]
        return [self._stopped(found, *pair) for pair in pairs]

    def _stopped(self, passage: Scenario, up: float, down: float) -> Scenario:
        """Return a passage whose damper's end is so far below the upper and above the lower stop at the start, m."""
        return self.made(passage, 0.5 * (up + down), down / (up + down))

    def also(self, verdict: str, estimate: Estimate) -> bool:
        """Return True where the damper does so little that the stops may hardly be reached."""
        path = {LostDamper.name: DAMPING, SoftBush.name: BUSH}.get(verdict)
        return path is not None and estimate.deviation(path) > 1.0 / NOTHING
