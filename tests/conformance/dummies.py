"""Laws, tracks and features as somebody might add them; whoever imports this module registers them.

The last four are described only: nothing is lowered of them, so that no suite may let them pass.
"""

from math import inf, pi
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

import wheeltapper as wt
from wheeltapper.describe.contact.base import Contact
from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic
from wheeltapper.describe.contact.force_law import ForceLaw
from wheeltapper.describe.creep.base import CreepLaw
from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.irregularity.course import Course, Harmonic, harmonic, level
from wheeltapper.describe.noun import Damping, Inertia, Length, Mass, PositiveForce, PositiveLength, Stiffness
from wheeltapper.describe.sensitivity import Quantity
from wheeltapper.describe.sensor.along import AlongTrack
from wheeltapper.describe.sensor.base import FloatArray, Seen
from wheeltapper.describe.track.base import Track
from wheeltapper.describe.vehicle.base import Vehicle
from wheeltapper.describe.vehicle.element import Element
from wheeltapper.describe.vehicle.plane import PlaneVehicle
from wheeltapper.ground.needs import BOGIE, Need


class DummyBump(Irregularity):
    """Two periods of a cosine, whose height is in m.

    Parameters
    ----------
    height, length, start
        m.
    """

    example: ClassVar[dict[str, Any]] = {"height": 1e-4, "length": 0.1, "start": 0.1}
    height: Length
    length: PositiveLength
    start: Length

    def course(self, radius: float) -> Course:
        """Return the deviation over the rolled distance."""
        wave = Harmonic(0.5 * self.height, 0.0, -0.5 * self.height, 4 * pi / self.length, self.start)
        end = self.start + self.length
        return Course((level(-inf, self.start), harmonic(self.start, end, wave), level(end, inf)), abs(self.height))


class DummyPlastic(ElasticPlastic):
    """Thornton's law with a tenth of Hertz's."""

    def pressure(self) -> float:
        """Return 1.60·Y."""
        return 1.6 * self._yield_strength()

    def loading(self, indentation: Any) -> Any:
        """Return N/N_Y at D ≥ 1."""
        d = np.asarray(indentation, dtype=float)
        return 0.9 * (1.5 * d - 0.5) + 0.1 * d**1.5

    def residual(self, indentation: Any) -> Any:
        """Return δ_r/δ_Y after unloading from D ≥ 1."""
        d = np.asarray(indentation, dtype=float)
        return d - self.loading(d) / np.sqrt(d)


class DummyPower(ForceLaw):
    """N = C·δ^1.25.

    Parameters
    ----------
    constant
        C, N/m^1.25.
    """

    example: ClassVar[dict[str, Any]] = {"constant": 1.5e10}
    constant: float = Field(gt=0.0)
    exponent: float = 1.25

    def force(self, delta: Any) -> Any:
        """Return the force of indentations, N."""
        return self.constant * delta**self.exponent


class DummyCreep(CreepLaw):
    """T = μ·N·tanh(F/(μ·N))."""

    def saturation(self, utilisation: Any) -> Any:
        """Return T/F at F/(μ·N)."""
        q = np.asarray(utilisation, dtype=float)
        return np.where(q < 1e-6, 1.0, np.tanh(q) / np.maximum(q, 1e-300))


@wt.features.feature
def dummy_feature() -> wt.features.Feature:
    """Return the mean of all force maxima, N."""
    return wt.features.custom(lambda train: train.peak_force.mean(), "dummy_feature", "N", impacts=1)


class DummyTram(Vehicle):
    """A tram's bogie on resilient wheels: tyres on rubber about the wheels' centres, these below a frame.

    Parameters
    ----------
    tyre_mass, centre_mass, frame_mass
        Of each wheelset's tyres, of its centres with the axle, and of the frame, kg.
    pitch_inertia
        Of the frame, kg·m².
    wheelbase, radius
        m.
    rubber_stiffness, rubber_damping, primary_stiffness, primary_damping
        Per wheelset, N/m and N·s/m.
    wheel_load
        Static force per wheelset, N.
    """

    example: ClassVar[dict[str, Any]] = {
        "tyre_mass": 400.0, "centre_mass": 700.0, "frame_mass": 2000.0, "pitch_inertia": 1000.0, "wheelbase": 1.8,
        "rubber_stiffness": 2e8, "rubber_damping": 5e4, "primary_stiffness": 2e6, "primary_damping": 3e4,
        "wheel_load": 8e4,
    }  # fmt: skip
    tyre_mass: Mass
    centre_mass: Mass
    frame_mass: Mass
    pitch_inertia: Inertia
    wheelbase: PositiveLength
    rubber_stiffness: Stiffness
    rubber_damping: Damping
    primary_stiffness: Stiffness
    primary_damping: Damping
    wheel_load: PositiveForce
    radius: PositiveLength = 0.33

    @property
    def needs(self) -> frozenset[Need]:
        """Wheelsets below a frame."""
        return frozenset({BOGIE})

    @property
    def loads(self) -> dict[str, float]:
        """What its wheelsets carry, N, by the path of the field."""
        return {"wheel_load": float(self.wheel_load)}

    @property
    def plane(self) -> PlaneVehicle:
        """The tram as numbers."""
        half = 0.5 * self.wheelbase
        rubber = np.eye(2, 6) - np.eye(2, 6, 2)
        primary = np.eye(2, 6, 2) - np.array([[0, 0, 0, 0, 1, half], [0, 0, 0, 0, 1, -half]])
        joined = [
            first * rubber.T @ rubber + second * primary.T @ primary
            for first, second in (
                (self.rubber_damping, self.primary_damping), (self.rubber_stiffness, self.primary_stiffness)
            )
        ]  # fmt: skip
        mass = np.diag([self.tyre_mass] * 2 + [self.centre_mass] * 2 + [self.frame_mass, self.pitch_inertia])
        alone = wt.Wheelset(mass=self.tyre_mass, load=self.wheel_load, gravity=0.0, radius=self.radius)
        names = ("wheelset 1", "wheelset 2", "wheel centre 1", "wheel centre 2", "frame", "frame pitch")
        return PlaneVehicle(names, mass, *joined, (0.0, -self.wheelbase), (alone, alone), (), np.zeros(2))


class DummySensor(AlongTrack):
    """A displacement gauge of the rail between two seats, m, upwards.

    Parameters
    ----------
    x
        Position along the track, m.
    """

    quantity: ClassVar[Quantity] = "displacement"
    place_words: ClassVar[str] = "x"
    example: ClassVar[dict[str, Any]] = {"x": 0.3}
    kind: Literal["rail displacement"] = "rail displacement"
    x: Length

    @property
    def rail_places(self) -> tuple[float, ...]:
        """Where it reads the rail, m."""
        return (float(self.x),)

    def extent(self, spacing: float | None) -> tuple[float, float]:
        """Return its place twice, m."""
        return float(self.x), float(self.x)

    def true_values(self, seen: Seen) -> FloatArray:
        """Return the displacement of the rail, m."""
        (values,) = seen.at_places("rail_displacement")
        return np.asarray(values)


class DummyVehicle(Vehicle):
    """A vehicle of which nothing is lowered."""

    example: ClassVar[dict[str, Any]] = {}


class DummyContact(Contact):
    """A force that is a constant."""

    example: ClassVar[dict[str, Any]] = {}


class DummyTrack(Track):
    """A track of which nothing is lowered.

    Parameters
    ----------
    depth
        m.
    """

    depth: Length = 0.0


class DummyElement(Element):
    """An element of which nothing is lowered."""

    example: ClassVar[dict[str, Any]] = {}


RUN = (DummyBump, DummyPlastic, DummyPower, DummyCreep, DummyTram, DummySensor, dummy_feature)
DESCRIBED = (DummyContact, DummyTrack, DummyVehicle, DummyElement)
