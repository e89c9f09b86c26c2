"""What a fault of a wheelset is, and the catalogue of all faults that are defined.

A fault is a class in a file of this room. Its class statement registers it; one that is defined elsewhere stands beside
those of the package. What the rest of the diagnosis has to know of a fault it asks the fault, and never for its name.

The facts stand in docs/theory/diagnosis.rst, section 8.6.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isfinite
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from wheeltapper.describe.registry import is_abstract, register, registered_in
from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.inference.problem import FitProblem, Prior
from wheeltapper.ground.errors import InputError, value_text, with_suggestion
from wheeltapper.ground.quantities import to_si
from wheeltapper.ground.shown import Shown
from wheeltapper.record.arguments import as_scenario

if TYPE_CHECKING:
    from wheeltapper.diagnosis.inference.estimate import Estimate
    from wheeltapper.diagnosis.scale import Scale

ROOM = __name__.rpartition(".")[0]
"""The room in which faults are registered, wherever they are defined."""
MASS, DAMPING, LOAD = "vehicle.mass", "vehicle.damping", "vehicle.load"
"""Paths of the fields that the plain faults change."""
PLAIN = {
    MASS: ("unsprung mass", "kg", 1.0),
    DAMPING: ("damping", "kN s/m", 1e-3),
    LOAD: ("load", "kN", 1e-3),
}
"""Fields that the plain faults change, and how they are printed: name, unit, and the factor from SI to that unit. One
fit with all three free serves all plain faults."""

Sizes = float | tuple[float, float] | None
"""A size, a range from which each passage's size is drawn, or None for the usual size."""


class Fault(Shown):
    """One fault of a wheelset.

    A fault is a subclass with these attributes, and with `made` and `believed`. All others have a default.

    Attributes
    ----------
    name, part
        Name, and the part of the wheelset: "suspension", "damper", "wheel", "load" or another word. The force of a
        fault of a wheel strikes in one of the two wheels only.
    rank
        Its place among the faults, which are compared, tried and printed in the order of their ranks.
    meaning
        One sentence for the reader of the finding.
    size, unit, usual
        What the size is, its unit, and its usual value.
    path
        Field of the faulty scenario that holds its size; "" where the size only scales other fields.
    acts
        How it shows. "plain": it changes mass, damping and load only; one fit serves all plain faults. "at a strike":
        the wheelset seems healthy until some time (see `Flat`). "throughout": neither.
    usual_range
        The sizes for which `assess` computes it; None: the usual size.
    assessed
        Whether `assess` computes it if no faults are named.
    far
        For a plain fault: whether it differs so much from a healthy wheelset that a fit starts from it as well.
    alone
        For a fault that acts throughout: whether `starts` finds its starting models. Otherwise those of `tried` are
        ranked together with the other faults', by their misfit to the beginning of the recording.
    fields
        Fields that it adds to those of a healthy passage, and how they are printed: name, unit, and the factor from SI
        to that unit.
    alarms
        Quantities of alarm rules that its size gives, and the factors from its size to them.
    """

    name: ClassVar[str]
    part: ClassVar[str]
    rank: ClassVar[float] = float("inf")
    meaning: ClassVar[str]
    size: ClassVar[str]
    unit: ClassVar[str] = ""
    usual: ClassVar[float]
    path: ClassVar[str] = ""
    acts: ClassVar[Literal["plain", "at a strike", "throughout"]] = "throughout"
    usual_range: ClassVar[Sizes] = None
    assessed: ClassVar[bool] = False
    far: ClassVar[bool] = False
    alone: ClassVar[bool] = False
    fields: ClassVar[Mapping[str, tuple[str, str, float]]] = {}
    alarms: ClassVar[Mapping[str, float]] = {}

    def __init_subclass__(cls, abstract: bool = False, **others: Any) -> None:
        super().__init_subclass__(**others)
        missing = [name for name in ("name", "part", "meaning", "size", "usual") if not hasattr(cls, name)]
        if missing and not abstract:
            raise InputError("", f"{cls.__name__}.{missing[0]}", "nothing", "a value, which each fault has")
        if not (abstract or cls.__module__.startswith(ROOM)):
            before = CATALOGUE.get(cls.name)
            if before is not None and type(before).__name__ != cls.__name__:
                raise InputError("", f"{cls.__name__}.name", f"a second {cls.name!r}", "a name that is not taken")
        register(cls, ROOM, abstract=abstract)

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other)

    def __hash__(self) -> int:
        return hash(type(self).__name__)

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"

    @property
    def plain(self) -> bool:
        """Whether it changes only mass, damping and load."""
        return self.acts == "plain"

    def passage(self, healthy: Scenario, size: float | None = None, place: float = 0.5) -> Scenario:
        """Return a passage with this fault, of its usual size if none is given."""
        size = self.usual if size is None else to_si(size, "number", "size")
        if not isfinite(size):
            raise InputError("", "size", value_text(size), "a finite number")
        return self.made(as_scenario(healthy), size, as_place(place))

    def made(self, passage: Scenario, size: float, place: float) -> Scenario:
        """Return the faulty passage; `place`, 0 to 1, is where on the wheel's circumference the fault is."""
        raise NotImplementedError

    def believed(self, passage: Scenario) -> dict[str, Prior]:
        """Return the priors of the fields that it changes in a healthy passage; they replace what the site states."""
        raise NotImplementedError

    def size_of(self, value: float, healthy: float) -> float:
        """Return its size from the values of its field in the faulty and in the healthy passage."""
        return value

    def tried(self, model: Scenario, scale: Scale) -> list[Scenario]:
        """Return the passages from which fits may start, made from a healthy model; `scale` is that of the site."""
        return [self.passage(model)]

    def shown(self, problem: FitProblem, begins: float) -> list[Scenario]:
        """Return more passages from which fits may start, as the recording shows them; arguments as of `starts`."""
        return []

    def seen(self, problem: FitProblem, begins: float) -> bool:
        """Return True if the recording shows a fault that is `alone`, which is then tried first; as for `starts`."""
        return False

    def starts(self, problem: FitProblem, begins: float) -> list[Scenario]:
        """Return the passages from which the fits of a fault that is `alone` start, the most likely first.

        `problem` is that of the healthy wheelset, and `begins` the onset, s after the trigger.
        """
        raise NotImplementedError

    def mistaken(self, healthy: Scenario, found: Scenario) -> list[Scenario]:
        """Return passages with this fault that may look like one in which only mass, damping and load differ."""
        return []

    def beside(self, found: Scenario) -> list[Scenario]:
        """Return passages from which a fit may come to a better minimum near the one that it has found."""
        return []

    def unseen(self, found: Scenario) -> list[Scenario]:
        """Return passages that differ from the one found only in ways that a recording may not show."""
        return []

    def also(self, verdict: str, estimate: Estimate) -> bool:
        """Return True if a recording with this verdict does not exclude this fault either, whatever the fits say."""
        return False

    def model(self, healthy: Scenario, values: Mapping[str, float]) -> Scenario | None:
        """Return a passage from values by path as a finding prints them; None if they do not determine it."""
        return None


class Catalogue(Mapping[str, Fault]):
    """The faults of a wheelset by name, in the order of their ranks: the package's, and others defined so far."""

    def _kinds(self) -> dict[str, type[Fault]]:
        kinds = [kind for kind in registered_in(ROOM).values() if not is_abstract(kind)]
        return {kind.name: kind for kind in sorted(kinds, key=lambda kind: kind.rank)}

    def __getitem__(self, name: str) -> Fault:
        return self._kinds()[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self._kinds())

    def __len__(self) -> int:
        return len(self._kinds())


CATALOGUE = Catalogue()
"""The faults of a wheelset, by name."""


def fault_named(name: str) -> Fault:
    """Return a fault of the catalogue."""
    if not isinstance(name, str) or name not in CATALOGUE:
        raise InputError("", "fault", value_text(name), with_suggestion(str(name), CATALOGUE))
    return CATALOGUE[name]


def listed() -> str:
    """Return a table, in reStructuredText, of all faults: name, meaning, and what the size is with its usual value."""
    rows = [".. list-table::", "   :widths: 18 52 30", "   :header-rows: 1", ""]
    cells = [
        (one.name, one.meaning, f"{one.size} ({f'{one.usual:g} {one.unit}'.strip()})") for one in CATALOGUE.values()
    ]
    for name, meaning, size in [("fault", "meaning", "size (usual)"), *cells]:
        rows += [f"   * - {name}", f"     - {meaning}", f"     - {size}"]
    return "\n".join([*rows, ""])


def as_place(given: Any) -> float:
    """Return where on a wheel's circumference a fault is."""
    place = to_si(given, "number", "place")
    if not 0.0 <= place <= 1.0:
        raise InputError("", "place", value_text(given), "a share of the wheel's circumference, 0 to 1")
    return place


def with_item(passage: Scenario, item: Any) -> Scenario:
    """Return a passage with one irregularity more."""
    return passage.replaced({"irregularity": (*passage.irregularity, item)})
