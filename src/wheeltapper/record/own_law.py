"""Notes on runs that go beyond the table of a law of one's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.describe.contact.law import Law
from wheeltapper.ground.notes import Note
from wheeltapper.lower.own_law import FASTEST
from wheeltapper.march import assembly as asm
from wheeltapper.march import program as contract
from wheeltapper.march import run
from wheeltapper.march.wheel_rows import DELTA_RATE, ROW_DELTA

if TYPE_CHECKING:
    from wheeltapper.lower.wagon import LoweredWagon
    from wheeltapper.march.multibody import MultibodyMarch

BEHIND = np.linspace(0.0, 1.0, 17)
"""Times behind a maximum of a damped force at which its indentation is read, in radians of phase of a wheelset."""


def beyond_table(law: Law, deepest: float, fastest: float) -> tuple[Note, ...]:
    """Return notes on the largest indentation of a run, m, and on its largest rate, m/s."""
    largest = float(law.largest)
    depth = (
        f"the indentation reached {1e3 * deepest:.4g} mm; the table of the contact's law ends at "
        f"{1e3 * largest:.4g} mm and goes on there with the power of its exponent"
    )
    rate = (
        f"the indentation's rate reached {fastest:.4g} m/s; the table of the contact's law ends at {FASTEST:g} m/s, "
        "beyond which the force goes on straight"
    )
    gone = ((depth, deepest / largest), (rate, fastest / FASTEST if law.takes_rate else 0.0))
    return tuple(Note(text, "own law", ratio, doubtful=True) for text, ratio in gone if ratio > 1.0)


def beyond_table_of_wagon(law: Law, lowered: LoweredWagon, march: MultibodyMarch) -> tuple[Note, ...]:
    """Return the same of a wagon: from its events, where it is fastest, and its maxima of forces and what follows.

    Damped contacts are deepest a little later.
    """
    A, peaks = lowered.assembly, march.peaks[:, [contract.PEAK_TIME]]
    behind = (peaks + A.numbers[asm.PULSE] * BEHIND[: len(BEHIND) if law.takes_rate else 1]).ravel()
    times = np.concatenate([[0.0], behind[behind <= march.end], march.events[:, contract.EVENT_TIME]])
    _, _, found = run.replay(A, march, np.unique(times), np.array([ROW_DELTA, DELTA_RATE]))
    treads = np.flatnonzero(A.lanes[: int(A.numbers[asm.TREADS]), asm.SIDE].ravel())
    delta, rate = np.moveaxis(found[:, :, treads], 1, 0)
    fastest = np.abs(rate[delta >= 0.0]).max(initial=0.0)
    return beyond_table(law, float(delta.max()), float(fastest))
