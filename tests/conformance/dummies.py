"""Laws, tracks and features as somebody might add them; whoever imports this module registers them.

The last three are described only: nothing is lowered of them, so that no suite may let them pass.
"""

from math import inf, pi
from typing import Any, ClassVar

import numpy as np

import wheeltapper as wt
from wheeltapper.describe.contact.base import Contact
from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic
from wheeltapper.describe.creep.base import CreepLaw
from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.irregularity.course import Course, Harmonic, harmonic, level
from wheeltapper.describe.noun import Length, PositiveLength
from wheeltapper.describe.track.base import Track
from wheeltapper.describe.vehicle.element import Element


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


RUN = (DummyBump, DummyPlastic, DummyCreep, dummy_feature)
DESCRIBED = (DummyContact, DummyTrack, DummyElement)
