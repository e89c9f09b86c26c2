"""The one door to the marches: which march takes what, what each question covers, and the only refusal.

A scenario says what it needs (`Noun.needs`), a march what it covers, a question which marches answer it, the fastest
first. `choose` compares, and refuses with one sentence. `march` takes a program to its march, and returns what can be
asked further; no kernel is imported before.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, overload

from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import (
    ALONE,
    ANOMALY,
    BILATERAL,
    BOGIE,
    CREEP,
    DAMPER_END,
    DAMPER_PLAY,
    DECK,
    DECK_ENDS,
    FLEXIBLE_TRACK,
    HYSTERESIS,
    IRREGULARITY,
    KINKS,
    LINEAR,
    MEMORY,
    NOTHING,
    OWN_LAW,
    PLACES,
    POINT,
    PROFILES,
    SEVERAL_BODIES,
    START,
    VOID,
    WHEELSETS,
    YIELDING,
    Need,
    rank_of,
)
from wheeltapper.march.common.kept import Held
from wheeltapper.march.common.program import FloatArray, Program
from wheeltapper.march.common.telling import Tell, report_nothing
from wheeltapper.march.general.contract import Task
from wheeltapper.march.wagon.assembly import Assembly

if TYPE_CHECKING:
    from wheeltapper.march.general.task import Marched
    from wheeltapper.march.wagon.march import Marched as MarchedWagon
    from wheeltapper.march.wagon.rails.march import OnRails
    from wheeltapper.march.wagon.remembering import OverMarks
    from wheeltapper.march.wheel.march import Marched as MarchedWheel

    Wagons = Assembly | OnRails | OverMarks
    """Programs of the wagon's marches."""


LOCKSTEP, AS_OBJECTS, SHARING_TABLES, ALONE_EACH = "in lockstep", "as objects", "sharing tables", "alone"
"""How a march takes the cells of a map."""


@dataclass(frozen=True, eq=False)
class Marcher:
    """A march, and what it knows.

    Attributes
    ----------
    name
        As users are told.
    covers
        What it takes.
    requires
        What it is for, and does nothing without.
    cells
        How it marches the cells of a map: LOCKSTEP, eight at a time; AS_OBJECTS, lowered together; SHARING_TABLES of
        the track; or ALONE_EACH, which share nothing.
    """

    name: str
    covers: frozenset[Need]
    requires: frozenset[Need] = NOTHING
    cells: str = ALONE_EACH


_ONE_WHEEL = frozenset({DECK, DECK_ENDS, IRREGULARITY, POINT, START})
WHEEL = Marcher("the wheelset's march", _ONE_WHEEL | {LINEAR, BILATERAL, HYSTERESIS}, cells=LOCKSTEP)
YIELDING_WHEEL = Marcher(
    "the yielding contact's march", _ONE_WHEEL | {YIELDING, ALONE, MEMORY}, frozenset({YIELDING}), AS_OBJECTS
)  # fmt: skip
ENDED_WHEEL = Marcher(
    "the march with a damper's end", _ONE_WHEEL | {LINEAR, HYSTERESIS, DAMPER_END, DAMPER_PLAY},
    frozenset({DAMPER_END}), LOCKSTEP,
)  # fmt: skip
WAGON = Marcher(
    "the wagon's march",
    frozenset({
        SEVERAL_BODIES, DECK, DECK_ENDS, CREEP, PROFILES, PLACES, IRREGULARITY, POINT, OWN_LAW, LINEAR, BILATERAL,
        HYSTERESIS, YIELDING, START,
    }),
    frozenset({SEVERAL_BODIES}),
)  # fmt: skip
WAGON_ON_RAILS = Marcher(
    "the wagon's march on rails",
    frozenset({
        SEVERAL_BODIES, FLEXIBLE_TRACK, ANOMALY, VOID, CREEP, PROFILES, PLACES, IRREGULARITY, POINT, OWN_LAW, LINEAR,
        BILATERAL, HYSTERESIS, YIELDING, START,
    }),
    frozenset({SEVERAL_BODIES, FLEXIBLE_TRACK}),
)  # fmt: skip
GENERAL = Marcher(
    "the general march",
    frozenset({
        DAMPER_END, DAMPER_PLAY, DECK, DECK_ENDS, FLEXIBLE_TRACK, ANOMALY, VOID, WHEELSETS, BOGIE, YIELDING, OWN_LAW,
        LINEAR, BILATERAL, HYSTERESIS, PLACES, IRREGULARITY, POINT, START, *KINKS,
    }), cells=SHARING_TABLES,
)  # fmt: skip
WHEELS = (WHEEL, YIELDING_WHEEL, ENDED_WHEEL)
MARCHERS = (*WHEELS, WAGON, WAGON_ON_RAILS, GENERAL)
"""All marches, the fastest first."""
ROW = Marcher("the march of wheelsets in a row", frozenset({DECK, DECK_ENDS, IRREGULARITY, POINT, DAMPER_END}))
"""The wagon's march, where wheelsets that share a deck are made a wagon: it knows a bush, but no play."""


PARTING = replace(GENERAL, covers=GENERAL.covers - {BILATERAL})
"""The general march of contacts that can be lost."""
UNDAMPED_WAGONS = tuple(
    replace(one, covers=one.covers - {HYSTERESIS, BILATERAL}) for one in (WAGON, WAGON_ON_RAILS)
)  # fmt: skip
"""The wagon's marches of contacts that lose their force where they part, and only there."""
_TURNED = GENERAL.covers - {ANOMALY, VOID, DAMPER_PLAY, DECK_ENDS, *KINKS}
TURNED = (
    replace(GENERAL, covers=_TURNED - {DAMPER_END}),
    replace(GENERAL, covers=_TURNED, requires=frozenset({FLEXIBLE_TRACK})),
)
"""The general march of contacts that all go along the track, on the same bodies, where it also simulates: the end of a
damper on a stiff track or a deck is another march's."""


@dataclass(frozen=True, eq=False)
class Question:
    """What can be asked of a scenario.

    Attributes
    ----------
    name
        As users call it.
    meaning
        What it asks, for the table of abilities.
    marchers
        The marches that answer it, the fastest first.
    lacks
        What they know, but this question does not.
    requires
        What it is about, and makes no sense without.
    others
        Names of questions that may answer where this one does not.
    """

    name: str
    meaning: str
    marchers: tuple[Marcher, ...]
    lacks: frozenset[Need] = NOTHING
    requires: frozenset[Need] = NOTHING
    others: tuple[str, ...] = ("simulate",)

    def covered_by(self, marcher: Marcher) -> frozenset[Need]:
        """Return what a march covers of this question."""
        return marcher.covers - self.lacks

    def missing_needs(self, marcher: Marcher, needs: frozenset[Need]) -> tuple[Need, ...]:
        """Return what keeps a march from answering: needs that it does not cover, and what is required and missing."""
        wrong = (needs - self.covered_by(marcher)) | ((marcher.requires | self.requires) - needs)
        return tuple(sorted(wrong, key=rank_of))


_SITE, _SPOT = frozenset({DECK, IRREGULARITY}), frozenset({MEMORY})
_STEADY = frozenset({START, YIELDING})
_ELASTIC = frozenset({OWN_LAW, LINEAR, BILATERAL, HYSTERESIS})
SIMULATE = Question("simulate", "the motion with all its events", MARCHERS, others=())
HISTORY = Question("history", "everything over time, and at any time", MARCHERS, others=())
ENERGY = Question("energy", "the energy balance", MARCHERS, others=())
FEATURES = Question("features", "a feature of a record", MARCHERS, others=())
DAMPER_EVENTS = Question("damper_events", "stops that a damper's end meets", (*WHEELS, GENERAL), others=())
SUSPENSION_EVENTS = Question(
    "suspension_events", "where friction slips and sticks, and corners of springs and dampers", MARCHERS,
    others=(),
)  # fmt: skip
TRACK = Question(
    "track", "what rail, sleepers and ballast do", (GENERAL, WAGON_ON_RAILS), requires=frozenset({FLEXIBLE_TRACK})
)
COMFORT = Question("comfort", "ride comfort", (WAGON, WAGON_ON_RAILS))
GUIDANCE = Question("guidance", "guiding forces, Y/Q and T-gamma", (WAGON, WAGON_ON_RAILS))
SWEEP = Question("sweep", "features over many cells", (*WHEELS, GENERAL, WAGON, WAGON_ON_RAILS))
GRADIENT = Question(
    "gradient", "derivatives of features", (WHEEL, *TURNED, WAGON, WAGON_ON_RAILS), frozenset({YIELDING})
)
BORDER = Question("border", "where contact begins to be lost", (*WHEELS, PARTING, *UNDAMPED_WAGONS))
MOTION_AT = Question("motion_at", "force and deck's acceleration at given times", WHEELS)
TRAJECTORY = Question("trajectory", "these with exact derivatives", (WHEEL,), others=("simulate", "motion_at"))
DIAGNOSE = Question("diagnose", "the faults that a site's recordings show", WHEELS, _SPOT, _SITE)
INFORMATION = Question(
    "information", "what a site's recordings can tell, and its design", (WHEEL,), requires=_SITE,
    others=("simulate", "diagnose"),
)  # fmt: skip
COUPLED = Question(
    "coupled=True", "a train's wheelsets that share a deck", (ROW,), requires=_SITE, others=("coupled=False",)
)
SUPERPOSED = Question("coupled=False", "the same, each as if alone", WHEELS, _SPOT, _SITE, others=())
WEAR_IN = Question(
    "wear_in", "the evolution of a rail under many wheels", (YIELDING_WHEEL, GENERAL, WAGON, WAGON_ON_RAILS),
    _SPOT | _ELASTIC, frozenset({POINT, YIELDING}),
)  # fmt: skip
MARKS = Question(
    "marks", "the marks that a run leaves", (YIELDING_WHEEL, GENERAL, WAGON, WAGON_ON_RAILS), _SPOT | _ELASTIC,
    frozenset({YIELDING}),
)  # fmt: skip
MODES = Question("modes", "small vibrations about the steady run", (WAGON,), _STEADY)
CRITICAL_SPEED = Question("critical_speed", "where hunting begins", (WAGON,), _STEADY, frozenset({CREEP}))
REDUCED = Question("reduced", "the core model of one wheelset of a wagon", (WAGON,), _STEADY)
ORBITS = Question(
    "orbits", "periodic motions over a periodic irregularity", (WHEEL,), frozenset({DECK_ENDS}),
    frozenset({IRREGULARITY}), others=("simulate", "sweep"),
)  # fmt: skip
IMBALANCE = Question("imbalance", "a car body whose load lies aside", (WAGON,), _STEADY)
QUESTIONS = {
    question.name: question
    for question in (
        SIMULATE, HISTORY, ENERGY, FEATURES, DAMPER_EVENTS, SUSPENSION_EVENTS, TRACK, COMFORT, GUIDANCE, SWEEP,
        GRADIENT, BORDER, MOTION_AT, TRAJECTORY, DIAGNOSE, INFORMATION, COUPLED, SUPERPOSED, WEAR_IN, MARKS, MODES,
        CRITICAL_SPEED, REDUCED, IMBALANCE, ORBITS,
    )
}  # fmt: skip
"""All questions by name."""


# -- choosing, and refusing -------------------------------------------------------------------------------------------


@lru_cache(maxsize=1024)
def fastest_march(question: Question, needs: frozenset[Need]) -> Marcher | None:
    """Return the fastest march that answers a question about what needs so much; None where none does."""
    return next((marcher for marcher in question.marchers if not question.missing_needs(marcher, needs)), None)


def choose(question: Question, needs: frozenset[Need], field: str = "") -> Marcher:
    """Return the fastest march that answers a question about what needs so much.

    Parameters
    ----------
    question
        What is asked.
    needs
        Of the scenario.
    field
        Path that is to be blamed; by default that of the need.

    Raises
    ------
    InputError
        If none does: what is not covered, and what would do.
    """
    found = fastest_march(question, needs)
    if found is None:
        raise refusal(question, needs, field)
    return found


def refusal(question: Question, needs: frozenset[Need], field: str = "") -> InputError:
    """Return why no march answers a question, as one sentence."""
    lacks = {marcher: question.missing_needs(marcher, needs) for marcher in question.marchers}
    common = set.intersection(*map(set, lacks.values()))
    if common:  # no march has it
        return _refusal_sentence(question, needs, field, min(common, key=rank_of))
    # Each march lacks something else: two needs that do not go together, the more easily changed one first.
    need = min(lacks.values(), key=lambda wrong: (_field_count(wrong), -rank_of(wrong[0])[0]))[0]
    beside = min((wrong for wrong in lacks.values() if need not in wrong), key=_field_count)[0]
    return _refusal_sentence(question, needs, field, need, beside)


def _field_count(wrong: tuple[Need, ...]) -> int:
    return len({need.field for need in wrong})


def _refusal_sentence(
    question: Question, needs: frozenset[Need], field: str, need: Need, beside: Need | None = None
) -> InputError:
    """Return the refusal of a need, or of its lack, perhaps together with another one."""
    found, allowed = _present_and_otherwise(need, needs)
    if beside is not None:
        there, instead = _present_and_otherwise(beside, needs)
        found, allowed = f"{found} together with {there}", f"{allowed}, or {instead}"
    takers = [f"`{name}`" for name in question.others if fastest_march(QUESTIONS[name], needs) is not None]
    if takers and need in needs:
        allowed += f"; {' and '.join(takers)} take{'s' if len(takers) == 1 else ''} it"
    return InputError("", field or need.field, f"{found}, which `{question.name}` does not take", allowed)


def _present_and_otherwise(need: Need, needs: frozenset[Need]) -> tuple[str, str]:
    """Return what stands there, and what would stand there otherwise."""
    return (need.words, need.otherwise) if need in needs else (need.otherwise, need.words)


# -- from a program to its march --------------------------------------------------------------------------------------


def _kernel_module(program: Program | Wagons | Task) -> Any:
    """Return the module of the march that takes a program."""
    return import_module(f"wheeltapper.march.{_MODULES.get(type(program).__name__, 'wagon.march')}")


_MODULES = {"Program": "wheel.march", "Task": "general.task"}
"""Modules of the marches, by what they take; all else is a wagon's."""


@overload
def march(program: Program, tell: Tell = report_nothing, motion: FloatArray | None = None) -> MarchedWheel: ...
@overload
def march(program: Wagons, tell: Tell = report_nothing) -> MarchedWagon: ...
@overload
def march(program: Task, tell: Tell = report_nothing) -> Marched: ...
def march(program: Any, tell: Tell = report_nothing, motion: FloatArray | None = None) -> Any:
    """March a program to its end: from its start, or one wheel from a motion, that of the deck included."""
    how = {} if motion is None else {"motion": motion}
    return _kernel_module(program).march(program, tell, **how)


def restored(program: Any, status: int, held: Held) -> Any:
    """Return the march of a program from its `log`, whose names a file puts "march_" before.

    Raises
    ------
    InputError
        If no march of the program can have written it.
    """
    return _kernel_module(program).restored(program, status, held)
