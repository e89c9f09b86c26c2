"""A whole vehicle in three dimensions: rigid bodies, wheelsets, and the elements between them."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from typing import Annotated, Any

from pydantic import Field, model_validator

from wheeltapper.describe.choice import OneOf
from wheeltapper.describe.noun import Acceleration, Mass, PositiveStiffness
from wheeltapper.describe.registry import makeable_nouns
from wheeltapper.describe.vehicle.base import Vehicle
from wheeltapper.describe.vehicle.body import Axle, Body
from wheeltapper.describe.vehicle.element import GROUND, Damper, Element, Link, Sliding, Spring, Stop
from wheeltapper.describe.vehicle.freight import CompressionSpring
from wheeltapper.ground.errors import InputError, value_text, with_suggestion
from wheeltapper.ground.needs import SEVERAL_BODIES, Need

TREADS_APART = 1.5
"""Distance of the treads in pictures, m: that of the rails' middles on standard gauge."""
AnyElement = Annotated[Element, OneOf(Element)]


class Wagon(Vehicle):
    """A vehicle of rigid bodies on wheelsets (the paper, section 4).

    Bodies and wheelsets have small motions about a steady run along the track: x forward, y left, z up.

    Parameters
    ----------
    bodies
        All bodies except the wheelsets.
    axles
        The wheelsets, beginning with the leading one; their names in elements are "wheelset 1", "wheelset 2", …
    elements
        Springs, dampers, friction, stops and links.
    gravity
        g, m/s².
    """

    bodies: tuple[Body, ...]
    axles: Annotated[tuple[Axle, ...], Field(min_length=1)]
    elements: tuple[AnyElement, ...] = ()
    gravity: Acceleration = 9.81

    @model_validator(mode="after")
    def _named_and_connected(self) -> Wagon:
        names = [*self.names, *(element.name for element in self.elements)]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise InputError("", "", f"the name {twice!r} twice", "names that differ")
        ends = {end for element in self.elements for end in element.between}
        unknown = next((end for end in sorted(ends) if end not in (*self.names, GROUND)), None)
        if unknown is not None:
            raise InputError("", "elements", f"an end at {unknown!r}", with_suggestion(unknown, (*self.names, GROUND)))
        loose = next((body.name for body in self.bodies if body.name not in ends), None)
        if loose is not None:
            raise InputError("", "bodies", f"{loose!r} without a connection", "bodies that elements hold")
        for element in self.elements:
            self._check_load(element)
        if any(b.position >= a.position for a, b in zip(self.axles[:-1], self.axles[1:], strict=True)):
            raise InputError("", "axles", "a wheelset before the one ahead of it", "positions that fall")
        return self

    def _check_load(self, element: Element) -> None:
        """Refuse friction that no spring of the wagon presses."""
        load = element.pressed_by if isinstance(element, Sliding) else None
        if load is None:
            return
        other = next((one for one in self.elements if one.name == load), None)
        if isinstance(other, Spring | CompressionSpring):
            return
        named = [one.name for one in self.elements if isinstance(one, Spring | CompressionSpring)]
        found, allowed = f"no element {load!r}", with_suggestion(load, named)
        if isinstance(other, Link):
            found, allowed = f"{load!r}, a Link: its force is not unique", "a Spring, as stiff as it is"
        elif other is not None:
            found, allowed = f"{load!r}, a {type(other).__name__}", "a Spring or a CompressionSpring"
        raise InputError("", f"elements.{element.name}.load", found, allowed)

    @property
    def needs(self) -> frozenset[Need]:
        """What the march has to handle: several bodies."""
        return frozenset({SEVERAL_BODIES})

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the bodies, then of the wheelsets."""
        return (*(body.name for body in self.bodies), *(f"wheelset {i + 1}" for i in range(len(self.axles))))

    @property
    def boxes(self) -> dict[str, tuple[tuple[float, ...], tuple[float, ...]]]:
        """Centre (x, y, z) and edges of a box for each body and wheelset, m; of a wheelset around both wheels."""
        bodies = {body.name: (body.position, body.box) for body in self.bodies}
        return bodies | {
            f"wheelset {number}": ((axle.position, 0.0, axle.radius), (2 * axle.radius, TREADS_APART, 2 * axle.radius))
            for number, axle in enumerate(self.axles, 1)
        }

    @property
    def mass(self) -> float:
        """Mass of the whole vehicle, kg."""
        return float(sum(body.mass for body in self.bodies) + sum(axle.mass for axle in self.axles))

    def with_element(self, element: Any) -> Wagon:
        """Return the wagon with an added element, which replaces one of the same name."""
        if not isinstance(element, Element):
            raise InputError(
                "", "element", value_text(element), ", ".join(kind.__name__ for kind in makeable_nouns(Element))
            )
        if any(element.name == held.name for held in self.elements):
            return self._with_coach_changes(
                tuple(element if element.name == held.name else held for held in self.elements)
            )
        return self._with_coach_changes((*self.elements, element))

    def without(self, *names: str) -> Wagon:
        """Return the wagon without some elements."""
        held = [element.name for element in self.elements]
        unknown = [name for name in names if name not in held]
        if unknown:
            raise InputError("", "elements", f"no element {unknown[0]!r}", with_suggestion(str(unknown[0]), held))
        return self._with_coach_changes(tuple(element for element in self.elements if element.name not in names))

    def without_dampers(self) -> Wagon:
        """Return the wagon without its dampers (the paper's damping-free wagon)."""
        return self.without(*(element.name for element in self.elements if isinstance(element, Damper)))

    def _with_coach_changes(self, elements: tuple[Any, ...]) -> Wagon:
        return Wagon(bodies=self.bodies, axles=self.axles, elements=elements, gravity=self.gravity)

    @classmethod
    def erri_b176(
        cls, wheelset_mass: float = 1813.0, primary_stiffness: float = 1.220e6, series_springs: bool = False
    ) -> Wagon:
        """Return the ERRI B176 coach, vehicle 1 of the Manchester Benchmarks.

        Parameters
        ----------
        wheelset_mass
            kg, axle boxes included: 1813; the paper's figures were computed with 1500.
        primary_stiffness
            Along z per axle box, N/m: 1.220e6, or 1.200e6 in another source.
        series_springs
            True: vertical primary and all secondary dampers act through the springs at their ends.
        """
        data = tomllib.loads((files(__package__) / "erri_b176.toml").read_text(encoding="utf-8"))
        data["wheelset"]["mass"] = wheelset_mass
        data["primary"]["stiffness"][2] = primary_stiffness
        return _coach_parts(data, series_springs)


class Published(Vehicle, abstract=True):
    """The common part of published wagons, possibly with faults, instead of bodies, axles and elements.

    Parameters
    ----------
    dampers
        False: without dampers.
    without
        Names of elements that are left out.
    elements
        Added elements; one with the name of an element of the wagon replaces that element.
    """

    dampers: bool = True
    without: tuple[str, ...] = ()
    elements: tuple[AnyElement, ...] = ()

    def sound_wagon(self) -> Wagon:
        """Return the wagon as it was published."""
        raise NotImplementedError

    def wagon(self) -> Wagon:
        """Return it as a `Wagon`."""
        made = self.sound_wagon()
        made = (made if self.dampers else made.without_dampers()).without(*self.without)
        for element in self.elements:
            made = made.with_element(element)
        return made


class ErriB176(Published):
    """The ERRI B176 coach, possibly with faults, as a file describes it instead of bodies, axles and elements.

    Parameters
    ----------
    wheelset_mass, primary_stiffness, series_springs
        As for `Wagon.erri_b176`.
    """

    wheelset_mass: Mass = 1813.0
    primary_stiffness: PositiveStiffness = 1.220e6
    series_springs: bool = False

    def sound_wagon(self) -> Wagon:
        """Return the coach as a `Wagon`."""
        return Wagon.erri_b176(self.wheelset_mass, self.primary_stiffness, self.series_springs)


def wagon_for(vehicle: Any) -> Any:
    """Return the wagon that a vehicle stands for, where it has a method `wagon`."""
    return vehicle.wagon() if hasattr(vehicle, "wagon") else vehicle


def _coach_parts(data: dict[str, Any], series_springs: bool) -> Wagon:
    """Return a coach on two bogies with two wheelsets each."""
    place = data["geometry"]
    front, spacing, base = -place["semi_wheelbase"], 2 * place["semi_bogie_spacing"], place["semi_wheelbase"]
    pivots = {"bogie 1": front, "bogie 2": front - spacing}
    axles = [pivot + side * base for pivot in pivots.values() for side in (1, -1)]
    bodies = [_coach_body("car body", data["car_body"], front - spacing / 2, held=("x",))]
    bodies += [_coach_body(name, data["bogie_frame"], pivot) for name, pivot in pivots.items()]
    elements: list[Any] = []
    for number, x in enumerate(axles, 1):
        between = (f"bogie {(number + 1) // 2}", f"wheelset {number}")
        for side, y in (("left", place["semi_lateral_primary"]), ("right", -place["semi_lateral_primary"])):
            where = {"between": between, "at": (x, y, place["primary_height"])}
            elements += _spring_and_damper(
                f"primary {{}} {number} {side}", data["primary"], where, (2,), series_springs
            )
    for number, (name, x) in enumerate(pivots.items(), 1):
        between = ("car body", name)
        for side, y in (("left", place["semi_lateral_secondary"]), ("right", -place["semi_lateral_secondary"])):
            where = {"between": between, "at": (x, y, place["secondary_height"])}
            elements += _spring_and_damper(
                f"secondary {{}} {number} {side}", data["secondary"], where, (1, 2), series_springs
            )
        middle = (x, 0.0, place["secondary_height"])
        bar = (data["anti_roll_bar"]["bending"], 0.0, 0.0)
        elements.append(Spring(name=f"anti-roll bar {number}", between=between, at=middle, bending=bar))
        rod = {"between": between, "at": (x, 0.0, place["traction_rod_height"])}
        stiff, drag = data["traction_rod"]["stiffness"], data["traction_rod"]["damping"]
        elements.append(Spring(name=f"traction rod {number}", stiffness=(stiff, 0.0, 0.0), **rod))
        elements.append(Damper(name=f"traction rod damper {number}", damping=(drag, 0.0, 0.0), **rod))
        stop = {"between": between, "at": (x, 0.0, place["bumpstop_height"])}
        elements.append(Stop(name=f"lateral bumpstop {number}", along="y", **data["bumpstop"], **stop))
    wheelset = data["wheelset"]
    return Wagon(
        bodies=tuple(bodies),
        axles=tuple(
            Axle(mass=wheelset["mass"], inertia=tuple(wheelset["inertia"]), position=x, radius=wheelset["radius"])
            for x in axles
        ),
        elements=tuple(elements),
    )


def _coach_body(name: str, data: dict[str, Any], x: float, held: tuple[Any, ...] = ()) -> Body:
    position = (x, 0.0, data["height"])
    return Body(name=name, mass=data["mass"], inertia=tuple(data["inertia"]), position=position, held=held)


def _spring_and_damper(
    name: str, data: dict[str, Any], where: dict[str, Any], soft: tuple[int, ...], series_springs: bool
) -> list[Any]:
    """Return a spring and a damper at one place; directions in `soft` may have a spring in series with the damper."""
    bending = tuple(data.get("bending", (0.0, 0.0, 0.0)))
    spring = Spring(name=name.format("spring"), stiffness=tuple(data["stiffness"]), bending=bending, **where)
    damping = tuple(data["damping"])
    if not series_springs:
        return [spring, Damper(name=name.format("damper"), damping=damping, **where)]
    through = tuple(d if i in soft else 0.0 for i, d in enumerate(damping))
    direct = tuple(0.0 if i in soft else d for i, d in enumerate(damping))
    dampers = [
        Damper(name=name.format("damper"), damping=through, series_stiffness=data["series_stiffness"], **where),
        Damper(name=name.format("bush"), damping=direct, **where),
    ]
    return [spring, *(damper for damper in dampers if any(damper.slopes))]
