"""A fresh wheel flat."""

from __future__ import annotations

from wheeltapper.diagnosis.faults.flat import Flat


class FreshFlat(Flat):
    """A fresh flat: a chord of the circle."""

    name, rank = "wheel flat", 80.0
    meaning = "a tread has a fresh flat"
    usual, shape, like = 0.04, "fresh", 1.0
    usual_range, assessed = (0.002, 0.02), True
