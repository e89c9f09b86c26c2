"""The paper's claims, each measured.

The paper: Vibro-impacts induced by irregular rolling surfaces of railway rails and wheels (2007); how it is read stands
in docs/theory/motion.rst, section 1.7.
"""

import csv
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom, chi2

from tests.cases import orbit_cases, reference
from tests.peer import Wheel
from wheeltapper.faces.cli import main
from wheeltapper.faces.paper.chaos import DRAWN, RUNS
from wheeltapper.faces.paper.claims import PINNED, STATED, Case, Claim, Found, Kind, Verdict, analysis, judged, said
from wheeltapper.faces.paper.coach_setting import ZONES
from wheeltapper.faces.paper.coach_waves import BOGIE_SPREAD, runs_at_resonance
from wheeltapper.faces.paper.figures import DRAW, shown
from wheeltapper.faces.paper.missed import WITHOUT_EVENTS
from wheeltapper.faces.paper.orbits import DOP853
from wheeltapper.faces.paper.page import SECTIONS, entry
from wheeltapper.faces.paper.run import CLAIMS, measure_claims
from wheeltapper.faces.paper.single import DIGITS, RESTARTED

LONGEST = "C15"
LONG = {"C16", "C28b", "C29b", "C33b", "C36", "C36b", "C38", "C42", "C44", "C48", "C49", "C50", "C51"}
pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")  # as the command does
PAGE = Path(__file__).parents[2] / "docs/paper.rst"
BOUNCING = {"C32", "C42", "C44", "C45"}
"""Claims with values of single chaotic runs, which another machine rounds to others within their bounds."""
PLAIN = (Verdict.CONFIRMED, Verdict.NOT_STATED)
"""Verdicts that need no further word."""


def marks_of(number):
    return [pytest.mark.slow] * (number in {LONGEST, *LONG}) + [pytest.mark.whole] * (number == LONGEST)


@cache
def measured(number):
    return list(CLAIMS[number].measure())


@pytest.mark.slow
@pytest.mark.parametrize("number", [pytest.param(number, marks=marks_of(number)) for number in sorted(CLAIMS)])
def test_a_claims_measures_hold_name_their_sources_say_its_limits_and_stand_on_the_page(number):
    found = measured(number)
    claim = Found(CLAIMS[number], found)
    counted = [one for one in found if DRAWN in one.quantity or BOGIE_SPREAD in one.quantity]
    assert not [str(one) for one in found if one.mark == "FAIL"]
    assert not [str(one) for one in found if one.mark == "AGREES" and one not in counted]  # those are near one half
    assert bool(CLAIMS[number].but) == (claim.verdict not in PLAIN)
    assert claim.section in SECTIONS
    assert not claim.words or any(one.case.own for one in claim.words)
    assert counted or number in BOUNCING or entry(claim) in PAGE.read_text(encoding="utf-8")
    for one in found:
        assert bool(one.source.where) == (one.source.kind is not Kind.PINNED)
        assert one.source.kind is not Kind.PROGRAM or one.source in (DIGITS, RESTARTED, WITHOUT_EVENTS, DOP853)
        tight = one.high - one.low <= 2.002e-3 * max(abs(one.value), 1.0)
        assert tight or one.why or one.source.kind is Kind.PAPER, one.quantity


def test_verdicts_follow_from_the_measures_of_the_papers_words():
    def word(value, case=STATED, **options):
        return said("higher", "section 1", "a", value, value < 1.0, case, **options)

    yes, no, own = word(2.0), word(0.5), PINNED.relative("b", 1.0, 1.0)
    up, down, beside = Case("up"), Case("down"), Case("beside", own=False)
    assert judged([yes, own]) is Verdict.CONFIRMED
    assert judged([no, own]) is judged([yes, no]) is Verdict.CONTRADICTED  # an easy measure does not rescue it
    assert judged([yes, word(0.5, beside)]) is Verdict.LIMITED
    assert judged([no, word(2.0, beside)]) is Verdict.CONTRADICTED
    assert judged([yes, word(2.0, up), word(0.5, down)]) is Verdict.LIMITED  # one reading meets all
    assert judged([word(2.0, up), word(0.5, up), word(0.5, down), word(2.0, down)]) is Verdict.CONTRADICTED
    assert judged([no, word(2.0, up), word(2.0, down)]) is Verdict.CONTRADICTED
    assert judged([word(2.0, fitted=True), word(0.5, beside)]) is Verdict.FITTED
    assert judged([word(0.5, fitted=True)]) is Verdict.CONTRADICTED
    assert judged([own]) is Verdict.NOT_STATED
    assert judged([]) is Verdict.UNMEASURED
    assert judged([yes, PINNED.relative("b", 1.1, 1.0)]) is Verdict.FAILED
    agrees = said("higher", "section 1", "a", 2.0, refutes=True)
    assert agrees.mark == "AGREES"
    assert judged([agrees]) is Verdict.CONFIRMED  # which is no failure of the program


@pytest.mark.whole
@pytest.mark.slow
def test_repeats_of_the_chaotic_counts_lie_within_their_binomial_spread():
    repeats = [runs_at_resonance(ZONES, seed) for seed in range(10)]
    for counted in (
        lambda one: one.is_high,
        lambda one: one.largest >= 3.0,
        lambda one: one.leaves <= 0.5,
    ):
        counts = np.array([sum(counted(one) for one in runs) for runs in repeats])
        share = counts.mean() / RUNS
        low, high = binom.ppf((1e-3, 1.0 - 1e-3), RUNS, share) if 0.0 < share < 1.0 else (RUNS * share, RUNS * share)
        assert np.all((low <= counts) & (counts <= high)), counts
        spread = ((counts - RUNS * share) ** 2).sum()
        assert spread <= chi2.ppf(1.0 - 1e-3, 9) * RUNS * share * (1.0 - share), counts
    assert np.mean([one.is_high for runs in repeats for one in runs]) > 0.75
    assert all((one.leaves <= 0.5) == one.rises_first for runs in repeats for one in runs)


@pytest.mark.parametrize(
    ("measure", "expected"),
    [
        (PINNED.count("n", 3, 3), "exactly 3"),
        (PINNED.relative("n", 3, 3.0), "3 ± 0.003"),
        (PINNED.within("n", 3, 2.0, 4.0), "2 to 4"),
        (said("several times", "section 5", "n", 4.0), "at least 3"),
    ],
)
def test_bounds_are_said_in_words(measure, expected):
    assert measure.expected == expected


def test_claims_are_said_one_by_one():
    lines = []
    assert measure_claims(["C40", "C20"], say=lines.append) == 0
    assert lines[0].endswith("(fig4): the sign of the step decides the peak – not stated in the paper")
    assert "lies near 180 Hz – fitted: the contact's constant was chosen" in lines[3]
    assert [line.split()[0] for line in lines] == ["C20", "PASS", "PASS", "C40", "PASS", "REFUTES", *["PASS"] * 3, "2"]
    assert lines[-1] == (
        "2 claims: 0 confirmed, 0 confirmed within limits, 1 fitted, 0 contradicted, 1 not stated in the paper; of the "
        "7 measures 4 are from the paper, 1 from analysis, 1 from an independent program, 1 only pin this program's "
        "own numbers; 1 of those from the paper refute"
    )


def test_a_claim_that_is_contradicted_says_by_what(capsys):
    assert main(["paper", "C11"]) == 0
    out = capsys.readouterr().out
    assert "– contradicted by: inertia and spring subtract" in out
    assert "REFUTES  dynamic stiffness over M·ω² + K: 0.3147" in out
    assert ", expected 0.95 to 1.05; the paper: section 3" in out


@pytest.mark.slow
def test_the_command_writes_table_and_figures(tmp_path, capsys):
    folder = tmp_path / "new" / "paper"
    assert main(["paper", "law", "C40", "--output", str(folder)]) == 0
    assert "2 claims: 1 confirmed, 0 confirmed within limits, 1 fitted" in capsys.readouterr().out
    with (folder / "claims.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["claim"] for row in rows} == {"C40", "C43"}
    assert {row["source"] for row in rows} == {"the paper", "analysis", "pinned"}
    assert {row["verdict"] for row in rows} == {"confirmed", "fitted"}
    assert {path.name for path in folder.iterdir()} == {"claims.csv", "fig7.png", "law.png"}


@pytest.mark.slow
def test_the_command_goes_on_with_what_is_measured(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(DRAW, "law", lambda figure: figure.suptitle("drawn"))
    assert main(["paper", "C40", "C43", "C60", "--output", str(tmp_path)]) == 0
    first = capsys.readouterr().out
    drawn = (tmp_path / "law.png").stat().st_mtime_ns

    def again(_):
        raise AssertionError("measured or drawn again")

    monkeypatch.setattr("wheeltapper.faces.paper.run._measure", lambda _, number: again(number))
    monkeypatch.setitem(DRAW, "law", again)
    assert main(["paper", "C43", "C60", "--output", str(tmp_path), "--page", str(tmp_path / "page.rst")]) == 0
    second = capsys.readouterr().out
    assert second.splitlines()[0] in first  # and the same values to the last digit:
    assert set(second.splitlines()) - set(first.splitlines()) == {
        line for line in second.splitlines() if line.startswith("2 claims") or "page.rst" in line
    }
    assert (tmp_path / "law.png").stat().st_mtime_ns == drawn
    assert entry(Found(CLAIMS["C43"], measured("C43"))) in (tmp_path / "page.rst").read_text(encoding="utf-8")
    monkeypatch.setattr("wheeltapper.faces.paper.run.program_digest", lambda: "another program")
    with pytest.raises(AssertionError, match="again"):
        main(["paper", "C43", "--output", str(tmp_path)])


def test_an_interrupted_command_says_what_is_kept(tmp_path, monkeypatch, capsys):
    def stopped(_, number):
        if number == "C43":
            raise KeyboardInterrupt
        return [PINNED.relative("a", 1.0, 1.0)]

    monkeypatch.setattr("wheeltapper.faces.paper.run._measure", stopped)
    assert main(["paper", "C40", "C43", "--output", str(tmp_path)]) == 3
    assert f"interrupted; what is measured is in {tmp_path}; the same command goes on" in capsys.readouterr().err
    with (tmp_path / "claims.csv").open(encoding="utf-8", newline="") as file:
        assert {row["claim"] for row in csv.DictReader(file)} == {"C40"}


def test_a_picture_says_which_condition_shows_its_claims(tmp_path):
    lines = shown(Found(CLAIMS["C30b"], list(CLAIMS["C30"].measure())))
    assert lines[0].endswith("within half a period – confirmed within limits")
    assert lines[1].endswith("shown: the rail rises first")
    assert "not shown, the rail falls first, as printed: first loss over half a period, c = 0: 1.71" in lines[2]


def test_a_claim_that_fails_gives_exit_code_one(monkeypatch, capsys):
    wrong = Claim("C40", "fig7", "two are three", lambda: iter([analysis("counting").absolute("two", 2.0, 3.0, 0.5)]))
    monkeypatch.setitem(CLAIMS, "C40", wrong)
    assert main(["paper", "C40"]) == 1
    out = capsys.readouterr().out
    assert "two are three – failed" in out
    assert "FAIL  two: 2, expected 2.5 to 3.5; analysis: counting" in out
    assert out.rstrip().endswith("failed: C40")


@pytest.mark.parametrize("arguments", [["C99"], ["all", "--output", "/dev/null/figures"]])
def test_what_cannot_be_measured_or_written_is_refused_first(arguments, capsys):
    assert main(["paper", *arguments]) == 2
    assert "allowed" in capsys.readouterr().err


def test_every_figure_of_a_claim_is_drawn():
    assert {claim.figure for claim in CLAIMS.values() if claim.figure} == set(DRAW)


def test_every_claim_is_measured():
    numbers = range(1, 66)
    repeated = {"C17b", "C18b", "C19b", "C20b", "C22b"}  # core models' claims, on the coach
    repeated |= {"C28b", "C29b", "C30b", "C31b", "C33b"}
    repeated |= {"C36b", "C48b", "C49b"}  # the frame of Fig. 8; claims with marks
    assert set(CLAIMS) == {f"C{n:02d}" for n in numbers} | repeated


# -- what the independent programs give -------------------------------------------------------------------------------


def bounds(number, source):
    """Return the bounds of a claim's measures from a source, by quantity."""
    return {one.quantity: (one.low, one.high) for one in measured(number) if one.source == source}


def hold(found, allowed):
    """Check that a source gives the values that are named after it: all of these, and each in its bounds."""
    assert set(found) == set(allowed)
    for quantity, (low, high) in allowed.items():
        assert low <= found[quantity] <= high, quantity


def restarted(damping, end, stiffness=2.44e6, load=91_307.0, deck=None):
    """Return the times of the impacts behind the bump of Fig. 2."""
    wheel = Wheel(
        1500.0, load, stiffness, damping, 1.405e11, 9.0, height=2e-4, start=0.009, deck=deck, entry=0.0
    )  # fmt: skip
    return [time for time, kind in wheel.solve(end)[0] if kind == "impact"]


@pytest.mark.slow
def test_restarted_integration_gives_the_impacts_of_bumps():
    heavy = restarted(1e5, 0.3)
    found = {f"interval {i + 1} [ms] at c = 1e5": 1e3 * value for i, value in enumerate(np.diff(heavy))}
    found |= {"impacts at c = 5e4": len(restarted(5e4, 0.3)), "impacts at c = 1e5": len(heavy)}
    hold(found | {"impacts at c = 2e5": len(restarted(2e5, 0.3))}, bounds("C01", RESTARTED))
    hold({"impacts in 0.3 s at c = 2e4": len(restarted(2e4, 0.3))}, bounds("C02", RESTARTED))


@pytest.mark.slow
def test_the_other_program_gives_the_orbits():
    cases = {one["id"].partition(" ")[0]: one for one in orbit_cases()}
    found = {
        "period 1 doubles [m/s]": cases["O8"]["value"], "jump up [m/s]": cases["O6"]["value"],
        "bouncing ends [m/s]": cases["O7"]["value"], "first loss, calm [m/s]": cases["O9"]["value"],
    }  # fmt: skip
    for name, case in (("calm", "O1"), ("bouncing", "O2")):
        found[f"N_max/N0 at 5 m/s, {name}"] = cases[case]["largest_force_over_static"]
    hold(found, bounds("C42", DOP853))


@pytest.mark.slow
def test_restarted_integration_gives_the_impacts_over_springs_and_decks():
    found = {}
    for name, stiffness in (("k = 0", 0.0), ("k = 2.44e7", 2.44e7)):
        times = restarted(5e4, 0.1, stiffness)
        found[f"interval [ms] at {name}"] = 1e3 * (times[1] - times[0])
    hold(found, bounds("C08", RESTARTED))
    found = {"impacts on stiff track": len(restarted(5e4, 0.25))}
    for mass in (3000.0, 1500.0, 750.0, 300.0):
        deck = (mass, mass * (20.0 * np.pi) ** 2, 0.0)
        found[f"impacts, M = {mass:g} kg"] = len(restarted(5e4, 0.25, deck=deck))
    hold(found, bounds("C09", RESTARTED))


def test_thirty_digits_give_the_same_peaks_and_intervals():
    cases = reference()["dynamic"]
    static = 105_820.015756807212

    def highest(name):
        return max(float(one["N"]) for one in cases[name]["force_peaks"]) / static

    def interval(name):
        return 1e3 * float(cases[name]["derived"]["Delta_t"][0])

    bump = interval("cosbump_c5e4")
    hold({"N_max/N0 at c = 5e4": highest("cosbump_c5e4")}, bounds("C01", DIGITS))
    hold({"interval [ms]": bump}, bounds("C03", DIGITS))
    hold({"force ratio": float(cases["cosbump_c5e4"]["derived"]["r_N"][0])}, bounds("C05", DIGITS))
    hold({"N_max/N0 up": highest("step_up_R046")}, bounds("C20", DIGITS))
    hold({"first impact interval, healthy [ms]": bump}, bounds("C41", DIGITS))
    found = {}
    for name in ("stiff", "deck"):
        found |= {
            f"N_max/N0, {name}": highest(f"flat_{name}"), f"interval [ms], {name}": interval(f"flat_{name}"),
        }  # fmt: skip
    hold(found, bounds("C23", DIGITS))
