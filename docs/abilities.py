"""Write the page of what can be asked of what, from the data by which the door chooses and refuses.

Run by the documentation's build; `python docs/abilities.py` writes the page into the repository.
"""

from itertools import combinations
from pathlib import Path

from wheeltapper.ask.questions import QUESTIONS
from wheeltapper.ground.needs import VOCABULARY, Need
from wheeltapper.march.run import MARCHERS, Question

PAGE = Path(__file__).parent / "guide" / "abilities.rst"
TABLE = PAGE.with_suffix(".csv")
HEAD = """What can be asked of what
=========================

This page shows which analyses work with which models. Each analysis is named by its function or option. It works with
everything that is not named beside it, with Hertz's contact, given or computed, and with both methods (default and
strict). :download:`The whole table <abilities.csv>` has a column for each part of a model. The page is generated from
the data by which the program accepts and refuses. What is refused gets one sentence, which says what does not work, and
what would:

.. code-block:: python

   import wheeltapper as wt

   wheelset = wt.Scenario(vehicle=wt.Wheelset(mass=1500, load=91_307), speed=20.0, duration=0.1)
   try:
       wt.modes(wheelset)
   except wt.InputError as error:
       refused = error

   assert str(refused) == (
       "vehicle: found a Wheelset, which `modes` does not take; allowed: a Wagon"
   )
"""


GROUPS = {
    "Can I simulate it, and look at the run?": (
        "simulate", "history", "energy", "features", "damper_events", "suspension_events", "track", "comfort",
        "guidance", "marks",
    ),
    "Can I vary it?": ("sweep", "gradient", "border"),
    "Can I find what repeats, grows or builds up?": ("orbits", "modes", "critical_speed", "wear_in"),
    "Can I read it back from the recording of a deck?": (
        "diagnose", "information", "coupled=True", "coupled=False", "motion_at", "trajectory",
    ),
    "Can I simplify it, or load it unevenly?": ("reduced", "imbalance"),
}  # fmt: skip
"""The questions, by what a reader asks."""


def page() -> str:
    """Return the page's text."""
    return "\n".join([HEAD, *(_group(title, names) for title, names in GROUPS.items()), _marches(), _together()])


def table() -> str:
    """Return the whole table, as CSV."""
    header = ("question", "about", *(need.name for need in VOCABULARY))
    rows = [(one.name, one.meaning, *(_answer(one, need) for need in VOCABULARY)) for one in QUESTIONS.values()]
    return "".join(f"{_line(row)}\n" for row in (header, *rows))


def _group(title: str, names: tuple[str, ...]) -> str:
    rows = []
    for one in (QUESTIONS[name] for name in names):
        needed = [need for need in VOCABULARY if _answer(one, need) == ONLY]
        refused = [need for need in VOCABULARY if _answer(one, need) == NO and _is_news(one, need, needed)]
        parts = (", ".join(need.name for need in those) or NO for those in (needed, refused))
        rows.append((f"``{one.name}``", one.meaning, *parts))
    return _table(title, ("analysis", "about", "needs", "does not work with"), rows, "16 28 16 40")


def _is_news(question: Question, refused: Need, needed: list[Need]) -> bool:
    """Return whether it does not follow from what else a question needs or refuses that it refuses a need."""
    owner = _owner(refused)
    if owner is not None and _answer(question, owner) == NO:
        return False
    return any({refused, *needed} <= one.covers for one in MARCHERS)


def _marches() -> str:
    rows = [
        (need.name, f"``{need.field}``", need.words, *("yes" if need in one.covers else "–" for one in MARCHERS))
        for need in VOCABULARY
    ]
    return _table("Inside the package", ("part", "field", "brought by", *(one.name for one in MARCHERS)), rows)


def _together() -> str:
    lines = ["Together, and not together", "--------------------------", ""]
    bound = {need: owner for need in VOCABULARY if (owner := _owner(need)) is not None}
    lines += [f"- {need.name}: only with {owner.name}" for need, owner in bound.items()]
    met = [need for need in VOCABULARY if any(need in one.covers for one in MARCHERS)]
    lines += [f"- {need.name}: not yet" for need in VOCABULARY if need not in met]
    for need in met:
        others = [b.name for a, b in combinations(met, 2) if a is need and not {a, b} & {*bound} and _clash(a, b)]
        lines += [f"- {need.name}: not with {', '.join(others)}"] if others else []
    return "\n".join([*lines, ""])


def _owner(need: Need) -> Need | None:
    """Return what else there is wherever a need can be met; nothing where it may stand alone, or is not met at all."""
    requires = [one.requires for one in MARCHERS if need in one.covers]
    required = frozenset.intersection(*requires) - {need} if requires else frozenset()
    return min(required, key=VOCABULARY.index, default=None)


YES, ONLY, NO = "yes", "only", "–"
"""A question takes a need, needs it, or refuses it."""


def _answer(question: Question, need: Need) -> str:
    if need in question.requires or all(need in one.requires for one in question.marchers):
        return ONLY
    return YES if any(need in question.covered_by(one) for one in question.marchers) else NO


def _clash(a: Need, b: Need) -> bool:
    """Return whether two needs, of different fields, go to no march together."""
    return a.field != b.field and not any({a, b} <= one.covers for one in MARCHERS)


def _line(cells: tuple[str, ...]) -> str:
    return ", ".join(f'"{cell.replace(chr(34), chr(34) * 2)}"' for cell in cells)


def _table(title: str, header: tuple[str, ...], rows: list[tuple[str, ...]], widths: str = "auto") -> str:
    options = [f"   :header: {_line(header)}", f"   :widths: {widths}", "   :stub-columns: 1", ""]
    return "\n".join(
        [title, "-" * len(title), "", ".. csv-table::", *options, *(f"   {_line(row)}" for row in rows), ""]
    )


def write() -> None:
    """Write the page and the table."""
    PAGE.write_text(page(), encoding="utf-8")
    TABLE.write_text(table(), encoding="utf-8")


if __name__ == "__main__":
    write()
