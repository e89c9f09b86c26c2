"""The paper's claims, each measured.

The paper: Vibro-impacts induced by irregular rolling surfaces of railway rails and wheels (2007); how it is read stands
in docs/theory/motion.rst, section 1.7.
"""

import pytest

from wheeltapper.faces.cli import main
from wheeltapper.faces.paper.claims import Claim, absolute
from wheeltapper.faces.paper.figures import DRAW
from wheeltapper.faces.paper.run import CLAIMS, run

LONG = {"C15"}


@pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")  # as the command does
@pytest.mark.parametrize(
    "number", [pytest.param(number, marks=pytest.mark.slow if number in LONG else ()) for number in sorted(CLAIMS)]
)
def test_a_claim_holds(number):
    failed = [m for m in CLAIMS[number].measure() if not m.holds]
    assert not failed


def test_claims_are_said_one_by_one():
    said = []
    assert run(["C20"], say=said.append) == 0
    assert [line.split()[0] for line in said] == ["C20", "PASS", "PASS", "1"]


def test_the_command_writes_table_and_figures(tmp_path, capsys):
    folder = tmp_path / "new" / "paper"
    assert main(["paper", "law", "C40", "--output", str(folder)]) == 0
    assert "2 of 2 claims hold" in capsys.readouterr().out
    rows = (folder / "claims.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0] == "claim,figure,quantity,value,expected,verdict"
    assert {row.split(",")[0] for row in rows[1:]} == {"C40", "C43"}
    assert {path.name for path in folder.iterdir()} == {"claims.csv", "fig7.png", "law.png"}


def test_a_claim_that_fails_gives_exit_code_one(monkeypatch, capsys):
    wrong = Claim("C40", "fig7", "two are three", lambda: iter([absolute("two", 2.0, 3.0, 0.5)]))
    monkeypatch.setitem(CLAIMS, "C40", wrong)
    assert main(["paper", "C40"]) == 1
    assert "FAIL  two: 2, expected 3 ± 0.5" in capsys.readouterr().out


@pytest.mark.parametrize("arguments", [["C99"], ["all", "--output", "/dev/null/figures"]])
def test_what_cannot_be_measured_or_written_is_refused_first(arguments, capsys):
    assert main(["paper", *arguments]) == 2
    assert "allowed" in capsys.readouterr().err


def test_every_figure_of_a_claim_is_drawn():
    assert {claim.figure for claim in CLAIMS.values()} == set(DRAW)


def test_every_claim_is_measured_but_that_on_orbits():
    numbers = [*range(1, 42), *range(43, 50)]
    repeated = {"C17b", "C18b", "C19b", "C20b", "C22b", "C28b", "C29b", "C33b"}  # core models' claims, on the coach
    repeated |= {"C48b", "C49b"}  # and with marks
    assert set(CLAIMS) == {f"C{n:02d}" for n in numbers} | repeated
