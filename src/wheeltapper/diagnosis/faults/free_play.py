"""Free play at the ends of a damper."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.faults.base import DAMPING, Fault
from wheeltapper.diagnosis.faults.lost_damper import LostDamper
from wheeltapper.diagnosis.inference.problem import Prior

if TYPE_CHECKING:
    from wheeltapper.diagnosis.inference.identify import Estimate
    from wheeltapper.diagnosis.scale import Scale

PLAY, START = "vehicle.damper_play", "vehicle.damper_play_start"
PLAYS, PLACES = (0.06, 0.125, 0.25, 0.5, 1.0), (0.2, 0.5, 0.8)
"""Half the free play that is tried, over the height of the site's irregularity, and positions of the end between its
stops at the start, 0 to 1. With more play the end does not reach its stops, because the wheel moves no further."""
NOTHING = 3.0
"""If the damping is less than this many of its standard deviations above zero, free play so wide that the stops are not
reached explains the recording as well as a lost damper."""


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

    def also(self, verdict: str, estimate: Estimate) -> bool:
        """Return True for a lost damper without any damping: the play may be so wide that no stop is reached."""
        return verdict == LostDamper.name and estimate.deviation(DAMPING) > 1.0 / NOTHING
