"""Kernels name what they index, and a name means one place."""

import ast
from collections import defaultdict
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import wheeltapper.march

FOLDER = Path(wheeltapper.march.__path__[0])
FILES = sorted({*FOLDER.rglob("*.py")} - {*(FOLDER / "compiling").glob("*.py")})
SOURCES = [path for path in FILES if not path.name.startswith("unrolled")]


def kernels(source):
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef):
            names = {ast.unparse(one).partition("(")[0] for one in node.decorator_list}
            if any(name.endswith("kernel") for name in names):
                yield node


def bare(kernel):
    """Return the places that a kernel names by a number: lines, and what stands there."""
    found = []
    for node in ast.walk(kernel):
        if isinstance(node, ast.Subscript) and not ast.unparse(node.value).endswith(".shape"):
            parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
            if any(isinstance(part, ast.Constant) and isinstance(part.value, int) for part in parts):
                found.append((node.lineno, ast.unparse(node)))
    return found


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.relative_to(FOLDER).as_posix())
def test_kernels_index_by_names(path):
    assert [place for kernel in kernels(path.read_text()) for place in bare(kernel)] == []


MOST_ARGUMENTS = 16


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.relative_to(FOLDER).as_posix())
def test_kernels_take_records_rather_than_many_arguments(path):
    long = [one.name for one in kernels(path.read_text()) if len(one.args.args) > MOST_ARGUMENTS]
    assert long == []


def test_bare_indices_are_found():
    (kernel,) = kernels("@kernel\ndef f(S, rows):\n    S[2] = rows[1, TIME] + rows.shape[0] + S[COUNT + 1]\n")
    assert [what for _, what in bare(kernel)] == ["S[2]", "rows[1, TIME]"]
    (kernel,) = kernels("@kernel\ndef f(S, rows):\n    S[layout.STATE + contract.TIME] = rows[contract.END, 0]\n")
    assert [what for _, what in bare(kernel)] == ["rows[contract.END, 0]"]


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.relative_to(FOLDER).as_posix())
def test_names_of_the_march_are_imported_in_one_line_or_qualified(path):
    imports = [node for node in ast.parse(path.read_text()).body if isinstance(node, ast.ImportFrom)]
    long = [node.module for node in imports if node.end_lineno > node.lineno]
    assert [name for name in long if name.startswith("wheeltapper.march")] == []


@pytest.mark.slow
def test_a_name_of_the_march_has_one_value():
    values = defaultdict(set)
    for path in FILES:
        parts = path.relative_to(FOLDER).with_suffix("").parts
        module = import_module(".".join(["wheeltapper.march", *(part for part in parts if part != "__init__")]))
        for node in ast.parse(path.read_text()).body:
            for target in node.targets if isinstance(node, ast.Assign) else []:
                for name in target.elts if isinstance(target, ast.Tuple) else [target]:
                    if isinstance(name, ast.Name) and name.id.isupper():
                        value = getattr(module, name.id)
                        if np.ndim(value) == 0 and isinstance(value, int | float | np.number):
                            values[name.id].add(float(value))
    assert len(values) > 500
    assert {name: held for name, held in values.items() if len(held) > 1} == {}
