"""A freight wagon on three-piece bogies: their figures are published, those of the body above are the user's."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from wheeltapper.describe.noun import Coefficient, Inertia, Mass, PositiveLength, PositiveStiffness
from wheeltapper.describe.vehicle.body import Axle, Body
from wheeltapper.describe.vehicle.element import Element, Link, Spring
from wheeltapper.describe.vehicle.freight import CentreBowl, CompressionSpring, FrictionWedge
from wheeltapper.describe.vehicle.wagon import Published, Wagon

SIDES = (("left", 1.0), ("right", -1.0))
WHEELBASE, APART = 1.829, 1.098
"""Distance of a bogie's axles, and half that of its side frames, m."""
RADIUS = 0.4826
"""Of wheels of 38 inches, m."""
COILS, BED, COIL, WEDGE_COIL = 7.0, 0.143, (208548.33, 208548.33, 572410.86), 393046.0
"""Main springs of a side, and their distance, m; stiffness of one of them, and of a wedge's spring, N/m."""
WEDGE_SHEAR, FREE = 118870.0, 0.28
"""Of a wedge's spring, N/m and m."""
SLOPE = 0.633554518
"""Of a wedge from the vertical, rad: 36.3°."""


class ThreePieceWagon(Published):
    """A wagon on two Barber bogies: two side frames, a bolster on springs, and wedges with friction.

    The figures of the bogies are published, those of the body and of the centre plates are to be stated. Wedges are
    without mass, and hold the bolster in its side frames along the track; a wedge's vertical face rubs vertically. The
    height of the bolster's springs is that of the axles, on which the side frames' centres are, too. In the source the
    wheels touch the rails 1.575 m apart; here that follows from the profiles.

    Source: mbsim-wagons (L. Baruffaldi, Unicamp; 42b61e4), barbertruck.cpp and input.in: seven springs and two wedges
    to a side.

    Parameters
    ----------
    body_mass, body_inertia, body_height
        Of the body with its load: kg; roll, pitch, yaw, kg·m²; height of its centre above the rail, m.
    pivots
        Distance of the bogies, m.
    plate_radius, plate_friction, plate_stiffness
        Of the flat centre plates: outer radius, m, coefficient of friction, and vertical stiffness of each, N/m.
    wedge_friction
        Coefficient of friction between wedge and side frame.
    """

    example: ClassVar[dict[str, Any]] = {
        "body_mass": 13344.0, "body_inertia": (52800.0, 1284000.0, 1284000.0), "body_height": 1.5, "plate_radius": 0.17,
        "plate_friction": 0.25, "plate_stiffness": 1e8,
    }  # fmt: skip
    body_mass: Mass
    body_inertia: tuple[Inertia, Inertia, Inertia]
    body_height: PositiveLength
    plate_radius: PositiveLength
    plate_friction: Coefficient
    plate_stiffness: PositiveStiffness
    pivots: PositiveLength = 14.622
    wedge_friction: Coefficient = 0.2

    def sound_wagon(self) -> Wagon:
        """Return it as a `Wagon`."""
        places = {1: -0.5 * WHEELBASE, 2: -0.5 * WHEELBASE - float(self.pivots)}
        middle = -0.5 * (WHEELBASE + float(self.pivots))
        at = (middle, 0.0, self.body_height)
        bodies = [
            Body(name="car body", mass=self.body_mass, inertia=self.body_inertia, position=at, held=("x",)),
            *(body for number, x in places.items() for body in _pieces(number, x)),
        ]
        axles = [x + way * 0.5 * WHEELBASE for x in places.values() for way in (1.0, -1.0)]
        wheelsets = [Axle(mass=1777.55, inertia=(1179.6, 138.0, 1179.6), position=x, radius=RADIUS) for x in axles]
        elements = [element for number, x in places.items() for element in self._elements(number, x)]
        return Wagon(bodies=tuple(bodies), axles=tuple(wheelsets), elements=tuple(elements))

    def _elements(self, number: int, x: float) -> Iterator[Element]:
        """Yield the elements of a bogie."""
        bolster = f"bolster {number}"
        for side, sign in SIDES:
            frame, y = f"side frame {number} {side}", sign * APART
            for one, way in ((2 * number - 1, 1.0), (2 * number, -1.0)):
                yield Spring(
                    name=f"pad {one} {side}", between=(frame, f"wheelset {one}"),
                    at=(x + way * 0.5 * WHEELBASE, y, RADIUS), stiffness=(1.31345e7, 8.7563e6, 1.75127e8),
                    bending=(55475.0, 0.0, 55475.0),
                )  # fmt: skip
            ends: Any = {"between": (bolster, frame)}
            along, across, up = (COILS * one for one in COIL)
            yield Spring(
                name=f"springs {number} {side}", at=(x, y, RADIUS), stiffness=(along, across, up), **ends,
                bending=(6.0 * COIL[2] * BED**2, 4.0 * COIL[2] * BED**2, (6.0 * COIL[0] + 4.0 * COIL[1]) * BED**2),
            )  # fmt: skip
            yield Link(name=f"guide {number} {side}", at=(x, y, RADIUS), along=("x",), **ends)
            for end, way in (("front", 1.0), ("rear", -1.0)):
                where: Any = {"at": (x + way * BED, y, RADIUS), **ends}
                nest, shear = f"wedge spring {number} {side} {end}", (WEDGE_SHEAR, WEDGE_SHEAR, 0.0)
                force = (0.0, WEDGE_COIL * FREE)
                yield CompressionSpring(name=nest, along="z", compression=(0.0, FREE), force=force, **where)
                yield Spring(name=f"{nest} across", stiffness=shear, **where)
                yield FrictionWedge(
                    name=f"wedge {number} {side} {end}", load=nest, friction=self.wedge_friction, angle=SLOPE, **where,
                )  # fmt: skip
        plate, place = f"centre plate {number}", {"between": ("car body", bolster), "at": (x, 0.0, RADIUS + 0.19)}
        stiffness = float(self.plate_stiffness)
        yield Spring(
            name=f"{plate} spring", stiffness=(stiffness,) * 3, **place,
            bending=tuple(0.25 * stiffness * float(self.plate_radius) ** 2 * tilts for tilts in (1.0, 1.0, 0.0)),
        )  # fmt: skip
        rubs: Any = {"friction": self.plate_friction, "radius": self.plate_radius}
        yield CentreBowl(name=plate, load=f"{plate} spring", series_stiffness=stiffness, **rubs, **place)


def _pieces(number: int, x: float) -> Iterator[Body]:
    """Yield the bodies of a bogie; the moments of the source are about axes along, up and across."""
    yield Body(name=f"bolster {number}", mass=911.0, inertia=(508.9, 24.8, 511.4), position=(x, 0.0, RADIUS + 0.1))
    for side, sign in SIDES:
        yield Body(
            name=f"side frame {number} {side}", mass=630.0, inertia=(91.6, 340.3, 323.0),
            position=(x, sign * APART, RADIUS),
        )  # fmt: skip
