"""What every vehicle is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheeltapper.describe.noun import Noun

if TYPE_CHECKING:
    from wheeltapper.describe.vehicle.kinks import Suspension
    from wheeltapper.describe.vehicle.plane import PlaneVehicle


class Vehicle(Noun, abstract=True):
    """What rolls on the track: in the vertical plane (then it has a property `plane`), or in space as a wagon."""

    @property
    def suspensions(self) -> tuple[Suspension, ...]:
        """Its suspensions, each kind once, for drawings; empty for a vehicle that is drawn without."""
        return ()

    @property
    def words(self) -> str:
        """The vehicle in words: how many wheelsets, what they weigh."""
        plane: PlaneVehicle = self.plane  # type: ignore[attr-defined]
        first, several = plane.wheelsets[0], len(plane.wheelsets)
        static = f"{float(first.mass):g} kg, static force {float(first.weight) / 1e3:.4g} kN"
        return f"wheelset of {static}" if several == 1 else f"{several} wheelsets, the first of {static}"
