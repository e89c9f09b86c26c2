"""Why marches end, as users are told."""

from __future__ import annotations

from wheeltapper.ground.outcome import Outcome
from wheeltapper.lower.lowered import balanced
from wheeltapper.march.common import program as contract
from wheeltapper.march.general import layout
from wheeltapper.march.wagon import assembly

OUTCOMES = {
    contract.DONE: Outcome.COMPLETED,
    contract.FULL: Outcome.OUT_OF_MEMORY,
    balanced.UNBALANCED: Outcome.UNBALANCED,
    contract.TOO_MANY_EVENTS: Outcome.EVENT_LIMIT,
    contract.NOT_FINITE: Outcome.NOT_FINITE,
    contract.STALLED: Outcome.STALLED,
    contract.END_OF_PATH: Outcome.END_OF_PATH,
    assembly.DERAILED: Outcome.DERAILED,
    layout.CHATTERS: Outcome.CHATTERING,
    layout.UNSOLVED: Outcome.UNSOLVED,
}
"""Outcome of each status of a march."""
