"""The generated straight-line steps against the recurrences that they were generated from."""

import ast
import importlib.util
from math import log2
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.lower.build import lower
from wheeltapper.march import layout, program, series, unrolled
from wheeltapper.march.single import march

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
    numbers = np.zeros(program.NUMBERS)
    numbers[[program.STIFFNESS, program.DAMPING, program.CUBIC]] = 2e-3, 3e-2, 1.0
    K, G = numbers[program.STIFFNESS], numbers[program.DAMPING]
    loops = np.zeros(layout.SCRATCH)
    here = loops[layout.HERE :]
    here[layout.POLY] = 0.4
    if omega:
        here[[layout.AMP_SIN, layout.AMP_COS, layout.PHASE0, layout.OMEGA]] = 0.7, -0.2, 0.3, omega
    here[layout.FACTOR_DEGREE] = -1
    loops[[layout.STATE + program.A, layout.STATE + program.B]] = 1.1, 0.4
    straight = loops.copy()
    series.contact_series(numbers, order, 1.1, 0.4, 0.0, 0.0, False, loops)
    wave = (*series.harmonic_forcing(numbers, straight), omega) if omega else ()
    coast = getattr(unrolled, f"coast_{'wave' if omega else 'flat'}_{order}")
    coast(K, G, 1 + K * 0.4, *wave, log2(1e-7), 100.0, 0, np.zeros((1, program.STEP_COLUMNS)), straight)
    for row in (layout.T, layout.U, layout.W):
        expected = loops[row : row + order + 1]
        np.testing.assert_allclose(straight[row : row + order + 1], expected, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("method", ["default", "strict"])
def test_many_steps_in_a_row_find_what_single_steps_find(method):
    bump = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=95285, stiffness=2.4e6, damping=1e4),
        contact=wt.Hertz(constant=1.9e11),
        irregularity=wt.CosineBump(height=0.5e-3, length=50e-3, start=0.01),
        rolling="point",
        speed=5,
        duration=0.5,
    )
    pieces, numbers = lower(bump, method).program
    single = numbers.copy()
    single[program.HYSTERESIS] = 1e-300  # no effect but that the loops are taken
    many, one = march(program.Program(pieces, numbers)), march(program.Program(pieces, single))
    assert len(many.events) == len(one.events) > 100
    np.testing.assert_allclose(many.events, one.events, rtol=0, atol=1e-9)
    np.testing.assert_allclose(many.peaks, one.peaks, rtol=0, atol=1e-9)
