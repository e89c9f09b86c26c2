"""From a wagon to matrices: the motions of its bodies, and the forces of its elements.

Displacements and rotations are small. A body is displaced by d and rotated by θ. Its point r (from the centre of
gravity) then moves by d + θ × r. The deflection of an element is the difference of the motions of its two ends.
Wheelsets rotate in their axle boxes, so that no element depends on their pitch.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.vehicle.body import MOTIONS
from wheeltapper.describe.vehicle.element import GROUND, Damper, Element, Link, Sliding, Spring, Stop
from wheeltapper.describe.vehicle.freight import CompressionSpring
from wheeltapper.describe.vehicle.wagon import Wagon
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.prestress import OneWay, Prestress, prestress_of

FloatArray = NDArray[np.float64]
AXES = ("x", "y", "z")
STANDING = 1e-9
"""Share of the vehicle's weight below which a spring carries nothing."""


@dataclass(frozen=True)
class SeriesDamper:
    """A damper in series with a spring, in one direction: it extends by p at the `rate` of the spring's `force`.

    Both are corners, as of a `Characteristic`. The deflection of the spring is `row`·q - p. Within half the free play
    to both sides the force is zero.
    """

    name: str
    row: FloatArray
    rate: FloatArray
    force: FloatArray
    stiffness: float
    free_play: float = 0.0


@dataclass(frozen=True)
class Characteristic:
    """A force that is piecewise linear in the deflection `row`·q, or with `of_rate` in its rate `row`·q'.

    Corners that begin with (0, 0) are those of an odd function. `one_way`: behind the last one the force is constant.
    """

    name: str
    row: FloatArray
    deflection: FloatArray
    force: FloatArray
    of_rate: bool = False
    one_way: bool = False


@dataclass(frozen=True)
class Pressing:
    """The force that presses a slider: `load` at rest, `row`·q more, less the force of characteristic number `by`.

    Bounds are factors times it, back and forth: of sliding, and of beginning to.
    """

    load: float
    row: FloatArray
    by: int | None
    slides: tuple[float, float]
    begins: tuple[float, float]


@dataclass(frozen=True)
class Slider:
    """Dry friction in the direction of `row`: its forces while it slides and where it begins to, and its spring.

    Where these follow what presses it, they are those at rest, or near it, where nothing presses at rest.
    """

    name: str
    row: FloatArray
    force: float
    limit: float
    stiffness: float | None
    pressing: Pressing | None = None


@dataclass(frozen=True)
class Structure:
    """A wagon's equations of motion: mass·q'' + damping·q' + stiffness·q = forces.

    Attributes
    ----------
    motions
        (n,) body and motion of each entry of q; held motions are left out.
    mass
        (n,) masses and moments of inertia.
    damping, stiffness
        (n, n).
    series, characteristics, sliders
        Elements that are not linear in q and q'; they act against their row. Sliders with a spring stand first.
    ties
        (ties, n) rows; links keep `row`·q at zero.
    prestress
        Static state, in which the wheelsets carry the vehicle: q counts from it.
    """

    motions: tuple[tuple[str, str], ...]
    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    series: tuple[SeriesDamper, ...]
    characteristics: tuple[Characteristic, ...]
    sliders: tuple[Slider, ...]
    ties: FloatArray
    prestress: Prestress

    def with_equivalent_friction(self, amplitude: float, frequency: float) -> Structure:
        """Return it with springs and dampers that do what friction does in a harmonic motion at its ends.

        `amplitude` is in m, or rad about an axis, `frequency` in Hz. Friction that follows a load has that at rest.
        """
        stiffness, damping = self.stiffness.copy(), self.damping.copy()
        for slider in self.sliders:
            stiff, loss = equivalent_of(slider, amplitude)
            stiffness += stiff * np.outer(slider.row, slider.row)
            damping += loss / (2.0 * np.pi * frequency) * np.outer(slider.row, slider.row)
        return replace(self, stiffness=stiffness, damping=damping, sliders=())

    def slope_at_rest(self, name: str) -> float:
        """Return the slope of a piecewise linear force at rest, N/m."""
        law = next(law for law in self.characteristics if law.name == name)
        piece = int(np.clip(np.searchsorted(law.deflection, 0.0, side="right") - 1, 0, len(law.deflection) - 2))
        if law.one_way and law.deflection[-1] <= 0.0:  # it is free
            return 0.0
        rise = law.force[piece + 1] - law.force[piece]
        return float(rise / (law.deflection[piece + 1] - law.deflection[piece]))

    def bounds_of(self, slider: Slider, side: float, q: FloatArray) -> tuple[float, float]:
        """Return the force with which a slider slides to a side, -1 or 1, and with which it begins to, N."""
        pressing = slider.pressing
        if pressing is None:
            return slider.force, slider.limit
        force = pressing.load + float(pressing.row @ q)
        if pressing.by is not None:
            law = self.characteristics[pressing.by]
            force -= float(np.interp(law.row @ q, law.deflection, law.force))
        return max(force, 0.0) * pressing.slides[int(side > 0.0)], max(force, 0.0) * pressing.begins[int(side > 0.0)]

    def motion_row(self, body: str, motion: str) -> FloatArray:
        """Return the row that selects one motion of a body; zero if the motion is held."""
        out = np.zeros(len(self.motions))
        if (body, motion) in self.motions:
            out[self.motions.index((body, motion))] = 1.0
        return out


class _BodyPlaces:
    """Positions of the bodies of a wagon, and the motion of points fixed to them."""

    def __init__(self, wagon: Wagon) -> None:
        self.centres = {body.name: np.array(body.position) for body in wagon.bodies}
        held = {body.name: set(body.held) for body in wagon.bodies}
        self.masses = {body.name: (body.mass, body.inertia) for body in wagon.bodies}
        self.wheelsets = tuple(f"wheelset {i + 1}" for i in range(len(wagon.axles)))
        for name, axle in zip(self.wheelsets, wagon.axles, strict=True):
            self.centres[name] = np.array([axle.position, 0.0, axle.radius])
            held[name] = set(axle.held)
            self.masses[name] = (axle.mass, axle.inertia)
        self.motions = tuple((name, motion) for name in wagon.names for motion in MOTIONS if motion not in held[name])

    def point_rows(self, body: str, at: FloatArray) -> FloatArray:
        """Return the rows of x, y, z of a point fixed to a body, (3, n)."""
        out = np.zeros((3, len(self.motions)))
        if body == GROUND:
            return out
        x, y, z = at - self.centres[body]
        turned = {"roll": (0.0, -z, y), "pitch": (z, 0.0, -x), "yaw": (-y, x, 0.0)}
        for column, (name, motion) in enumerate(self.motions):
            if name != body or (name in self.wheelsets and motion == "pitch"):
                continue
            out[:, column] = turned[motion] if motion in turned else np.eye(3)[AXES.index(motion)]
        return out

    def rotation_rows(self, body: str) -> FloatArray:
        """Return the rows of roll, pitch and yaw of a body, (3, n)."""
        out = np.zeros((3, len(self.motions)))
        for column, (name, motion) in enumerate(self.motions):
            if name == body and motion in MOTIONS[3:] and not (name in self.wheelsets and motion == "pitch"):
                out[MOTIONS.index(motion) - 3, column] = 1.0
        return out

    def deflection_rows(self, element: Element) -> FloatArray:
        """Return the rows of the displacement of an element's first end relative to its second, (3, n)."""
        at = np.array(element.at)
        first, second = element.between
        return self.point_rows(first, at) - self.point_rows(second, at)

    def row_along(self, element: Element, direction: str) -> FloatArray:
        """Return the row of that displacement, or of that rotation, (n,)."""
        if direction in AXES:
            return np.asarray(self.deflection_rows(element)[AXES.index(direction)])
        first, second = (self.rotation_rows(body) for body in element.between)
        return np.asarray((first - second)[MOTIONS.index(direction) - 3])

    def motion_masses(self) -> FloatArray:
        """Return the mass or moment of inertia of each motion."""
        out = []
        for name, motion in self.motions:
            mass, inertia = self.masses[name]
            out.append(mass if motion in AXES else inertia[MOTIONS.index(motion) - 3])
        return np.array(out)


def equivalent_of(slider: Slider, amplitude: float) -> tuple[float, float]:
    """Return stiffness, N/m, and damping times circular frequency, N/m, of a slider in a harmonic motion of its ends.

    They are those of the first harmonic of its force (describing function). With a spring it sticks up to an amplitude.
    """
    force, spring = slider.force, slider.stiffness
    if spring is None:
        return 0.0, 4.0 * force / (np.pi * amplitude)
    if amplitude <= force / spring:
        return spring, 0.0
    angle = float(np.arccos(1.0 - 2.0 * force / (spring * amplitude)))
    loss = 4.0 * force / (np.pi * amplitude) * (1.0 - force / (spring * amplitude))
    return spring / np.pi * (angle - 0.5 * float(np.sin(2.0 * angle))), loss


def structure_of(wagon: Wagon) -> Structure:
    """Return the equations of motion of a wagon without its contacts."""
    places = _BodyPlaces(wagon)
    count = len(places.motions)
    stiffness, damping = np.zeros((count, count)), np.zeros((count, count))
    series, characteristics, ties = [], [], [np.zeros((0, count))]
    springs, one_ways, rubbing = dict[str, FloatArray](), list[OneWay](), list[tuple[Sliding, FloatArray]]()
    for element in wagon.elements:
        rows = places.deflection_rows(element)
        if isinstance(element, Spring):
            first, second = element.between
            turns = places.rotation_rows(first) - places.rotation_rows(second)
            stiffness += rows.T @ np.diag(element.stiffness) @ rows + turns.T @ np.diag(element.bending) @ turns
            springs[element.name] = element.stiffness[2] * rows[2]
        elif isinstance(element, Damper) and element.series_stiffness is not None:
            for axis, row, slope in zip(AXES, rows, element.slopes, strict=True):
                if slope > 0.0:
                    stiff, name = element.series_stiffness, f"{element.name} {axis}"
                    linear = ((0.0, stiff / slope), (0.0, stiff))  # a corner where the spring has given way by 1 m
                    rate, force = map(np.array, (element.rate, element.force) if element.rate else linear)
                    series.append(SeriesDamper(name, row, rate, force, stiff, element.free_play))
        elif isinstance(element, Damper) and element.along is not None:
            row = rows[AXES.index(element.along)]
            law = np.array(element.rate), np.array(element.force)
            characteristics.append(Characteristic(element.name, row, *law, of_rate=True))
        elif isinstance(element, Damper):
            damping += rows.T @ np.diag(element.slopes) @ rows
        elif isinstance(element, Sliding):
            rubbing.append((element, places.row_along(element, element.direction)))
        elif isinstance(element, Stop):
            row = rows[AXES.index(element.along)]
            characteristics.append(
                Characteristic(element.name, row, np.array(element.deflection), np.array(element.force))
            )
        elif isinstance(element, CompressionSpring):
            one_ways.append(OneWay(element, rows[AXES.index(element.along)]))
        elif isinstance(element, Link):
            ties.append(rows[[AXES.index(axis) for axis in element.along]])
        else:
            what, known = f"a {type(element).__name__}, of which nothing is lowered", "an element of wt.vehicles"
            raise InputError("", f"vehicle.elements.{element.name}", what, known)
    mass = places.motion_masses()
    upright = np.array([motion == "z" for _, motion in places.motions])
    weights = np.where(upright, -mass * wagon.gravity, 0.0)
    for name, axle in zip(places.wheelsets, wagon.axles, strict=True):
        weights -= axle.load * np.array([motion == (name, "z") for motion in places.motions])
    prestress = prestress_of(places.motions, places.wheelsets, stiffness, np.vstack(ties), weights, one_ways)
    characteristics += [
        Characteristic(one.spring.name, one.row, *one.corners_about(found), one_way=True)
        for one, found in zip(one_ways, prestress.one_ways, strict=True)
    ]
    numbers = {one.name: number for number, one in enumerate(characteristics)}
    sliders = [_slider(element, row, springs, numbers, prestress) for element, row in rubbing]
    sliders.sort(key=lambda slider: slider.stiffness is None)
    return Structure(
        places.motions, mass, damping, stiffness, tuple(series), tuple(characteristics), tuple(sliders),
        np.vstack(ties), prestress,
    )  # fmt: skip


def _slider(
    element: Sliding, row: FloatArray, springs: dict[str, FloatArray], numbers: dict[str, int], prestress: Prestress
) -> Slider:
    """Return dry friction; `springs` have their vertical forces as rows, `numbers` are those of characteristics."""
    slides, begins = element.bounds
    pressing, load = None, 1.0
    if element.pressed_by is not None:
        by = numbers.get(element.pressed_by)
        pulls = springs.get(element.pressed_by, np.zeros(len(row)))
        held = prestress.force_of(element.pressed_by) if by is not None else float(pulls @ prestress.sinking)
        if by is None and not abs(held) > STANDING * prestress.weight:
            raise InputError(
                "", f"vehicle.elements.{element.name}.load", f"{element.pressed_by!r}, which carries nothing at rest",
                "a spring with a vertical force under the static load",
            )  # fmt: skip
        pressing = Pressing(abs(held), np.sign(held) * pulls, by, slides, begins)
        load = abs(held) if held else prestress.weight
    return Slider(
        element.name, row, load * max(slides), load * max(begins), element.series_stiffness, pressing
    )  # fmt: skip
