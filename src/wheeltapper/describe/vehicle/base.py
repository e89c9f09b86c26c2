"""What every vehicle is."""

from __future__ import annotations

from wheeltapper.describe.noun import Noun


class Vehicle(Noun, abstract=True):
    """What rolls on the track."""
