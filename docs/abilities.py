"""Write the page of what can be asked of what, from the data by which the door chooses and refuses.

Run by the documentation's build; `python docs/abilities.py` writes the page into the repository.
"""

from itertools import combinations
from pathlib import Path

from wheeltapper.ask.questions import QUESTIONS
from wheeltapper.ground.needs import VOCABULARY, Need
from wheeltapper.march.run import MARCHERS, Question

PAGE = Path(__file__).parent / "guide" / "abilities.rst"
HEAD = """What can be asked of what
=========================

The first table shows which analyses work with which models. Each row is an analysis, named by its function or option,
and each column is a part of a model, such as a wagon or creep. "Yes": they work together; "only": the analysis needs
this part. Every analysis takes Hertz's contact, given or computed, and both methods (default and strict). The second
table shows which solvers inside the package (*marches*) cover which part. The list at the end names parts that need or
exclude each other. The page is generated from the data by which the program accepts and refuses. What is refused gets
one sentence, which says what does not work, and what would:

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


def page() -> str:
    """Return the page's text."""
    return "\n".join([HEAD, _questions(), _marches(), _together()])


def _questions() -> str:
    rows = [
        (f"``{one.name}``", one.meaning, *(_answer(one, need) for need in VOCABULARY)) for one in QUESTIONS.values()
    ]
    return _table("Questions", ("question", "about", *(need.name for need in VOCABULARY)), rows)


def _marches() -> str:
    rows = [
        (need.name, f"``{need.field}``", need.words, *("yes" if need in one.covers else "–" for one in MARCHERS))
        for need in VOCABULARY
    ]
    return _table("Marches", ("need", "field", "brought by", *(one.name for one in MARCHERS)), rows)


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


def _answer(question: Question, need: Need) -> str:
    if need in question.requires or all(need in one.requires for one in question.marchers):
        return "only"
    return "yes" if any(need in question.covered_by(one) for one in question.marchers) else "–"


def _clash(a: Need, b: Need) -> bool:
    """Return whether two needs, of different fields, go to no march together."""
    return a.field != b.field and not any({a, b} <= one.covers for one in MARCHERS)


def _table(title: str, header: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    def line(cells: tuple[str, ...]) -> str:
        return ", ".join(f'"{cell.replace(chr(34), chr(34) * 2)}"' for cell in cells)

    options = [f"   :header: {line(header)}", "   :stub-columns: 1", ""]
    return "\n".join(
        [title, "-" * len(title), "", ".. csv-table::", *options, *(f"   {line(row)}" for row in rows), ""]
    )


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
