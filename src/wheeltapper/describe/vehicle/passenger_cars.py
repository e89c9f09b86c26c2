"""Passenger cars whose figures are published whole: Cooperrider's car, and a metro car."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from wheeltapper.describe.vehicle.body import Axle, Body
from wheeltapper.describe.vehicle.element import Damper, Element, Spring
from wheeltapper.describe.vehicle.wagon import Published, Wagon

SIDES = (("left", 1.0), ("right", -1.0))


class CooperriderCar(Published):
    """A passenger car on two Cooperrider bogies, as in the program DYTSI; every spring and damper acts along one axis.

    Its primary springs are at the height of the axles, its longitudinal and lateral secondary ones 0.6584 m above the
    frames' centres. Wheels and rails are not part of it.

    Source: DYTSI (D. Bigoni, Technical University of Denmark), model "CooperriderOrthogonal", input
    "Cooperrider-straight". Papers on the bogie alone (Cooperrider 1972, Kaas-Petersen 1986) have other figures.
    """

    def sound_wagon(self) -> Wagon:
        """Return it as a `Wagon`."""
        axles = _Wheelsets(7.5, 1.074, 1022.0, (678.0, 80.0, 678.0), 0.425)
        frames, wheelsets = axles.places()
        bodies = [_body("car body", 44388.0, (2.8e5, 5e5, 5e5), -1.074 - 7.5, 2.0596, ("x",))]
        bodies += [_body(name, 2918.9, (6780.0,) * 3, x, 0.5012) for name, x in frames.items()]
        return Wagon(bodies=tuple(bodies), axles=axles.made(), elements=tuple(self._suspension(frames, wheelsets)))

    @staticmethod
    def _suspension(frames: dict[str, float], wheelsets: list[tuple[str, str, float]]) -> Iterator[Element]:
        for frame, wheelset, x in wheelsets:
            for side, sign in SIDES:
                where: Any = {"between": (frame, wheelset), "at": (x, 0.62 * sign, 0.425)}
                name = f"primary spring {wheelset.split()[1]} {side}"
                yield Spring(name=name, stiffness=(3.646e6, 1.823e6, 3.646e6), **where)
        above = 0.5012 + 0.6584
        for number, (frame, x) in enumerate(frames.items(), 1):
            for side, sign in SIDES:
                ends: Any = {"between": ("car body", frame)}
                for way, y, stiffness, damping in (
                    ("longitudinal", 1.5, (9.0335e5, 0.0, 0.0), (1.66669e5, 0.0, 0.0)),
                    ("lateral", 0.68, (0.0, 1.823e5, 0.0), (0.0, 2.92e4, 0.0)),
                    ("vertical", 0.68, (0.0, 0.0, 3.333e5), (0.0, 0.0, 2e4)),
                ):
                    at = (x, y * sign, above)
                    yield Spring(name=f"{way} secondary spring {number} {side}", stiffness=stiffness, at=at, **ends)
                    yield Damper(name=f"{way} secondary damper {number} {side}", damping=damping, at=at, **ends)


class Gz18(Published):
    """A four-axle metro car, GZ18, as in the program OpenRailVehicleDynamics, which compares it with SIMPACK.

    Its axle boxes turn about the axles on arms with bushes, which hold along and across; coils stand above the axles.
    Wheels and rails are not part of it. The moments of its frames are small for their mass, as listed.

    Source: OpenRailVehicleDynamics (4706df9), vehicle_library/gz18.
    """

    def sound_wagon(self) -> Wagon:
        """Return it as a `Wagon`."""
        axles = _Wheelsets(7.85, 1.25, 1834.0, (1059.0, 1650.0, 1074.0), 0.42)
        frames, wheelsets = axles.places()
        bodies = [_body("car body", 30549.0, (60845.0, 1315247.0, 1344928.0), -1.25 - 7.85, 1.346, ("x",))]
        bodies += [_body(name, 8900.0, (1650.0, 3419.0, 4994.0), x, 0.557) for name, x in frames.items()]
        return Wagon(bodies=tuple(bodies), axles=axles.made(), elements=tuple(self._suspension(frames, wheelsets)))

    @staticmethod
    def _suspension(frames: dict[str, float], wheelsets: list[tuple[str, str, float]]) -> Iterator[Element]:
        for frame, wheelset, x in wheelsets:
            inwards = 0.48 if x < frames[frame] else -0.48
            number = wheelset.split()[1]
            for side, sign in SIDES:
                ends: Any = {"between": (frame, wheelset)}
                coil, bush = (x, sign, 0.438), (x + inwards, 1.055 * sign, 0.4335)
                yield Spring(name=f"coil {number} {side}", stiffness=(0.0, 0.0, 1.4e6), at=coil, **ends)
                yield Damper(name=f"coil damper {number} {side}", damping=(0.0, 0.0, 1e4), at=coil, **ends)
                yield Spring(name=f"bush {number} {side}", stiffness=(1.7e7, 9e6, 0.0), at=bush, **ends)
        for bogie, (frame, x) in enumerate(frames.items(), 1):
            ends = {"between": ("car body", frame)}
            for side, sign in SIDES:
                at = (x, 0.95 * sign, 0.638)
                yield Spring(name=f"air spring {bogie} {side}", stiffness=(1.85e5, 1.85e5, 2.3e5), at=at, **ends)
                yield Damper(name=f"air spring damper {bogie} {side}", damping=(0.0, 0.0, 2e4), at=at, **ends)
                yield Damper(
                    name=f"yaw damper {bogie} {side}", along="x", rate=(0.0, 0.02, 0.04), force=(0.0, 12e3, 12e3),
                    at=(x, 1.2 * sign, 0.557), **ends,
                )  # fmt: skip
            middle = (x, 0.0, 0.557)
            yield Spring(name=f"anti-roll bar {bogie}", bending=(3.5e6, 0.0, 0.0), at=middle, **ends)
            joint: Any = {"series_stiffness": 1e9, "at": middle}
            yield Damper(name=f"lateral damper {bogie}", damping=(0.0, 6e4, 0.0), **joint, **ends)


class _Wheelsets:
    """Wheelsets of a car on two bogies: half distances of pivots and of axles, m, mass, moments and radius."""

    def __init__(
        self, pivots: float, wheelbase: float, mass: float, inertia: tuple[float, float, float], radius: float
    ) -> None:
        self.pivots, self.wheelbase = pivots, wheelbase
        self.fields: dict[str, Any] = {"mass": mass, "inertia": inertia, "radius": radius}

    def places(self) -> tuple[dict[str, float], list[tuple[str, str, float]]]:
        """Return places of the bogies, and of wheelsets with the bogie of each."""
        frames = {"bogie 1": -self.wheelbase, "bogie 2": -self.wheelbase - 2.0 * self.pivots}
        wheels = [(name, x + way * self.wheelbase) for name, x in frames.items() for way in (1.0, -1.0)]
        return frames, [(frame, f"wheelset {number}", x) for number, (frame, x) in enumerate(wheels, 1)]

    def made(self) -> tuple[Axle, ...]:
        """Return the wheelsets."""
        return tuple(Axle(position=x, **self.fields) for _, _, x in self.places()[1])


def _body(
    name: str, mass: float, inertia: tuple[float, ...], x: float, height: float, held: tuple[Any, ...] = ()
) -> Body:
    roll, pitch, yaw = inertia
    return Body(name=name, mass=mass, inertia=(roll, pitch, yaw), position=(x, 0.0, height), held=held)
