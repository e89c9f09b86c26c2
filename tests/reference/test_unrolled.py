"""The generated files against what their generators write."""

import ast
import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    ("tool", "function", "file"),
    [
        ("unroll_dop853", "source", "unrolled_dop853.py"),
    ],
)
def test_the_generated_file_is_what_the_generator_writes(tool, function, file, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    generated = getattr(importlib.import_module(tool), function)()
    written = (ROOT / "src" / "wheeltapper" / "march" / "wagon" / file).read_text(encoding="utf-8")
    assert ast.dump(ast.parse(generated)) == ast.dump(ast.parse(written))  # the formatter may break lines
