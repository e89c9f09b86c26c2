"""A train that was measured, and by what."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from wheeltapper.diagnosis.train import TrainFinding
from wheeltapper.diagnosis.wayside.passage import Passage
from wheeltapper.diagnosis.wayside.pulses import Pulses
from wheeltapper.diagnosis.wayside.wheels import Side


class Measured(NamedTuple):
    """A train, and what it was measured by."""

    finding: TrainFinding
    passage: Passage
    pulses: list[Pulses]
    sides: Sequence[Side]
