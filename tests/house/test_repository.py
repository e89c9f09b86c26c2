"""The repository: nothing from somebody's machine or network in it, and no file that should have been two."""

import ast
import re
import subprocess
import tomllib
from functools import cache
from pathlib import Path

import pytest

from wheeltapper import __version__

ROOT = Path(__file__).parents[2]
SOURCES = sorted((ROOT / "src").rglob("*.py"))
GENERATED = {"unrolled_dop853.py"}

# Written in pieces, so that this file does not contain what it looks for.
REGISTRIES = [
    "pypi" + ".org",
    "python" + "hosted.org",
    "conda" + ".anaconda.org",
    "registry.npm" + "js",
]
WORKPLACES = [f"/{place}/" for place in ("work", "tmp", "home", "root")]
FORBIDDEN = re.compile("|".join(re.escape(text) for text in REGISTRIES + WORKPLACES))
# Texts that a clone does not contain. What they say is cited from docs/theory, by chapter and section.
SUBJECTS = "physics|numerics|coach|diagnosis"
ELSEWHERE = re.compile(
    "|".join([
        rf"\b({SUBJECTS})[ ]reference\b",
        r"\bproject's[ ](\w+[ ])?references?\b",
        rf"(?<![-\w])({SUBJECTS}|design|march|orbits|track|users|house|style)[.]md\b",
        r"\bled[g]er",
        r"\bshared[/]",
        r"[.][.]/[s]hared",
        r'/ "[s]hared"',
    ])
)  # fmt: skip


def git(*arguments: str) -> str:
    try:
        done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        pytest.skip("git is not installed")
    if done.returncode == 128:
        pytest.skip("not a git checkout")
    return done.stdout


@cache
def files() -> list[Path]:
    """List the tracked files and those that would be added."""
    names = git("ls-files", "--cached", "--others", "--exclude-standard").split("\n")
    return [ROOT / name for name in names if name and (ROOT / name).is_file()]


def test_no_file_names_a_package_registry_or_a_place_of_some_machine() -> None:
    found = []
    for path in files():
        text = path.read_text(encoding="utf-8", errors="replace")
        for number, line in enumerate(text.split("\n"), start=1):
            if FORBIDDEN.search(line):
                found.append(f"{path.relative_to(ROOT)}:{number}: {line.strip()[:100]}")
    assert not found, "\n".join(found)


@pytest.mark.slow
def test_nothing_refers_to_texts_outside_the_repository() -> None:
    found = []
    for path in files():
        text = " ".join(path.read_text(encoding="utf-8", errors="replace").split())  # a citation may go over two lines
        found += [f"{path.relative_to(ROOT)}: {match[0]}" for match in ELSEWHERE.finditer(text)]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    "text", ["numerics" + " reference, section 1", "the project's coach" + " reference", "led" + "ger"]
)
def test_such_a_reference_would_be_found(text: str) -> None:
    assert ELSEWHERE.search(text)


def test_the_lock_file_is_ignored() -> None:
    assert git("check-ignore", "uv.lock").strip() == "uv.lock"
    assert git("ls-files", "uv.lock") == ""


def test_the_project_points_to_no_package_index() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert not {"index", "index-url", "extra-index-url", "find-links"} & set(project["tool"]["uv"])


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_each_source_file_says_what_it_is_for(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    if text.strip() or path.name != "__init__.py":
        assert ast.get_docstring(ast.parse(text))


MOST_ARGUMENTS = 12


def is_kernel(function: ast.AST) -> bool:
    return any(
        isinstance(decorator, ast.Name) and decorator.id.endswith("kernel")
        for decorator in getattr(function, "decorator_list", [])
    )


def arguments(function: ast.AST) -> int:
    given = getattr(function, "args", None)
    if given is None or not isinstance(given, ast.arguments):
        return 0
    named = len(given.posonlyargs) + len(given.args) + len(given.kwonlyargs)
    return named + (given.vararg is not None) + (given.kwarg is not None)


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_function_but_a_kernel_has_more_than_twelve_arguments(path: Path) -> None:
    if path.name not in GENERATED:
        functions = [
            node
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda) and not is_kernel(node)
        ]
        assert [node.lineno for node in functions if arguments(node) > MOST_ARGUMENTS] == []


def test_the_citation_names_the_version() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8").split("\n")
    assert f"version: {__version__}" in citation


def test_the_typing_marker_is_shipped() -> None:
    assert (ROOT / "src" / "wheeltapper" / "py.typed").is_file()
