"""Public prose in plain words: phrases that readers had to read twice do not come back, and words are explained."""

import inspect
import re
from functools import cache

import pytest

import wheeltapper as wt

from .test_documentation import PAGES, ROOT, name

STUMBLED_OVER = (
    # of a model and of what it can
    "are at the front door too", "equal scenarios are equal", "states to what the force belongs",
    "nothing that cannot be felt changes the static state", "carry what stands on them", "with which it goes",
    "every contact that is elastic goes with them", "it goes where a function goes", "it answers with its course",
    "a scenario says what it needs of a march", "from the data that choose and refuse", "it makes no sense without",
    "what the one-sidedness of a real contact does", "which half a coach that cannot roll is",
    "friction without a spring that sticks", "all that stick hold the wagon together",
    "all that are at rest are decided together", "elastic wheels touch along a patch", "begins to lose its rail",
    "the same has to happen in the same order", "a filter without phase needs what follows",
    "waves that excite more than the modes of a track know", "a scenario shows who runs", "what a track cannot say",
    "no result says", "is also the answer to that", "softer pads spare sleepers",
    # of runs and their results
    "supplied is what the works are together", "march too often for this check",
    "brought back from what it was made of", "a name that is none is answered", "so that the file stays what it is",
    "stands for the force, which is not", "each kernel is told of when", "who does not want to wait",
    "all of it is differenced", "errors are those of the differences; the march's own",
    "the same questions are asked in the same words", "what comes of a cell depends",
    "what it is multiplied by then counts as well", "a chunk that takes down worker",
    "a file has it if it was asked for before saving", "something else happens beside the field's value",
    "whatever has been computed can be seen", "goes on with a file that is there", "a test with a number",
    "draws whatever has a name here", "where nobody knows how much there is", "goes away, as with ``head``",
    "what the function raises ends the work", "survives on a rail that would never begin it",
    "nothing here is worn off by sliding", "who loads a wagon's bodies unevenly", "with stiff pads it is neither",
    "some are remembered and not read again", "what the scenario cannot take is said",
    # of the theory
    "joints that nobody is told of",  "there is no third answer",
    "is named by the paper and not told", "with more wheels rise by", "what is chaotic, bouncing",
    "hands each contact its free motion", "hears of the wagon at the ends", "is not looked into",
    "from modes that know it", "that know nothing of each other", "that do not know of each other",
    "what they feel of each other does not change", "the wheel is a stone", "which what keeps the speed has to bring",
    "what has it twice", "more hollow than the circle is round", "one that is all end",
    "is set against what was exchanged",
    # of detectors and diagnosis
    "of another make in", "and would fold back", "what a seat bears", "a seat bears a share", "over the truth",
    "while a wheel goes the length of a sensor", "over the way it is a train", "is told as two",
    "what is odd is said", "whatever does not fit is said", "four times the gauges halve it",
    "which need nothing but", "as foretell each other best", "on which no threshold was chosen", "is accused",
    "what it sees is at least there", "the exception is yours", "say that your line stands",
    "after which it came back",
)  # fmt: skip
"""Each was rewritten because a reader had to read it twice."""


@cache
def prose():
    """Return what the public reads, by where it stands."""
    pages = [*PAGES, ROOT / "CHANGELOG.md", ROOT / "examples" / "README.rst"]
    rooms = [getattr(wt, one) for one in wt.__all__ if inspect.ismodule(getattr(wt, one))]
    public = {one: getattr(home, one) for home in (wt, *rooms) for one in getattr(home, "__all__", ())}
    return {name(page): page.read_text(encoding="utf-8") for page in pages} | {
        f"wt: {one}": inspect.getdoc(noun) or "" for one, noun in public.items() if callable(noun)
    }


@pytest.mark.parametrize("phrase", STUMBLED_OVER)
def test_a_phrase_that_readers_stumbled_over_does_not_come_back(phrase):
    words = re.compile(r"\s+".join(re.escape(word) for word in phrase.split()), re.IGNORECASE)
    found = [where for where, text in prose().items() if words.search(text)]
    assert not found, "say it in plain words"


def test_words_are_explained_once():
    page = (ROOT / "docs" / "words.rst").read_text(encoding="utf-8")
    terms = re.findall(r"^   (\S.*)\n      \S", page, re.MULTILINE)
    assert len(terms) > 50
    assert len(set(terms)) == len(terms)
