"""Layouts of rails: a few features one after the other, described by coordinates between 0 and 1 for a search.

height, length  Logarithmic between their bounds. If several shapes are allowed, the range of the height's coordinate is
                divided into equal parts, one for each shape.
spacing         Distance from one start to the next, linear between its smallest value (features must not overlap) and
                its largest (the total length is limited).
fields          Other fields of the site, such as the mass of the deck: logarithmic between their bounds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.irregularity.bump import CosineBump
from wheeltapper.describe.irregularity.step import Step
from wheeltapper.describe.site import Site
from wheeltapper.ground.arguments import as_bounds, as_count, as_quantity, check_choice
from wheeltapper.ground.errors import InputError

FloatArray = NDArray[np.float64]
Bounds = tuple[float, float]

SHAPES = ("bump", "dip", "step up", "step down")
"""Shapes that a feature may have."""
FALLING = ("dip", "step down")
"""Shapes whose height is negative."""
FIRST = 5.0 / 46.0
"""Start of the first feature, in radii of the wheel after the trigger. The distance is needed because a wheel may touch
a step before its axle is above it."""
LISTENING = 36.0
"""Contact periods for which a recording goes on after the slowest passage has left the last feature. The impacts after
a feature carry information, too."""


class RailFeature(NamedTuple):
    """One feature of a rail; height and length are magnitudes, m."""

    shape: str
    height: float
    length: float
    start: float

    @property
    def signed_height(self) -> float:
        """The height with its sign, m."""
        return -self.height if self.shape in FALLING else self.height

    @property
    def irregularity(self) -> Irregularity:
        """The irregularity that describes the feature."""
        if self.shape.startswith("step"):
            return Step(height=self.signed_height, position=self.start)
        return CosineBump(height=self.signed_height, length=self.length, start=self.start)


class Layout(NamedTuple):
    """Features, and other fields by path."""

    features: tuple[RailFeature, ...]
    fields: dict[str, float]

    @property
    def total_length(self) -> float:
        """From the start of the first feature to the end of the last, m."""
        return max(one.start + one.length for one in self.features) - self.features[0].start

    def lowered(self, x: float, share: float, least: float, alike: bool) -> Layout:
        """Return the layout with a lower last feature before x, or with all features lower."""
        last = max(sum(one.start <= x for one in self.features) - 1, 0)
        features = [
            one._replace(height=max(share * one.height, least)) if alike or i == last else one
            for i, one in enumerate(self.features)
        ]
        return self._replace(features=tuple(features))


@dataclass(frozen=True)
class Family:
    """All layouts between some bounds.

    Attributes
    ----------
    number
        Number of features.
    shapes
        The elements of SHAPES that each feature may have.
    heights, lengths, spacing
        Bounds, m, of the magnitudes, and of the distance from one start to the next.
    total_length
        Largest total length, m.
    alike
        Whether all features are equal and have equal distances.
    fields
        By path, bounds of other fields that are chosen, too.
    first
        Start of the first feature, m after the trigger.
    """

    number: int
    shapes: tuple[str, ...]
    heights: Bounds
    lengths: Bounds
    spacing: Bounds
    total_length: float
    alike: bool = False
    fields: Mapping[str, Bounds] = field(default_factory=dict)
    first: float = 0.0

    def checked_family(self) -> Family:
        """Return the family in SI units; refuse wrong bounds."""
        if not self.shapes:
            raise InputError("", "shapes", "none", ", ".join(map(repr, SHAPES)))
        for shape in self.shapes:
            check_choice(shape, "shapes", SHAPES)
        heights, lengths = as_bounds(self.heights, "heights", "length"), as_bounds(self.lengths, "lengths", "length")
        spacing = as_bounds(self.spacing, "spacing", "length")
        fields = {path: as_bounds(bounds, path, "number") for path, bounds in self.fields.items()}
        number, length = as_count(self.number, "number"), as_quantity(self.total_length, "total_length", "length")
        out = Family(number, self.shapes, heights, lengths, spacing, length, self.alike, fields, self.first)
        if not out._least_length(number) <= length:
            raise InputError("", "total_length", f"{length:g}", f"at least {out._least_length(number):g} m")
        return out

    @property
    def coordinate_count(self) -> int:
        """Number of coordinates."""
        features = 2 + (self.number > 1) if self.alike else 3 * self.number - 1
        return features + len(self.fields)

    def passage_duration(self, slowest: float) -> float:
        """Return the time in which a wheel at this speed passes any of these layouts, s."""
        return (self.first + self.total_length) / slowest

    def layout_at(self, at: FloatArray) -> Layout:
        """Return the layout at some coordinates, each between 0 and 1."""
        left = np.clip(at, 0.0, 1.0).tolist()
        fields = {path: _log_interpolated(bounds, left.pop()) for path, bounds in [*self.fields.items()][::-1]}
        shape, height = self._shape_and_height(left.pop(0))
        features = [
            RailFeature(
                shape, height, self._feature_length(shape, left.pop(0), self.total_length, self.number - 1), self.first
            )
        ]
        share = left.pop(0) if self.alike and left else 0.0
        for rest in range(self.number - 2, -1, -1):
            last = features[-1]
            if not self.alike:
                share = left.pop(0)
                shape, height = self._shape_and_height(left.pop(0))
            room = self.total_length - (last.start - self.first) - max(self.spacing[0], last.length)
            length = last.length if self.alike else self._feature_length(shape, left.pop(0), room, rest)
            features.append(
                RailFeature(shape, height, length, last.start + self._distance_to_next(last, length, share, rest))
            )
        return Layout(tuple(features), dict(sorted(fields.items())))

    def coordinates_of(self, layout: Layout) -> FloatArray:
        """Return the coordinates of a layout, or of a similar one of this family: missing features are repeated."""
        given = layout.features
        features = (given * self.number)[: self.number]
        out = [*self._size_coordinates(features[0])]
        for i, one in enumerate(features[1:], 1):
            apart = one.start - features[i - 1].start if i < len(given) else 0.0
            least, most = self._distance_range(features[i - 1], one.length, self.number - 1 - i)
            share = (apart - least) / (most - least) if most > least and apart > 0.0 else 0.5
            if not self.alike:
                out += [share, *self._size_coordinates(one)]
            elif i == 1:
                out.append(share)
        fields = [_log_share(bounds, layout.fields[path]) for path, bounds in self.fields.items()]
        return np.clip([*out, *fields], 0.0, 1.0)

    def with_feature_sizes(self, parts: Sequence[RailFeature], at: FloatArray) -> FloatArray:
        """Return coordinates in which the sizes are those of the given features."""
        out = at.copy()
        for i, part in enumerate(parts):
            out[3 * i : 3 * i + 2] = self._size_coordinates(part)
        return out

    def _size_coordinates(self, one: RailFeature) -> tuple[float, ...]:
        part = self.shapes.index(one.shape) if one.shape in self.shapes else 0
        height = (part + np.clip(_log_share(self.heights, one.height), 0.0, 1.0 - 1e-9)) / len(self.shapes)
        return float(height), _log_share(self.lengths, one.length or self.lengths[0])

    def _shape_and_height(self, share: float) -> tuple[str, float]:
        part = min(int(share * len(self.shapes)), len(self.shapes) - 1)
        return self.shapes[part], _log_interpolated(self.heights, share * len(self.shapes) - part)

    def _least_length(self, number: int) -> float:
        """Return the smallest total length of a number of features."""
        return self.lengths[0] + (number - 1) * max(self.spacing[0], self.lengths[0])

    def _feature_length(self, shape: str, share: float, room: float, rest: int) -> float:
        """Return the length of a feature that starts with `room` left, m, if `rest` more features must follow."""
        if shape.startswith("step"):
            return 0.0
        most = room - self._least_length(rest) if rest else room
        if self.alike:
            most = min(room / (rest + 1), room - rest * self.spacing[0])
        return min(_log_interpolated(self.lengths, share), most)

    def _distance_to_next(self, last: RailFeature, length: float, share: float, rest: int) -> float:
        """Return the distance to the next feature."""
        least, most = self._distance_range(last, length, rest)
        return least + share * (most - least)

    def _distance_range(self, last: RailFeature, length: float, rest: int) -> Bounds:
        """Return the smallest and the largest distance to the next feature, if `rest` more must follow it."""
        room = self.total_length - (last.start - self.first)
        least = max(self.spacing[0], last.length)
        behind = max(self.spacing[0], length) + self._least_length(rest) if rest else length
        most = (room - length) / (rest + 1) if self.alike else room - behind
        return least, max(min(self.spacing[1], most), least)


def _log_interpolated(bounds: Bounds, share: float) -> float:
    low, high = bounds
    return float(low * (high / low) ** share)


def laid_out(site: Site, layout: Layout, duration: float) -> Site:
    """Return the site with another rail; its features have the uncertainties of the site's first one.

    A recording lasts `duration`, s, or as long as the site's if that is longer.
    """
    items = tuple(one.irregularity for one in layout.features)
    changes = {"irregularity": items, "duration": max(float(site.passage.duration), duration), **layout.fields}
    known = {path: share for path, share in site.uncertainty.items() if not path.startswith("irregularity.")}
    first = {path.split(".", 2)[2]: s for path, s in site.uncertainty.items() if path.startswith("irregularity.0.")}
    for i, item in enumerate(items):
        known |= {f"irregularity.{i}.{name}": share for name, share in first.items() if hasattr(item, name)}
    return Site(passage=site.passage.replaced(changes), sensor=site.sensor, uncertainty=known, name=site.name)


def _log_share(bounds: Bounds, value: float) -> float:
    low, high = bounds
    return float(np.log(value / low) / np.log(high / low)) if high > low else 0.0
