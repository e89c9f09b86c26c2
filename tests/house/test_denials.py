"""What the words say cannot be done, against the table of what can: a denial ends where its cell is opened.

Pages, public docstrings and notes are searched for sentences that deny something of a need or a question. Each has to
be one of `DENIALS`, with the cells of the table that make it true, or one of `OTHERS`, which deny nothing of the table.
"""

import ast
import inspect
import re
from dataclasses import dataclass
from functools import cache

import pytest

import wheeltapper as wt
from wheeltapper.ask.questions import QUESTIONS, TANGENTS
from wheeltapper.ground import needs as need
from wheeltapper.ground.needs import Need
from wheeltapper.march import run

from .test_documentation import PAGES, ROOT, name

WORDS = {
    need.SEVERAL_BODIES: r"wagons?|coach(?:es)?", need.WHEELSETS: "wheelsets|axles", need.BOGIE: "bogies?",
    need.DAMPER_END: "bush(?:es)?|dampers?", need.DAMPER_PLAY: "play", need.FRICTION: "friction",
    need.BUMPSTOP: "bumpstops?|stops", need.SPRING_CORNERS: "corners?|springs?|suspensions?", need.BLOW_OFF: "blow-off",
    need.DECK: "decks?", need.DECK_ENDS: "ends", need.FLEXIBLE_TRACK: "rails?|tracks?|sleepers?|slab",
    need.ANOMALY: "anomal[a-z]+|seats?|scatter", need.VOID: "voids?", need.YIELDING: "yields?|yielding|plastic|marks",
    need.ALONE: "elastic-plastic", need.OWN_LAW: "laws?", need.LINEAR: "linear", need.BILATERAL: "bilateral|pulls?",
    need.HYSTERESIS: "hysteresis", need.CREEP: "creep", need.PROFILES: "profiles?", need.PLACES: "places",
    need.IRREGULARITY: "irregularit[a-z]+", need.POINT: "circle|point", need.START: "at rest", need.MEMORY: "spot",
}  # fmt: skip
"""What sentences call the needs."""
ASKED = "gradients?|tangents?|maps?|borders?|orbits?|modes|comfort|guidance|diagnos[a-z]+|wear_in|exact derivatives?"
DENIES = re.compile(
    r"\b(?:refuse[sd]?|neither\b.*\bnor|not yet|not there|there (?:are|is) none|are there none|is rigid|are linear"
    r"|cannot be (?:the|an?|asked|computed|diagnosed|differentiated|mapped|marched|simulated)|leaves out|no march"
    r"|not (?:take|takes|computed|simulated|compared|covered|supported)|do(?:es)? not (?:roll|bend|yield|take)"
    rf"|no (?:{ASKED}))\b",
    re.IGNORECASE,
)
NAMES = re.compile(rf"\b(?:{'|'.join(WORDS.values())}|{ASKED}|derivatives?)\b", re.IGNORECASE)
NO_PROSE = re.compile(
    r"^```(?s:.*?)^```$|^\.\. (?:code-block|math|literalinclude|csv-table|figure|image|kinds|toctree)"
    r"::.*\n(?:(?: {3}.*)?\n)*"
    r"|^=+(?: +=+)+\n(?:.+\n)*",
    re.MULTILINE,
)


def sentences(text):
    for block in re.split(r"\n\s*\n|\n(?=\s*[*-] )", text):
        yield from re.split(r"(?<=[.!?:;])\s+(?=[A-Z`*(\"])", " ".join(block.split()))


def notes_of(path):
    """Yield the texts of a module's notes."""
    text = path.read_text(encoding="utf-8")
    for node in ast.walk(ast.parse(text if " Note(" in text else "")):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Note" and node.args:
            yield " ".join(
                one.value
                for one in ast.walk(node.args[0])
                if isinstance(one, ast.Constant) and isinstance(one.value, str)
            )


@cache
def denials_found():
    """Return all sentences that deny something, with where they stand."""
    rooms = [getattr(wt, one) for one in wt.__all__ if inspect.ismodule(getattr(wt, one))]
    public = {one: getattr(home, one) for home in (wt, *rooms) for one in getattr(home, "__all__", ())}
    texts = [(name(page), NO_PROSE.sub("\n\n", page.read_text(encoding="utf-8"))) for page in PAGES]
    texts += [(f"wt: {one}", inspect.getdoc(noun) or "") for one, noun in public.items() if callable(noun)]
    texts += [(name(path), note) for path in sorted((ROOT / "src").rglob("*.py")) for note in notes_of(path)]
    return [
        (where, one) for where, text in texts for one in sentences(text) if DENIES.search(one) and NAMES.search(one)
    ]


@dataclass(frozen=True)
class Refused:
    """A cell of the table that is closed: a question, and what it does not take together with what else is there."""

    question: run.Question
    refused: Need
    among: tuple[Need, ...] = ()

    @property
    def holds(self):
        """Whether the question is answered without what is refused, and not with it."""
        around = self.question.requires | {*self.among}
        return (
            run.fastest_march(self.question, around - {self.refused}) is not None
            and run.fastest_march(self.question, around | {self.refused}) is None
        )


def refused(question, *needs, among=()):
    return tuple(Refused(QUESTIONS.get(question, TANGENTS), one, among) for one in needs)


KINKS = (need.FRICTION, need.BUMPSTOP, need.SPRING_CORNERS, need.BLOW_OFF)
DENIALS = {
    "A wagon cannot be the vehicle of a site": refused("diagnose", need.SEVERAL_BODIES),
    "an answer agrees with that of ``simulate``, or the question is refused": (
        *refused("information", need.YIELDING, need.DAMPER_END, need.DAMPER_PLAY),
        *refused("coupled=True", need.HYSTERESIS, need.LINEAR, need.YIELDING, need.DAMPER_PLAY),
    ),
    "orbits on rails are not computed": refused("orbits", need.FLEXIBLE_TRACK),
    "The rail here is rigid, or a rigid deck": refused("orbits", need.FLEXIBLE_TRACK),
    "orbits and diagnoses refuse them": refused("orbits", *KINKS) + refused("diagnose", *KINKS),
    "A contact that pulls (``wt.Linear(bilateral=True)``) is never lost, and has no border": refused(
        "border", need.BILATERAL, among=(need.FLEXIBLE_TRACK, need.LINEAR)
    ),
    "``wt.modes`` is refused": refused("modes", need.FLEXIBLE_TRACK, among=(need.SEVERAL_BODIES,)),
    "What has no tangents is differenced: wagons, contacts that yield, dampers with play": (
        *refused("tangents", need.SEVERAL_BODIES, need.YIELDING, need.DAMPER_END, *KINKS),
        *refused("tangents", need.DAMPER_PLAY, need.ANOMALY, among=(need.FLEXIBLE_TRACK,)),
        *refused("tangents", need.DECK_ENDS, among=(need.WHEELSETS, need.DECK)),
    ),
    "has no tangents (wagons, contacts that yield, dampers with ends, friction and other kinks": (
        *refused("tangents", need.SEVERAL_BODIES, need.YIELDING, need.DAMPER_END, *KINKS),
        *refused("tangents", need.DAMPER_PLAY, need.ANOMALY, among=(need.FLEXIBLE_TRACK,)),
    ),
    "The march of a wagon has no tangents": refused("tangents", need.SEVERAL_BODIES),
    "A wagon at rest on a contact that yields is refused": refused(
        "simulate", need.MEMORY, among=(need.SEVERAL_BODIES, need.YIELDING)
    ),
    "Two models have no exact derivatives here: an elastic-plastic contact": refused(
        "trajectory", need.YIELDING, need.DAMPER_END, need.DAMPER_PLAY
    ),
    "the motion has no exact derivatives: an elastic-plastic contact": refused(
        "information", need.YIELDING, need.DAMPER_END, need.DAMPER_PLAY
    ),
    "A damper with free play or a bush is not compared on an elastic-plastic or on a bilateral contact": (
        *refused("diagnose", need.YIELDING, among=(need.DAMPER_END,)),
        *refused("diagnose", need.BILATERAL, among=(need.DAMPER_END, need.LINEAR)),
    ),
}
"""Sentences that deny what can be asked, by words of theirs, with the cells that are refused."""
OTHERS = (
    # what a model is, for all questions
    "they do not bend, and both rails move vertically only", "`StiffTrack` and the deck do not bend at all",
    "Flanges of wagons do not yield", "This model leaves out lateral motion", "the track is rigid: at a flat",
    "whose inertia the wheelset's model leaves out", "leaves out short waves by its geometry",
    "the energy within the track is not computed", "neither pad nor fastening",
    # what a scenario, a field or a recording is refused for, whatever marches it
    "there, ``patch`` is refused", "those cells are *refused*",
    "fields that are counts or switches are refused by name", "a void, which is not linear, and scatter are refused",
    "Names of loads are checked", "A normal force from a rigid link is not unique",
    "hunts already at the lowest speed is refused", '``wear_in`` refuses ``rolling="circle"``',
    "``wear_in`` refuses circle rolling", "Runs on rails are refused below 0.25 m/s",
    "An anomaly at a seat that no wheel comes near is refused", "the wheel does not roll or not as a point",
    "or the wheels do not roll", "If the scenario has no orbits", "If it is no orbit", "it is not compared",
    # features without derivatives, and what follows for those beside them
    "P2 is filtered, and has no exact derivative", "There are no gradients, and each cell of a map",
    "If one quantity has no tangents", "What has no tangents is differenced, see below",
    "the site's motion has no exact derivatives", "What has no tangents has differences",
    "where it counts something: then it has no gradient",
    # mechanics
    "What makes no train is refused", "longer ones are refused in a line",
    "where it lies on no orbit", "then no orbit attracts",
    "Modes without any damping neither grow nor decay", "They say nothing about whether a rail is rigid",
    "up to which it does not yield", "neither load nor contact constant", "d and v are linear in the state",
)  # fmt: skip
"""Words of sentences that the search finds, and that deny nothing of the table."""


def test_whatever_is_denied_is_listed():
    known = (*DENIALS, *OTHERS)
    new = [f"{where}: {one}" for where, one in denials_found() if not any(words in one for words in known)]
    assert not new, "bind them to cells of the table:\n" + "\n".join(new)


def test_whatever_is_listed_is_still_said():
    said = [one for _, one in denials_found()]
    assert [words for words in (*DENIALS, *OTHERS) if not any(words in one for one in said)] == []


@pytest.mark.parametrize("words", DENIALS)
def test_what_is_denied_is_refused(words):
    assert DENIALS[words]
    answered = [(one.question.name, one.refused.name) for one in DENIALS[words] if not one.holds]
    assert not answered, f"no longer true: {answered}"


@pytest.mark.parametrize(
    "sentence",
    [
        "The track is rigid, or one mass on a bearing (a scale's deck).",
        "Springs and dampers are linear, with stops.",
        "Dry friction, as in Y25 bogies, is not there.",
        "A diagnosis takes one wheelset's acceleration of a deck: neither forces nor several axles in one record.",
        "The two rails are equal tracks side by side, each on half of every sleeper: sleepers do not roll.",
        "On rails there are maps with such dampers; on a stiff rail or a deck there are none.",
        "Fields of the track itself change its modes: they are refused.",
        "A damper with free play or a bush cannot be simulated on a bilateral contact.",
    ],
)
def test_the_search_finds_denials(sentence):
    """Each of these once stood in a page after it had become false."""
    assert DENIES.search(sentence)
    assert NAMES.search(sentence)


def test_a_denial_of_what_can_be_done_does_not_hold():
    """The cells by which the sentences above would have been bound."""
    false = [
        *refused("simulate", need.FRICTION, need.FLEXIBLE_TRACK, need.WHEELSETS),
        *refused("sweep", need.DAMPER_PLAY, among=(need.DAMPER_END,)),
        *refused("simulate", need.BILATERAL, among=(need.DAMPER_END, need.LINEAR)),
        *refused("gradient", need.ANOMALY, among=(need.FLEXIBLE_TRACK,)),
    ]
    assert not any(one.holds for one in false)


def test_every_need_has_words():
    assert [*WORDS] == [*need.VOCABULARY]
