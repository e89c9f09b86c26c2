"""A wheel flat that wear has rounded."""

from __future__ import annotations

from wheeltapper.diagnosis.faults.flat import Flat


class RoundedFlat(Flat):
    """A rounded flat; it acts like a fresh one of 0.7 times its length."""

    name, rank = "rounded flat", 90.0
    meaning = "a tread has a flat that wear has rounded"
    usual, shape, like = 0.06, "rounded", 0.7
