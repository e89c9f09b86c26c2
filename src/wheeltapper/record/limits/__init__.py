"""Dated limits of railways and standards, and whether a run exceeds them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wheeltapper.ground.lazily import lazily

if TYPE_CHECKING:
    from wheeltapper.record.limits.comparison import Compared as Compared
    from wheeltapper.record.limits.comparison import LimitCheck as LimitCheck
    from wheeltapper.record.limits.comparison import check as check
    from wheeltapper.record.limits.rule import Rule as Rule
    from wheeltapper.record.limits.rule import read_rules as read_rules

_HOMES = {
    "Compared": "record.limits.comparison",
    "LimitCheck": "record.limits.comparison",
    "Rule": "record.limits.rule",
    "check": "record.limits.comparison",
    "read_rules": "record.limits.rule",
}
"""Public names of the room, and the module that holds each."""

__all__ = [*_HOMES]

__getattr__, __dir__ = lazily(__name__, _HOMES)
