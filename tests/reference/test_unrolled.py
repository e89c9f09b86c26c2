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
from wheeltapper.march import lane_rows as lane
from wheeltapper.march.kernel import FASTMATH
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
    pieces, numbers, *_ = lower(bump, method).program
    single = numbers.copy()
    single[program.HYSTERESIS] = 1e-300  # no effect but that the loops are taken
    many, one = march(program.Program(pieces, numbers)), march(program.Program(pieces, single))
    assert len(many.events) == len(one.events) > 100
    np.testing.assert_allclose(many.events, one.events, rtol=0, atol=1e-9)
    np.testing.assert_allclose(many.peaks, one.peaks, rtol=0, atol=1e-9)


def lanes_at(rng, omega):
    """Eight contact steps in progress."""
    L = np.zeros(lane.ENTRIES)
    drawn = {
        lane.U0: rng.uniform(0.5, 1.5, 8), lane.W0: rng.uniform(-1, 1, 8), lane.K: rng.uniform(0, 5e-3, 8),
        lane.G: rng.uniform(0, 5e-2, 8), lane.LEVEL: rng.uniform(-1, 1, 8), lane.TIME: rng.uniform(0, 300, 8),
    }  # fmt: skip
    if omega:
        drawn |= {
            lane.AMP_SIN: rng.uniform(-1, 1, 8),
            lane.AMP_COS: rng.uniform(-1, 1, 8),
            lane.OMEGA: np.full(8, omega),
        }
        drawn |= {lane.RATE: np.full(8, omega / (2 * pi)), lane.OFFSET: rng.uniform(-9, 9, 8)}
    for row, values in drawn.items():
        L[row : row + 8] = values
    L[lane.LOAD : lane.LOAD + 8] = 1 + drawn[lane.K] * drawn[lane.LEVEL]
    if omega:
        stiff, drag = drawn[lane.K] - omega**2, drawn[lane.G] * omega
        a, b = drawn[lane.AMP_SIN], drawn[lane.AMP_COS]
        L[lane.GAIN_SIN : lane.GAIN_SIN + 8] = stiff * a - drag * b
        L[lane.GAIN_COS : lane.GAIN_COS + 8] = stiff * b + drag * a
    L[lane.UNTIL : lane.UNTIL + 8] = np.inf
    L[lane.GOAL : lane.GOAL + 8] = log2(1e-7)
    return L


def scratch_of(L, i, omega):
    """The same state for the recurrences in loops."""
    numbers = np.zeros(program.NUMBERS)
    numbers[[program.STIFFNESS, program.DAMPING, program.CUBIC]] = L[lane.K + i], L[lane.G + i], 1.0
    S = np.zeros(layout.SCRATCH)
    here = S[layout.HERE :]
    here[layout.POLY], here[layout.FACTOR_DEGREE] = L[lane.LEVEL + i], -1
    if omega:
        phase = omega * L[lane.TIME + i] - 2 * pi * L[lane.OFFSET + i]
        here[[layout.AMP_SIN, layout.AMP_COS, layout.PHASE0, layout.OMEGA]] = (
            L[lane.AMP_SIN + i], L[lane.AMP_COS + i], phase, omega
        )  # fmt: skip
    return numbers, S


@pytest.mark.parametrize("omega", [0.0, 1.3])
def test_contact_steps_in_lanes_agree_with_the_loops(omega):
    L = lanes_at(np.random.default_rng(3), omega)
    start = L.copy()
    (unrolled_lanes.lanes_wave_12 if omega else unrolled_lanes.lanes_flat_12)(L)
    for i in range(8):
        numbers, S = scratch_of(start, i, omega)
        series.contact_series(numbers, 12, start[lane.U0 + i], start[lane.W0 + i], 0.0, 0.0, False, S)
        for ours, theirs in ((lane.U, layout.U), (lane.W, layout.W)):
            np.testing.assert_allclose(L[ours + i : ours + 104 : 8], S[theirs : theirs + 13], rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("omega", [0.0, 1.3])
def test_flights_in_lanes_agree_with_the_loops(omega):
    L = lanes_at(np.random.default_rng(4), omega)
    unrolled_lanes.flight_22(L)
    for i in range(8):
        numbers, S = scratch_of(L, i, omega)
        flight.flight_series(numbers, 22, L[lane.U0 + i], L[lane.W0 + i], 0.0, 0.0, False, S)
        assert L[lane.LENGTH + i] == pytest.approx(flight.flight_reach(numbers, S), rel=1e-12)
        powers = L[lane.LENGTH + i] ** np.arange(23)
        for ours, theirs, by in ((lane.Y, layout.U, 1), (lane.V, layout.W, 1), (lane.POLYNOMIAL, layout.CLEAR, powers)):
            np.testing.assert_allclose(
                L[ours + i : ours + 184 : 8], S[theirs : theirs + 23] * by, rtol=1e-11, atol=1e-12
            )


def test_sine_and_cosine_in_lanes_are_exact_to_rounding():
    turns = np.concatenate([np.linspace(-1, 1, 4001), np.random.default_rng(5).uniform(-500, 500, 4000)])[:8000]
    L = np.zeros(lane.ENTRIES)
    for eight in turns.reshape(-1, 8):
        L[lane.OFFSET : lane.OFFSET + 8] = -eight
        L[lane.OMEGA : lane.OMEGA + 8] = 1.0
        for row, expected in ((lane.AMP_SIN, np.sin), (lane.AMP_COS, np.cos)):
            L[[lane.AMP_SIN, lane.AMP_COS]] = 0.0
            L[lane.AMP_SIN : lane.AMP_SIN + 8] = row == lane.AMP_SIN
            L[lane.AMP_COS : lane.AMP_COS + 8] = row == lane.AMP_COS
            L[lane.TIME : lane.TIME + 8] = L[lane.T_ROOT : lane.T_ROOT + 8] = 0.0
            unrolled_lanes.leave(L)
            np.testing.assert_allclose(
                L[lane.U0 : lane.U0 + 8], expected(2 * np.pi * (eight - np.rint(eight))), atol=5e-16
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
