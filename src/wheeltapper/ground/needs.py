"""What a scenario may ask of a march, as data: nouns say what they need, marches cover it, refusals tell it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Need:
    """One thing that a march may or may not know.

    Attributes
    ----------
    name
        As the table of abilities calls it.
    field
        Path of the scenario's field that brings it.
    words
        What then stands in that field, as a message says it.
    otherwise
        What stands there without it.
    """

    name: str
    field: str
    words: str
    otherwise: str


SEVERAL_BODIES = Need("wagon", "vehicle", "a Wagon", "a Wheelset")
WHEELSETS = Need("several wheelsets", "vehicle", "Wheelsets", "a Wheelset")
BOGIE = Need("bogie", "vehicle", "a Bogie", "a Wheelset")
DAMPER_END = Need("damper's end", "vehicle", "a damper with play or a bush", "a damper without them")
DAMPER_PLAY = Need("damper's play", "vehicle.damper_play", "play of the damper", "0 m")
FRICTION = Need("dry friction", "vehicle", "dry friction in a suspension", "a suspension without dry friction")
BUMPSTOP = Need("bumpstops", "vehicle", "a bumpstop", "a suspension without bumpstops")
SPRING_CORNERS = Need("springs with corners", "vehicle", "a spring with corners", "a linear spring")
BLOW_OFF = Need("blow-off", "vehicle", "a damper that blows off", "a linear damper")
DECK = Need("deck", "track", "a floating deck", "a stiff track")
DECK_ENDS = Need("deck's ends", "track.start", "a deck that begins or ends", "a deck without start, all along the line")
FLEXIBLE_TRACK = Need("rails on sleepers", "track", "rails on sleepers", "a stiff track")
ANOMALY = Need("anomalies", "track.anomalies", "anomalies of the track", "none")
VOID = Need("voids", "track.anomalies", "a void under a sleeper", "anomalies without voids")
YIELDING = Need("elastic-plastic", "contact", "an elastic-plastic contact", "an elastic contact")
ALONE = Need(
    "elastic-plastic, alone", "contact", "an elastic-plastic contact",
    "an elastic contact, rails on sleepers or several wheelsets",
)  # fmt: skip
OWN_LAW = Need("own law", "contact", "a law of one's own", "Hertz")
LINEAR = Need("linear", "contact", "a linear contact", "Hertz")
BILATERAL = Need("bilateral", "contact", "a contact that also pulls", "a contact that only pushes")
HYSTERESIS = Need("hysteresis", "contact", "a contact with hysteresis", "a contact without hysteresis")
CREEP = Need("creep", "creep", "a creep law", "none")
PROFILES = Need("profiles", "profiles", "profiles of wheel and rail", "none")
PLACES = Need("places", "irregularity", "places", "irregularities without places")
IRREGULARITY = Need("irregularity", "irregularity", "an irregularity", "none")
POINT = Need("point rolling", "rolling", '"point"', '"circle"')
START = Need("start", "start", "a displacement or a velocity", '"equilibrium"')
MEMORY = Need("one spot", "speed", "0 m/s on a contact that yields", "more than 0 m/s")

VOCABULARY = (
    SEVERAL_BODIES, WHEELSETS, BOGIE, DAMPER_END, DAMPER_PLAY, FRICTION, BUMPSTOP, SPRING_CORNERS, BLOW_OFF, DECK,
    DECK_ENDS, FLEXIBLE_TRACK, ANOMALY, VOID, YIELDING, ALONE, OWN_LAW, LINEAR, BILATERAL, HYSTERESIS, CREEP, PROFILES,
    PLACES, IRREGULARITY, POINT, START, MEMORY,
)  # fmt: skip
"""All needs, in the order in which they are told: from what makes another model to what is changed most easily."""
NOTHING: frozenset[Need] = frozenset()
KINKS = frozenset({FRICTION, BUMPSTOP, SPRING_CORNERS, BLOW_OFF})
"""What is not linear in a suspension."""
_RANKS = {need: rank for rank, need in enumerate(VOCABULARY)}


def rank_of(need: Need) -> tuple[int, str]:
    """Return where a need stands among all; one that nobody has heard of stands last."""
    return _RANKS.get(need, len(_RANKS)), need.name
