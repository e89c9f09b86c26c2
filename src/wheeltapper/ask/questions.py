"""What `ask` answers by whole runs, beyond what the marches answer by themselves, and all questions with these."""

from __future__ import annotations

from dataclasses import replace

from wheeltapper.ground.needs import BILATERAL, YIELDING
from wheeltapper.march import run

TANGENTS = run.Question("gradient", run.GRADIENT.meaning, (run.WHEEL, *run.TURNED), frozenset({YIELDING}))
"""What has exact derivatives: those of the steps that were made."""
GRADIENT = replace(run.GRADIENT, marchers=run.MARCHERS, lacks=frozenset())
"""Anything: where there are no tangents, derivatives are differences of whole runs."""
_PARTING = tuple(replace(one, covers=one.covers - {BILATERAL}) for one in (run.WAGON, run.WAGON_ON_RAILS))
"""A wagon's marches of contacts that can be lost."""
BORDER = replace(run.BORDER, marchers=(*run.WHEELS, run.PARTING, *_PARTING))
QUESTIONS = run.QUESTIONS | {question.name: question for question in (GRADIENT, BORDER)}
"""All questions by name, in the order of the table of abilities."""
