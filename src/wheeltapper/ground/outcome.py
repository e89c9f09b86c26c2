"""Outcomes of a computation: each has a sentence and a remedy."""

from __future__ import annotations

from enum import Enum


class Outcome(Enum):
    """Outcome of a simulation: `sentence` states what happened, `remedy` what the user can do."""

    COMPLETED = ("the run reached its end", "")
    EVENT_LIMIT = (
        "the run stopped because contact was lost and regained more often than the limit allows",
        "shorten the duration; if the wheel truly chatters for ever, add damping or hysteresis to the contact",
    )
    NOT_FINITE = (
        "the motion grew beyond the largest number of a computer",
        "check the orders of magnitude of stiffness, damping and mass",
    )
    STALLED = (
        "time no longer advances: events follow each other faster than the digits of a number can tell",
        "check for breakpoints of the irregularity that lie closer together than 1e-12 m",
    )
    END_OF_PATH = (
        "the irregularity ends before the run does",
        'state what lies beyond (beyond="flat") or shorten the duration',
    )

    UNBALANCED = (
        "the energy of the run does not balance: its results are wrong",
        'check the orders of magnitude of stiffness, damping and mass, and try method="strict"',
    )
    OUT_OF_MEMORY = (
        "the run stopped because its record would no longer fit in memory",
        "shorten the duration",
    )

    CHATTERING = (
        "contact was lost and regained so often in a moment that its events cannot be told apart",
        "check for an irregularity of very short waves, or add damping to the contact",
    )
    UNSOLVED = (
        "the contact force could not be computed any further",
        'check the contact law and the orders of magnitude, or try method="strict"',
    )
    DERAILED = (
        "a wheel left the rails",
        "lower the irregularity or the speed, or check gauge and profiles",
    )

    @property
    def sentence(self) -> str:
        """What happened."""
        return str(self.value[0])

    @property
    def remedy(self) -> str:
        """What the user can do; empty if nothing is wrong."""
        return str(self.value[1])
