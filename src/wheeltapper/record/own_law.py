"""Laws of one's own in records: notes on runs that go beyond their tables, and what files keep of their functions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.law import Law
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note
from wheeltapper.lower.laws.own_law import FASTEST
from wheeltapper.march.common import program as contract
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.wheel_rows import DELTA_RATE, ROW_DELTA

if TYPE_CHECKING:
    from wheeltapper.lower.wagon import LoweredWagon
    from wheeltapper.march.wagon.march import Marched as MarchedWagon

FloatArray = NDArray[np.float64]
DEPTHS, RATES = np.linspace(0.0, 1.0, 257)[1:] ** 2, np.linspace(-1.0, 1.0, 9)
"""Places, over the largest ones, at which a file keeps what a law's function returns."""
SAME = 1e-12
"""Difference of a function from what a file keeps of it, over its largest value, up to which it is the same one: other
processors round in other ways."""
BEHIND = np.linspace(0.0, 1.0, 17)
"""Times behind a maximum of a damped force at which its indentation is read, in radians of phase of a wheelset."""


def _sampled(law: Law) -> FloatArray:
    depths, rates = np.meshgrid(law.largest * DEPTHS, FASTEST * RATES if law.takes_rate else np.zeros(1))
    return law.values(depths.ravel(), rates.ravel())


def stored_law(law: Law) -> dict[str, Any]:
    """Return what a file keeps of a law: the name of its function, and what this returns at some places."""
    name = f"{getattr(law.force, '__module__', '')}.{getattr(law.force, '__qualname__', type(law.force).__name__)}"
    numbers = {"exponent": law.exponent, "largest": law.largest}
    return {"type": "Law", "force": name, **numbers, "returns": _sampled(law).tolist()}


def law_again(stored: dict[str, Any], function: Any) -> Law:
    """Return the law that a file keeps, with its function, which is given.

    Raises
    ------
    InputError
        If there is none, or another one.
    """
    name = stored.get("force")
    allowed = f"load(..., law=...) with the function that the record was made with, {name}: a file does not hold it"
    if function is None:
        raise InputError("", "contact.force", f"the name of a Python function, {name!r}", allowed)
    law = Law(force=function, **{field: stored.get(field) for field in ("exponent", "largest")})
    found, kept = _sampled(law), np.asarray(stored.get("returns"), dtype=float)
    if found.shape != kept.shape or not np.all(np.abs(found - kept) <= SAME * np.abs(kept).max(initial=0.0)):
        raise InputError("", "law", "a function that returns other forces than that of the record", allowed)
    return law


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


def beyond_table_of_wagon(law: Law, lowered: LoweredWagon, march: MarchedWagon) -> tuple[Note, ...]:
    """Return the same of a wagon: from its events, where it is fastest, and its maxima of forces and what follows.

    Damped contacts are deepest a little later.
    """
    A, peaks = lowered.assembly, march.peaks[:, [contract.PEAK_TIME]]
    behind = (peaks + A.numbers[asm.PULSE] * BEHIND[: len(BEHIND) if law.takes_rate else 1]).ravel()
    times = np.concatenate([[0.0], behind[behind <= march.end], march.events[:, contract.EVENT_TIME]])
    _, _, found = march.at(np.unique(times), np.array([ROW_DELTA, DELTA_RATE]))
    treads = np.flatnonzero(A.lanes[: int(A.numbers[asm.TREADS]), asm.SIDE].ravel())
    delta, rate = np.moveaxis(found[:, :, treads], 1, 0)
    fastest = np.abs(rate[delta >= 0.0]).max(initial=0.0)
    return beyond_table(law, float(delta.max()), float(fastest))
