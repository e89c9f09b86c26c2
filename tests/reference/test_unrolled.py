"""The generated straight-line steps against the recurrences that they were generated from."""

import ast
import importlib.util
from math import cos, sin
from pathlib import Path

import numpy as np
import pytest

from wheeltapper.march import program as contract
from wheeltapper.march import series, unrolled

ROOT = Path(__file__).resolve().parents[2]


def test_the_generated_file_is_what_the_generator_writes():
    spec = importlib.util.spec_from_file_location("unroll", ROOT / "tools" / "unroll.py")
    generator = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generator)
    written = (ROOT / "src" / "wheeltapper" / "march" / "unrolled.py").read_text(encoding="utf-8")
    assert ast.dump(ast.parse(generator.source())) == ast.dump(ast.parse(written))  # the formatter may break lines


@pytest.mark.parametrize("order", [12, 20])
@pytest.mark.parametrize("omega", [0.0, 1.3])
def test_straight_line_steps_agree_with_the_loops(order, omega):
    numbers = np.zeros(contract.NUMBERS)
    numbers[[contract.STIFFNESS, contract.DAMPING, contract.CUBIC]] = 2e-3, 3e-2, 1.0
    K, G = numbers[contract.STIFFNESS], numbers[contract.DAMPING]
    loops, straight = np.zeros(series.SCRATCH), np.zeros(series.SCRATCH)
    here = loops[series.HERE :]
    here[series.POLY] = 0.4
    here[[series.AMP_SIN, series.AMP_COS, series.PHASE0, series.OMEGA]] = (
        (0.7, -0.2, 0.3, omega) if omega else (0, 0, 0, 0)
    )
    here[series.FACTOR_DEGREE] = -1
    series._general_contact(numbers, order, 1.1, 0.4, 0.0, 0.0, False, loops)
    a, b = here[series.AMP_SIN], here[series.AMP_COS]
    rows = (straight, series.T, series.U, series.W)
    if omega:
        stiff, drag = K - omega**2, G * omega
        wave = (stiff * a - drag * b, stiff * b + drag * a, sin(0.3), cos(0.3), omega)
        getattr(unrolled, f"wave_{order}")(K, G, 1 + K * 0.4, *wave, 1.1, 0.4, *rows)
    else:
        getattr(unrolled, f"flat_{order}")(K, G, 1 + K * 0.4, 1.1, 0.4, *rows)
    for row in (series.T, series.U, series.W):
        expected = loops[row : row + order + 1]
        np.testing.assert_allclose(straight[row : row + order + 1], expected, rtol=1e-12, atol=1e-15)
