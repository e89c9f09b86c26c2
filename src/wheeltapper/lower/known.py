"""Nouns of which nothing is lowered are refused, and never taken for others in silence."""

from __future__ import annotations

from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic
from wheeltapper.describe.contact.force_law import ForceLaw
from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.contact.linear import Linear
from wheeltapper.describe.creep.fastsim import Fastsim
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.track.deck import FloatingDeck
from wheeltapper.describe.track.stiff import StiffTrack
from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.describe.vehicle.bogie import Bogie
from wheeltapper.describe.vehicle.wagon import Wagon
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.describe.vehicle.wheelsets import Wheelsets
from wheeltapper.ground.errors import InputError

KNOWN: dict[str, tuple[type, ...]] = {
    "vehicle": (Wheelset, Wagon, Wheelsets, Bogie),
    "contact": (Hertz, Linear, ElasticPlastic, ForceLaw),
    "track": (StiffTrack, FloatingDeck, SupportedRail),
}
"""By field of the scenario, what is lowered; the elements of a wagon are in `structure`."""


def check_known(scenario: Scenario) -> None:
    """Refuse what is described only."""
    for field, kinds in KNOWN.items():
        noun = getattr(scenario, field)
        if not (isinstance(noun, kinds) or (field == "vehicle" and hasattr(noun, "plane"))):
            raise _not_lowered_error(field, noun, " or ".join(kind.__name__ for kind in kinds))
    law = scenario.creep
    if law is not None and not isinstance(law, Fastsim) and not hasattr(law, "saturation"):
        raise _not_lowered_error("creep", law, "Fastsim, or a law with a method `saturation`")


def _not_lowered_error(field: str, noun: object, allowed: str) -> InputError:
    return InputError("", field, f"{type(noun).__name__}, of which nothing is lowered", allowed)
