"""Notes on runs that go beyond what the laws of their contacts were stated for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from wheeltapper.describe.contact.force_law import ForceLaw
from wheeltapper.ground.needs import OWN_LAW
from wheeltapper.ground.notes import Note
from wheeltapper.lower.laws.own_law import FASTEST
from wheeltapper.lower.laws.plastic import PlasticLaw
from wheeltapper.lower.lowered.base import LoweredScenario
from wheeltapper.march.common import program as contract


def beyond_laws(lowered: LoweredScenario, march: Any) -> tuple[Note, ...]:
    """Return notes where a march left the range of its creep law, a law of one's own or a plastic law."""
    scenario = lowered.scenario
    notes: tuple[Note, ...] = ()
    if scenario.creep is not None:
        from wheeltapper.record.creep_range import beyond_spin

        notes = beyond_spin(lowered, march)
    if OWN_LAW in scenario.needs:
        notes += beyond_table(scenario.contact, *march.extremes())
    if not lowered.plastic_laws:
        return notes
    contacts = lowered.contacts
    contact = contacts.contact_of_rows(march.peaks)
    forces = march.peaks[:, contract.PEAK_FORCE] * lowered.force * contacts.sides  # as if both wheels pressed alike
    treads = contact < len(contacts.static_force)
    reached = [
        float(forces[treads & (contact // contacts.sides == wheelset)].max(initial=0.0))
        for wheelset in range(contacts.wheelsets)
    ]
    return notes + beyond_plastic(scenario.contact, lowered.plastic_laws, reached)


def beyond_plastic(contact: Any, laws: Sequence[PlasticLaw], reached: Sequence[float]) -> tuple[Note, ...]:
    """Return the same of plastic laws of wheelsets, of the worst one; `reached` are the largest forces, N."""
    stated = [law.force_at(contact.limit) for law in laws]
    force, allowed = max(zip(reached, stated, strict=True), key=lambda one: one[0] / one[1])
    if force <= allowed:
        return ()
    text = (
        f"the contact force reaches {force / 1e3:.4g} kN, but {type(contact).__name__} holds up to "
        f"{contact.limit:g} times the indentation at yield, {allowed / 1e3:.4g} kN: beyond that it is extrapolated"
    )
    return (Note(text, "beyond the law", force / allowed, doubtful=True),)


def beyond_table(law: ForceLaw, deepest: float, fastest: float) -> tuple[Note, ...]:
    """Return notes on the largest indentation of a run, m, and on its largest rate, m/s."""
    largest = float(law.largest)
    depth = (
        f"the indentation reached {1e3 * deepest:.4g} mm; the table of the contact's law ends at "
        f"{1e3 * largest:.4g} mm (`largest`), beyond which its force is extrapolated as a power, by its exponent"
    )
    rate = (
        f"the indentation's rate reached {fastest:.4g} m/s; the table of the contact's law ends at {FASTEST:g} m/s, "
        "beyond which its force is extrapolated along a straight line"
    )
    gone = ((depth, deepest / largest), (rate, fastest / FASTEST if law.takes_rate else 0.0))
    return tuple(Note(text, "own law", ratio, doubtful=True) for text, ratio in gone if ratio > 1.0)
