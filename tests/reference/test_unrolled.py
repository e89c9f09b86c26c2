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

from wheeltapper.march import (
    flight,
    layout,
    program,
    series,
    step,
    steplength,
    unrolled_lane_tangents,
    unrolled_lanes,
)
from wheeltapper.march import lane_rows as at
from wheeltapper.march.kernel import FASTMATH
from wheeltapper.march.steps import written
from wheeltapper.march.steps.equations import Free

from ..marks import slow_but

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    ("tool", "function", "file"),
    [
        ("unroll", "tangent_source", "unrolled_tangent.py"),
        ("unroll_lanes", "source", "unrolled_lanes.py"),
        ("unroll_tangents", "source", "unrolled_lane_tangents.py"),
        ("unroll_dop853", "source", "unrolled_dop853.py"),
    ],
)
def test_the_generated_file_is_what_the_generator_writes(tool, function, file, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    generated = getattr(importlib.import_module(tool), function)()
    written = (ROOT / "src" / "wheeltapper" / "march" / file).read_text(encoding="utf-8")
    assert ast.dump(ast.parse(generated)) == ast.dump(ast.parse(written))  # the formatter may break lines


KINDS = ("flat", "wave", "bent", "deck_flat", "deck_wave", "general")
HARMONIC = 1.3


def lanes_at(rng, kind):
    """Eight steps in progress, of which every other one with a deck is on it; and the decks' masses."""
    L, K, G = np.zeros(at.LANE_ENTRIES), rng.uniform(0, 5e-3, 8), rng.uniform(0, 5e-2, 8)
    time, level = rng.uniform(0, 300, 8), rng.uniform(-1, 1, 8)
    drawn = {
        at.LANE_U0: rng.uniform(0.5, 1.5, 8), at.LANE_W0: rng.uniform(-1, 1, 8), at.LANE_TIME: time, at.LANE_K: K,
        at.LANE_G: G, at.LANE_LEVEL: level, at.LANE_LOAD: 1 + K * level, at.LANE_PATH: level,
        at.LANE_FACTOR: np.ones(8), at.LANE_UNTIL: np.full(8, np.inf), at.LANE_GOAL: np.full(8, log2(1e-7)),
        at.LANE_CUBIC: np.ones(8),
    }  # fmt: skip
    if "flat" not in kind:
        a, b, stiff, drag = rng.uniform(-1, 1, 8), rng.uniform(-1, 1, 8), K - HARMONIC**2, G * HARMONIC
        drawn |= {
            at.LANE_AMP_SIN: a, at.LANE_AMP_COS: b, at.LANE_OMEGA: np.full(8, HARMONIC),
            at.LANE_RATE: np.full(8, HARMONIC / (2 * pi)), at.LANE_OFFSET: rng.uniform(-9, 9, 8),
            at.LANE_GAIN_SIN: stiff * a - drag * b, at.LANE_GAIN_COS: stiff * b + drag * a,
        }  # fmt: skip
    if kind in ("bent", "general"):
        pace = rng.uniform(0.1, 0.5, 8)
        drawn |= {at.LANE_PACE: pace, at.LANE_ORIGIN: pace * time - rng.uniform(-1, 1, 8)}
        drawn |= {at.LANE_QUADRATIC: rng.uniform(0, 0.3, 8)}
        for k in range(program.TERMS):
            drawn[at.LANE_PATH + 8 * k] = rng.uniform(-1, 1, 8) * 0.5**k
            drawn[at.LANE_FACTOR + 8 * k] = (k == 0) + 0.1 * rng.uniform(-1, 1, 8) * 0.5**k
    mass = np.zeros(8)
    if "deck" in kind or kind == "general":
        mass, on = rng.uniform(2, 20, 8), np.array([1.0, 0.0] * 4)
        drawn |= {
            at.LANE_ON: on, at.LANE_PRESTRESS: on * rng.uniform(0, 5, 8) / mass, at.LANE_SHARE: on / mass,
            at.LANE_DECK_STIFF: rng.uniform(0, 1, 8) / mass, at.LANE_DECK_DRAG: rng.uniform(0, 1, 8) / mass,
            at.LANE_DECK_Y: rng.uniform(-1, 1, 8), at.LANE_DECK_V: rng.uniform(-1, 1, 8),
        }  # fmt: skip
    if kind == "general":
        drawn[at.LANE_ETA] = rng.uniform(0, 0.3, 8)
    for row, values in drawn.items():
        L[row : row + 8] = values
    return L, mass


def scratch_of(L, i, mass):
    """The same state for the recurrences in loops."""
    numbers, S = np.zeros(program.NUMBERS), np.zeros(layout.SCRATCH)
    numbers[[program.STIFFNESS, program.DAMPING, program.CUBIC]] = (
        L[at.LANE_K + i],
        L[at.LANE_G + i],
        L[at.LANE_CUBIC + i],
    )
    numbers[[program.QUADRATIC, program.HYSTERESIS]] = L[at.LANE_QUADRATIC + i], L[at.LANE_ETA + i]
    numbers[program.DECK_MASS], numbers[program.TOLERANCE] = mass, 1e-7
    for entry, row in (
        (program.DECK_STIFFNESS, at.LANE_DECK_STIFF), (program.DECK_DAMPING, at.LANE_DECK_DRAG),
        (program.PRESTRESS, at.LANE_PRESTRESS),
    ):  # fmt: skip
        numbers[entry] = L[row + i] * mass
    xi = np.polynomial.Polynomial([L[at.LANE_PACE + i] * L[i] - L[at.LANE_ORIGIN + i], L[at.LANE_PACE + i]])
    for degree, here, row in (
        (layout.HERE_DEGREE, layout.HERE_POLY, at.LANE_PATH),
        (layout.HERE_FACTOR_DEGREE, layout.HERE_FACTOR, at.LANE_FACTOR),
    ):
        terms = np.polynomial.Polynomial(L[row + i : row + i + 8 * program.TERMS : 8])(xi).coef
        S[degree], S[here : here + len(terms)] = len(terms) - 1, terms
    omega = L[at.LANE_OMEGA + i]
    S[[layout.HERE_AMP_SIN, layout.HERE_AMP_COS]] = L[at.LANE_AMP_SIN + i], L[at.LANE_AMP_COS + i]
    S[[layout.HERE_PHASE0, layout.HERE_OMEGA]] = omega * L[i] - 2 * pi * L[at.LANE_OFFSET + i], omega
    S[layout.STATE + program.ON_DECK] = L[at.LANE_ON + i]
    return numbers, S


def assert_series(L, row, i, S, expected, count):
    values = S[expected : expected + count]
    np.testing.assert_allclose(
        L[row + i : row + i + 8 * count : 8], values, rtol=1e-11, atol=2e-13 * np.abs(values).max()
    )


@pytest.mark.parametrize("order", [12, 20])
@pytest.mark.parametrize("kind", KINDS)
def test_contact_steps_in_lanes_agree_with_the_loops(kind, order):
    L, mass = lanes_at(np.random.default_rng(3), kind)
    start = L.copy()
    getattr(unrolled_lanes, f"lanes_{kind}_{order}").py_func(L)
    for i in range(8):
        numbers, S = scratch_of(start, i, mass[i])
        numbers[program.ORDER] = order
        deck, on = start[[at.LANE_DECK_Y + i, at.LANE_DECK_V + i]], start[at.LANE_ON + i] != 0.0
        series.contact_series(numbers, order, start[at.LANE_U0 + i], start[at.LANE_W0 + i], *deck, on, S)
        for ours, theirs in ((at.LANE_U, layout.U), (at.LANE_W, layout.W)):
            assert_series(L, ours, i, S, theirs, order + 1)
        if kind in ("bent", "general"):
            assert_series(L, at.LANE_N, i, S, layout.N, order)
        if mass[i]:
            assert_series(L, at.LANE_Y, i, S, layout.Y, order + 1)
            assert_series(L, at.LANE_V, i, S, layout.Z, order + 1)
        slow, quick = ((layout.U, layout.Y), (layout.W, layout.Z)) if mass[i] else ((layout.U,), (layout.W,))
        last = (max(abs(S[row + n]) for row in rows) for n in (order - 1, order) for rows in (slow, quick))
        rate = step.fastest_rate(numbers, numbers[program.STIFFNESS] + numbers[program.DAMPING], S)
        reach = steplength.stable_step(order, steplength.steplength(order, *last, log2(1e-7)), rate)
        assert L[at.LANE_LENGTH + i] == pytest.approx(reach, rel=1e-12)


def end_of_steps(L, kind):
    """Time, u, w and the deck's motion at the ends of eight steps of known length."""
    L = L.copy()
    getattr(unrolled_lane_tangents, f"base_{kind}_12").py_func(L)
    ends = np.array([L[row : row + 8] for row in ENDS[: 5 if kind in DECKS else 3]])
    ends[0] += L[at.LANE_TIME : at.LANE_TIME + 8]
    return L, ends


DECKS = ("deck_flat", "deck_wave", "general")
ENDS = (at.LANE_T_END, at.LANE_U_END, at.LANE_W_END, at.LANE_DECK_Y_END, at.LANE_DECK_V_END)
OF_ENDS = (at.LANE_OF_T_END, at.LANE_OF_U_END, at.LANE_OF_W_END, at.LANE_OF_DECK_Y_END, at.LANE_OF_DECK_V_END)
TURNED = ("TIME", "U", "W", "K", "G", "LOAD", "GAIN_SIN", "GAIN_COS", "OMEGA")
TURNED_ON_DECKS = ("DECK_Y", "DECK_V", "PRESTRESS", "DECK_STIFF", "DECK_DRAG", "SHARE")


@pytest.mark.parametrize("kind", KINDS)
def test_ends_of_steps_in_lanes_are_those_of_the_loops(kind):
    L, mass = lanes_at(np.random.default_rng(3), kind)
    L = np.concatenate([L, np.zeros(at.TANGENT_ENTRIES - len(L))])
    L[at.LANE_LENGTH : at.LANE_LENGTH + 8] = lengths = np.linspace(0.05, 0.3, 8)
    _, ends = end_of_steps(L, kind)
    for i in range(8):
        numbers, S = scratch_of(L, i, mass[i])
        deck, on = L[[at.LANE_DECK_Y + i, at.LANE_DECK_V + i]], L[at.LANE_ON + i] != 0.0
        series.contact_series(numbers, 12, L[at.LANE_U0 + i], L[at.LANE_W0 + i], *deck, on, S)
        rows = (layout.T, layout.U, layout.W, layout.Y, layout.Z)[: len(ends)]
        expected = [np.polynomial.polynomial.polyval(lengths[i], S[row : row + 13]) for row in rows]
        expected[0] += L[at.LANE_TIME + i]
        np.testing.assert_allclose(ends[:, i], expected, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("kind", KINDS)
def test_tangents_of_steps_in_lanes_are_differences_of_their_ends(kind):
    rng = np.random.default_rng(6)
    L, _ = lanes_at(rng, kind)
    L = np.concatenate([L, np.zeros(at.TANGENT_ENTRIES - len(L))])
    L[at.LANE_LENGTH : at.LANE_LENGTH + 8] = np.linspace(0.05, 0.3, 8)
    turned = {name: f"LANE_{name}{'0' if name in 'UW' else ''}" for name in TURNED}
    turned |= {name: f"LANE_{name}" for name in TURNED_ON_DECKS if kind in DECKS}
    turned |= {"ETA": "LANE_ETA"} if kind == "general" else {}
    change, time = np.zeros(len(L)), L[at.LANE_TIME : at.LANE_TIME + 8]
    for name, row in turned.items():
        drawn = rng.uniform(-1, 1, 8)
        change[getattr(at, row) : getattr(at, row) + 8] = drawn
        L[getattr(at, f"LANE_OF_{name}") : getattr(at, f"LANE_OF_{name}") + 8] = drawn
    phase = rng.uniform(-1, 1, 8)
    change[at.LANE_OFFSET : at.LANE_OFFSET + 8] = -phase / (2 * pi)
    L[at.LANE_OF_PHASE : at.LANE_OF_PHASE + 8] = phase
    L[at.LANE_RATE : at.LANE_RATE + 8] = L[at.LANE_OMEGA : at.LANE_OMEGA + 8] / (2 * pi)
    if kind in ("bent", "general"):
        pace, origin = rng.uniform(-1, 1, 8), rng.uniform(-1, 1, 8)
        change[at.LANE_PACE : at.LANE_PACE + 8] = L[at.LANE_OF_PACE : at.LANE_OF_PACE + 8] = pace
        change[at.LANE_ORIGIN : at.LANE_ORIGIN + 8] = pace * time - origin
        L[at.LANE_OF_AHEAD : at.LANE_OF_AHEAD + 8] = origin
        for block in ("PATH", "FACTOR"):
            drawn = rng.uniform(-1, 1, 8 * program.TERMS)
            first, turn = getattr(at, f"LANE_{block}"), getattr(at, f"LANE_OF_{block}")
            change[first : first + len(drawn)] = L[turn : turn + len(drawn)] = drawn
        unrolled_lane_tangents.change_12.py_func(L)
    based, ends = end_of_steps(L, kind)
    getattr(unrolled_lane_tangents, f"along_{kind}_12").py_func(based)
    found = np.array([based[row : row + 8] for row in OF_ENDS[: len(ends)]])
    step = 1e-3
    around = [end_of_steps(L + k * step * change, kind)[1] for k in (-2, -1, 1, 2)]
    expected = (around[0] - 8 * around[1] + 8 * around[2] - around[3]) / (12 * step)
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("kind", ["flat", "wave", "general"])
def test_flights_in_lanes_agree_with_the_loops(kind):
    L, mass = lanes_at(np.random.default_rng(4), kind)
    (unrolled_lanes.flight_general_22 if kind == "general" else unrolled_lanes.flight_22)(L)
    for i in range(8):
        numbers, S = scratch_of(L, i, mass[i])
        deck, on = L[[at.LANE_DECK_Y + i, at.LANE_DECK_V + i]], L[at.LANE_ON + i] != 0.0
        state = S[layout.STATE :]
        state[[program.A, program.B]] = L[[at.LANE_U0 + i, at.LANE_W0 + i]]
        state[[program.DECK_Y, program.DECK_V]], state[program.ON_DECK] = deck, on
        pieces = np.zeros((1, program.PIECE_COLUMNS))
        written.function(Free(deck=mass[i] > 0), 22)(numbers, pieces, 0.0, 0, pieces, S)
        assert L[at.LANE_LENGTH + i] == pytest.approx(flight.flight_reach(numbers, S), rel=1e-12)
        powers = L[at.LANE_LENGTH + i] ** np.arange(23)
        rows = [(at.LANE_Y, layout.U, 1), (at.LANE_V, layout.W, 1), (at.LANE_POLYNOMIAL, layout.CLEAR, powers)]
        if kind == "general":
            rows += [(at.LANE_U, layout.Y, 1), (at.LANE_W, layout.Z, 1)]
        for ours, theirs, by in rows:
            np.testing.assert_allclose(
                L[ours + i : ours + i + 184 : 8], S[theirs : theirs + 23] * by, rtol=1e-11, atol=1e-12
            )


def test_sine_and_cosine_in_lanes_are_exact_to_rounding():
    turns = np.concatenate([np.linspace(-1, 1, 4001), np.random.default_rng(5).uniform(-500, 500, 4000)])[:8000]
    L = np.zeros(at.LANE_ENTRIES)
    for eight in turns.reshape(-1, 8):
        L[at.LANE_OFFSET : at.LANE_OFFSET + 8] = -eight
        L[at.LANE_OMEGA : at.LANE_OMEGA + 8] = 1.0
        for row, expected in ((at.LANE_AMP_SIN, np.sin), (at.LANE_AMP_COS, np.cos)):
            L[at.LANE_AMP_SIN : at.LANE_AMP_SIN + 8] = row == at.LANE_AMP_SIN
            L[at.LANE_AMP_COS : at.LANE_AMP_COS + 8] = row == at.LANE_AMP_COS
            L[at.LANE_TIME : at.LANE_TIME + 8] = L[at.LANE_T_END : at.LANE_T_END + 8] = 0.0
            unrolled_lanes.leave(L)
            np.testing.assert_allclose(
                L[at.LANE_Y : at.LANE_Y + 8], expected(2 * np.pi * (eight - np.rint(eight))), atol=5e-16
            )


@pytest.mark.skipif(
    not llvm.get_host_cpu_features().get("fma", False) or bool(numba.config.DISABLE_JIT), reason="needs a CPU with FMA"
)
@pytest.mark.parametrize(
    ("name", "fewest"),
    [
        ("lanes_flat_12", 170), ("sharpen_22", 40),
        *slow_but([("lanes_wave_12", 300), ("lanes_bent_12", 600), ("along_flat_12", 170), ("along_bent_12", 600)]),
        *slow_but([("change_12", 100)]),
    ],
)  # fmt: skip
def test_the_machine_code_of_the_lanes_is_packed(name, fewest):
    module = unrolled_lanes if hasattr(unrolled_lanes, name) else unrolled_lane_tangents
    anew = numba.njit(error_model="numpy", fastmath=FASTMATH)(getattr(module, name).py_func)
    anew.compile("void(float64[::1])")
    (code,) = anew.inspect_asm().values()
    assert len(re.findall(r"\bvfn?m(?:add|sub)\d+pd\b", code)) >= fewest
    assert not re.findall(r"\bv(?:fn?m(?:add|sub)\d+|mul|add|sub|div)sd\b", code)
