"""What `ask` answers by whole runs, beyond what the marches answer by themselves, and all questions with these."""

from __future__ import annotations

from dataclasses import replace

from wheeltapper.ground.needs import BILATERAL, YIELDING
from wheeltapper.march import run

_BY_RUNS = (run.YIELDING_WHEEL, run.ENDED_WHEEL)
"""Marches of one wheel that march each cell of a map alone."""
SWEEP = replace(run.SWEEP, marchers=(*run.SWEEP.marchers, *_BY_RUNS, run.GENERAL))
TANGENTS = run.Question("gradient", run.GRADIENT.meaning, (run.WHEEL, *run.TURNED), frozenset({YIELDING}))
"""What has exact derivatives: those of the steps that were made."""
GRADIENT = replace(run.GRADIENT, marchers=run.MARCHERS, lacks=frozenset())
"""Anything: where there are no tangents, derivatives are differences of whole runs."""
_PARTING = tuple(
    run.Marcher(one.name, one.covers - {BILATERAL}, one.requires)
    for one in (run.WAGON, run.WAGON_ON_RAILS, run.GENERAL)
)
"""Marches of contacts that can be lost."""
BORDER = replace(run.BORDER, marchers=(run.WHEEL, *run.PARTING, *_BY_RUNS, *_PARTING))
QUESTIONS = run.QUESTIONS | {question.name: question for question in (SWEEP, GRADIENT, BORDER)}
"""All questions by name, in the order of the table of abilities."""


def is_by_runs(marcher: run.Marcher) -> bool:
    """Return whether a march makes each cell of a map as a run with a record of its own."""
    return marcher.is_of_wagons or marcher in _BY_RUNS
