"""The generated straight-line steps against the recurrences that they were generated from."""

import ast
import importlib
import re
from math import log2, pi
from pathlib import Path

import llvmlite.binding as llvm
import numba
import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.lower.build import lower
from wheeltapper.march import flight, layout, program, series, unrolled, unrolled_lanes
from wheeltapper.march.kernel import FASTMATH
from wheeltapper.march.lane_rows import (
    LANE_AMP_COS,
    LANE_AMP_SIN,
    LANE_ENTRIES,
    LANE_G,
    LANE_GAIN_COS,
    LANE_GAIN_SIN,
    LANE_GOAL,
    LANE_K,
    LANE_LENGTH,
    LANE_LEVEL,
    LANE_LOAD,
    LANE_OFFSET,
    LANE_OMEGA,
    LANE_POLYNOMIAL,
    LANE_RATE,
    LANE_T_ROOT,
    LANE_TIME,
    LANE_U,
    LANE_U0,
    LANE_UNTIL,
    LANE_V,
    LANE_W,
    LANE_W0,
    LANE_Y,
)
from wheeltapper.march.single import march

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    ("tool", "function", "file"),
    [
        ("unroll", "source", "unrolled.py"),
        ("unroll", "tangent_source", "unrolled_tangent.py"),
        ("unroll_lanes", "source", "unrolled_lanes.py"),
        ("unroll_dop853", "source", "unrolled_dop853.py"),
    ],
)
def test_the_generated_file_is_what_the_generator_writes(tool, function, file, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    generated = getattr(importlib.import_module(tool), function)()
    written = (ROOT / "src" / "wheeltapper" / "march" / file).read_text(encoding="utf-8")
    assert ast.dump(ast.parse(generated)) == ast.dump(ast.parse(written))  # the formatter may break lines


@pytest.mark.parametrize("order", [12, 20])
@pytest.mark.parametrize("omega", [0.0, 1.3])
def test_straight_line_steps_agree_with_the_loops(order, omega):
    numbers = np.zeros(program.NUMBERS)
    numbers[[program.STIFFNESS, program.DAMPING, program.CUBIC]] = 2e-3, 3e-2, 1.0
    K, G = numbers[program.STIFFNESS], numbers[program.DAMPING]
    loops = np.zeros(layout.SCRATCH)
    here = loops
    here[layout.HERE_POLY] = 0.4
    if omega:
        here[[layout.HERE_AMP_SIN, layout.HERE_AMP_COS, layout.HERE_PHASE0, layout.HERE_OMEGA]] = 0.7, -0.2, 0.3, omega
    here[layout.HERE_FACTOR_DEGREE] = -1
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
    pieces, numbers, *_ = lower(bump, method).program
    single = numbers.copy()
    single[program.HYSTERESIS] = 1e-300  # no effect but that the loops are taken
    many, one = march(program.Program(pieces, numbers)), march(program.Program(pieces, single))
    assert len(many.events) == len(one.events) > 100
    np.testing.assert_allclose(many.events, one.events, rtol=0, atol=1e-9)
    np.testing.assert_allclose(many.peaks, one.peaks, rtol=0, atol=1e-9)


def lanes_at(rng, omega):
    """Eight contact steps in progress."""
    L = np.zeros(LANE_ENTRIES)
    drawn = {
        LANE_U0: rng.uniform(0.5, 1.5, 8), LANE_W0: rng.uniform(-1, 1, 8), LANE_K: rng.uniform(0, 5e-3, 8),
        LANE_G: rng.uniform(0, 5e-2, 8), LANE_LEVEL: rng.uniform(-1, 1, 8), LANE_TIME: rng.uniform(0, 300, 8),
    }  # fmt: skip
    if omega:
        drawn |= {
            LANE_AMP_SIN: rng.uniform(-1, 1, 8),
            LANE_AMP_COS: rng.uniform(-1, 1, 8),
            LANE_OMEGA: np.full(8, omega),
        }
        drawn |= {LANE_RATE: np.full(8, omega / (2 * pi)), LANE_OFFSET: rng.uniform(-9, 9, 8)}
    for row, values in drawn.items():
        L[row : row + 8] = values
    L[LANE_LOAD : LANE_LOAD + 8] = 1 + drawn[LANE_K] * drawn[LANE_LEVEL]
    if omega:
        stiff, drag = drawn[LANE_K] - omega**2, drawn[LANE_G] * omega
        a, b = drawn[LANE_AMP_SIN], drawn[LANE_AMP_COS]
        L[LANE_GAIN_SIN : LANE_GAIN_SIN + 8] = stiff * a - drag * b
        L[LANE_GAIN_COS : LANE_GAIN_COS + 8] = stiff * b + drag * a
    L[LANE_UNTIL : LANE_UNTIL + 8] = np.inf
    L[LANE_GOAL : LANE_GOAL + 8] = log2(1e-7)
    return L


def scratch_of(L, i, omega):
    """The same state for the recurrences in loops."""
    numbers = np.zeros(program.NUMBERS)
    numbers[[program.STIFFNESS, program.DAMPING, program.CUBIC]] = L[LANE_K + i], L[LANE_G + i], 1.0
    S = np.zeros(layout.SCRATCH)
    here = S
    here[layout.HERE_POLY], here[layout.HERE_FACTOR_DEGREE] = L[LANE_LEVEL + i], -1
    if omega:
        phase = omega * L[LANE_TIME + i] - 2 * pi * L[LANE_OFFSET + i]
        here[[layout.HERE_AMP_SIN, layout.HERE_AMP_COS, layout.HERE_PHASE0, layout.HERE_OMEGA]] = (
            L[LANE_AMP_SIN + i], L[LANE_AMP_COS + i], phase, omega
        )  # fmt: skip
    return numbers, S


@pytest.mark.parametrize("omega", [0.0, 1.3])
def test_contact_steps_in_lanes_agree_with_the_loops(omega):
    L = lanes_at(np.random.default_rng(3), omega)
    start = L.copy()
    (unrolled_lanes.lanes_wave_12 if omega else unrolled_lanes.lanes_flat_12)(L)
    for i in range(8):
        numbers, S = scratch_of(start, i, omega)
        series.contact_series(numbers, 12, start[LANE_U0 + i], start[LANE_W0 + i], 0.0, 0.0, False, S)
        for ours, theirs in ((LANE_U, layout.U), (LANE_W, layout.W)):
            np.testing.assert_allclose(L[ours + i : ours + 104 : 8], S[theirs : theirs + 13], rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("omega", [0.0, 1.3])
def test_flights_in_lanes_agree_with_the_loops(omega):
    L = lanes_at(np.random.default_rng(4), omega)
    unrolled_lanes.flight_22(L)
    for i in range(8):
        numbers, S = scratch_of(L, i, omega)
        flight.flight_series(numbers, 22, L[LANE_U0 + i], L[LANE_W0 + i], 0.0, 0.0, False, S)
        assert L[LANE_LENGTH + i] == pytest.approx(flight.flight_reach(numbers, S), rel=1e-12)
        powers = L[LANE_LENGTH + i] ** np.arange(23)
        for ours, theirs, by in ((LANE_Y, layout.U, 1), (LANE_V, layout.W, 1), (LANE_POLYNOMIAL, layout.CLEAR, powers)):
            np.testing.assert_allclose(
                L[ours + i : ours + 184 : 8], S[theirs : theirs + 23] * by, rtol=1e-11, atol=1e-12
            )


def test_sine_and_cosine_in_lanes_are_exact_to_rounding():
    turns = np.concatenate([np.linspace(-1, 1, 4001), np.random.default_rng(5).uniform(-500, 500, 4000)])[:8000]
    L = np.zeros(LANE_ENTRIES)
    for eight in turns.reshape(-1, 8):
        L[LANE_OFFSET : LANE_OFFSET + 8] = -eight
        L[LANE_OMEGA : LANE_OMEGA + 8] = 1.0
        for row, expected in ((LANE_AMP_SIN, np.sin), (LANE_AMP_COS, np.cos)):
            L[[LANE_AMP_SIN, LANE_AMP_COS]] = 0.0
            L[LANE_AMP_SIN : LANE_AMP_SIN + 8] = row == LANE_AMP_SIN
            L[LANE_AMP_COS : LANE_AMP_COS + 8] = row == LANE_AMP_COS
            L[LANE_TIME : LANE_TIME + 8] = L[LANE_T_ROOT : LANE_T_ROOT + 8] = 0.0
            unrolled_lanes.leave(L)
            np.testing.assert_allclose(
                L[LANE_U0 : LANE_U0 + 8], expected(2 * np.pi * (eight - np.rint(eight))), atol=5e-16
            )


@pytest.mark.skipif(
    not llvm.get_host_cpu_features().get("fma", False) or bool(numba.config.DISABLE_JIT), reason="needs a CPU with FMA"
)
@pytest.mark.parametrize(("name", "fewest"), [("lanes_flat_12", 170), ("lanes_wave_12", 300), ("sharpen_22", 40)])
def test_the_machine_code_of_the_lanes_is_packed(name, fewest):
    anew = numba.njit(error_model="numpy", fastmath=FASTMATH)(getattr(unrolled_lanes, name).py_func)
    anew.compile("void(float64[::1])")
    (code,) = anew.inspect_asm().values()
    assert len(re.findall(r"\bvfn?m(?:add|sub)\d+pd\b", code)) >= fewest
    assert not re.findall(r"\bv(?:fn?m(?:add|sub)\d+|mul|add|sub|div)sd\b", code)
