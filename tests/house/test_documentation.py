"""The documentation: every Python block runs and states a number that holds; every scenario in TOML loads."""

import re
import runpy
import shutil
import textwrap
from pathlib import Path
from typing import NamedTuple

import pytest

import wheeltapper as wt
from wheeltapper.ask.spec import described_study, read_study
from wheeltapper.describe.manual import room_table

from ..registering import undone

ROOT = Path(__file__).parents[2]
GENERATED = {"_build", "_templates", "api", "gallery"}
PAGES = [ROOT / "README.md", *sorted(p for p in (ROOT / "docs").rglob("*.rst") if not GENERATED & set(p.parts))]
FENCED = re.compile(r"^```(?P<language>\w+)\n(?P<body>.*?)^```$", re.MULTILINE | re.DOTALL)
DIRECTIVE = re.compile(
    r"^\.\. code-block:: (?P<language>\w+)\n(?:[ ]+:.*\n)*\n(?P<body>(?:(?:[ ]{3}.*)?\n)+)", re.MULTILINE
)
THEORY = ROOT / "docs" / "theory"
TITLE = re.compile(r"^(?P<title>[^\s=-].*)\n(?P<line>=+|-+)\n(?=\n)", re.MULTILINE)
CITATION = re.compile(r"docs/theory/(?P<chapter>\w+)\.rst,\s+sections?\s+(?P<sections>[\d.]+(?:\s+and\s+[\d.]+)*)")
NUMBER = re.compile(r"\d+(?:\.\d+)?")
MENTION = re.compile(r"(?<!,\s)\bsection\s+(\d+\.\d+)")  # after a comma: of a publication
LIST = re.compile(r"^\.\. kinds:: (\w+)$", re.MULTILINE)
RUN = "pip install uv && uv run wheeltapper run examples/wheel_flat.toml"
TEST = "pip install uv && uv run pytest"
DEAR = {"detector.rst", "diagnosis.rst", "orbits.rst", "wagon.rst", "wear.rst", "week.rst"}
"""Pages whose code takes seconds."""
DEAREST = "week.rst"
"""The page that fits the same wheels as `detector.rst`, for more than a minute."""


class Block(NamedTuple):
    """A piece of code in a page, and the line on which it starts."""

    language: str
    code: str
    line: int


def blocks(page: Path, language: str) -> list[Block]:
    text = page.read_text(encoding="utf-8") + "\n"
    pattern = FENCED if page.suffix == ".md" else DIRECTIVE
    found = [
        Block(match["language"], textwrap.dedent(match["body"]), text.count("\n", 0, match.start("body")))
        for match in pattern.finditer(text)
    ]
    return [block for block in found if block.language == language]


def with_blocks(language: str) -> list[Path]:
    return [page for page in PAGES if blocks(page, language)]


def marks_of(page: Path) -> list[pytest.MarkDecorator]:
    return [pytest.mark.slow] * (page.name in DEAR) + [pytest.mark.whole] * (page.name == DEAREST)


def name(page: Path) -> str:
    return str(page.relative_to(ROOT))


def test_lines_of_pages_are_no_longer_than_those_of_code() -> None:
    written = [page for page in PAGES if page.suffix == ".rst" and page.name not in ("paper.rst", "abilities.rst")]
    long = {
        f"{page.relative_to(ROOT)}:{number}"
        for page in written
        for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1)
        if len(line) > 120 and not line.startswith(".. math::")
    }
    assert long == set()


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=marks_of(page)) for page in with_blocks("python")],
    ids=name,
)
def test_the_code_of_the_page_runs_and_its_numbers_hold(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    found = blocks(page, "python")
    assert any("assert" in block.code for block in found), "the page states no number"
    namespace: dict[str, object] = {"__name__": "page"}
    with undone():
        for block in found:
            # Blank lines before the block let a traceback point to the page's own line.
            exec(compile("\n" * block.line + block.code, str(page), "exec"), namespace)


@pytest.mark.parametrize("page", with_blocks("toml"), ids=name)
def test_the_scenarios_and_studies_of_the_page_load(page: Path, tmp_path: Path) -> None:
    shutil.copytree(ROOT / "examples", tmp_path, dirs_exist_ok=True)
    whole = [block for block in blocks(page, "toml") if block.code.startswith(("speed", "#"))]
    assert whole, "the page shows no whole scenario"
    for block in whole:
        path = tmp_path / f"line_{block.line}.toml"
        path.write_text(block.code, encoding="utf-8")
        if "[over]" in block.code:
            assert described_study(read_study(path)).cell_count > 1
        else:
            assert isinstance(wt.load(path), wt.Scenario)


def test_the_pages_are_found() -> None:
    assert len(with_blocks("python")) >= 8


def test_the_readme_gives_both_commands_and_ci_runs_the_second() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8").split("\n")
    assert RUN in readme
    assert TEST in readme
    assert TEST in (ROOT / ".ci" / "run").read_text(encoding="utf-8")


def chapters() -> dict[str, list[str]]:
    """Return the numbers of the theory's sections, in the order of the pages, by chapter."""
    index = (THEORY / "index.rst").read_text(encoding="utf-8")
    found = {}
    for chapter in index.partition(":maxdepth: 1\n\n")[2].split():
        text = (THEORY / f"{chapter}.rst").read_text(encoding="utf-8")
        found[chapter] = [match["title"].split()[0] for match in TITLE.finditer(text)]
    return found


def test_chapters_and_sections_of_the_theory_are_numbered() -> None:
    for number, (chapter, found) in enumerate(chapters().items(), start=1):
        assert found == [str(number), *(f"{number}.{section}" for section in range(1, len(found)))], chapter
    assert {f"{chapter}.rst" for chapter in chapters()} == {p.name for p in THEORY.glob("*.rst")} - {"index.rst"}


def test_every_section_of_the_theory_that_is_cited_exists() -> None:
    sections = chapters()
    cited, wrong = 0, []
    for folder in ("src", "tests", "tools", "benchmarks", "docs", "examples"):
        for path in sorted((ROOT / folder).rglob("*.[prm][ysd]*")):
            if GENERATED & set(path.parts):
                continue
            for match in CITATION.finditer(path.read_text(encoding="utf-8", errors="replace")):
                for number in NUMBER.findall(match["sections"]):
                    cited += 1
                    if number not in sections.get(match["chapter"], []):
                        wrong.append(f"{path.relative_to(ROOT)}: {match['chapter']}, section {number}")
    assert not wrong, "\n".join(wrong)
    assert cited > 20


def test_sections_that_the_theory_mentions_exist() -> None:
    known = {number for found in chapters().values() for number in found}
    for path in THEORY.glob("*.rst"):
        mentioned = {match[1] for match in MENTION.finditer(path.read_text(encoding="utf-8"))}
        assert mentioned <= known, path.name


def test_every_public_name_has_its_place_in_the_reference() -> None:
    reference = (ROOT / "docs" / "api.rst").read_text(encoding="utf-8").split()
    assert [name for name in wt.__all__ if name != "__version__" and name not in reference] == []


def test_the_guide_lists_what_each_room_offers_to_be_made() -> None:
    rooms = {match for page in PAGES for match in LIST.findall(page.read_text(encoding="utf-8"))}
    assert rooms == {"contact", "creep", "features", "irregularities", "profiles", "sensors", "tracks", "vehicles"}
    for room in rooms:
        rows = room_table(getattr(wt, room).__name__)
        assert rows.count("   * - ``") >= 2
        assert rows.count("   * - ``") == rows.count("     - ")
    assert "``Step(height, position, …)``\n     - A sudden change of the rail's height: " in room_table(
        wt.irregularities.__name__
    )
    assert "``impulse(impact=1)``\n     - the impulse of the contact force" in room_table(wt.features.__name__)


def test_every_decision_is_listed() -> None:
    listed = (ROOT / "docs" / "development.rst").read_text(encoding="utf-8")
    for path in sorted((ROOT / "docs" / "decisions").glob("*.md")):
        title = path.read_text(encoding="utf-8").partition("\n")[0]
        number, _, sentence = title.removeprefix("# ").partition(". ")
        assert int(number) == int(path.name[:4])
        assert f"{number}. {sentence}" in listed.replace("``", ""), path.name


def test_the_readmes_picture_is_small_and_its_script_draws_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MPLBACKEND", "Agg")
    kept = ROOT / "docs" / "_static" / "wheel_flat.png"
    assert 20_000 < kept.stat().st_size < 150_000
    runpy.run_path(str(ROOT / "docs" / "readme_picture.py"))["draw"](tmp_path / "drawn.png")
    assert 20_000 < (tmp_path / "drawn.png").stat().st_size < 150_000


ON_TWO_PAGES = {
    ("README.md", "docs/index.rst"): ("eight or nine", "six or seven"),  # digits: docs/theory/accuracy.rst
    ("README.md", "docs/installation.rst"): ("20 s", "45 s on rails", "80 s for a coach on rails", "in three seconds"),
    ("README.md", "docs/installation.rst", "pyproject.toml"): ("3.11",),
}
"""Numbers that stand on several pages."""


@pytest.mark.parametrize("pages", ON_TWO_PAGES)
def test_numbers_are_the_same_on_all_pages(pages: tuple[str, ...]) -> None:
    for page in pages:
        text = " ".join((ROOT / page).read_text(encoding="utf-8").split())
        assert [words for words in ON_TWO_PAGES[pages] if words not in text] == [], page
