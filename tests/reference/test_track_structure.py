"""Rails on sleepers as a structure: waves and modes against another program, finite elements and closed forms."""

import json
from functools import cache
from math import pi
from pathlib import Path

import numpy as np
import pytest
from numpy.polynomial import polynomial
from scipy import sparse
from scipy.sparse.linalg import spsolve

import wheeltapper as wt
from wheeltapper.lower.track import bay, energy, reach, readouts, waves, works
from wheeltapper.lower.track import ring as rings
from wheeltapper.lower.track.section import Section, section_of

from ..marks import slow_but

DATA = Path(__file__).parents[1] / "data" / "track_cases.json"
CASE = json.loads(DATA.read_text(encoding="utf-8"))["linear_track_and_moving_load"]
SETS = {one["set"]: one for one in CASE["sets"]}
PLACES = {"over_sleeper": 0.0, "quarter": 0.25, "mid_span": 0.5}
"""In units of the spacing."""
UNDAMPED = wt.tracks.Slab(
    rail=wt.tracks.Rail(bending_stiffness=6.4e6, shear_stiffness=2.4e8, mass_per_length=60.0, damping=0.0),
    spacing=0.6, pad_stiffness=1e8, pad_damping=0.0,
)  # fmt: skip
OVERDAMPED = wt.tracks.Ballasted(
    rail="UIC60", spacing=0.55, pad_stiffness=5e7, pad_damping=4e5, sleeper_mass=130.0, ballast_stiffness=1.2e8,
    ballast_damping=3e5,
)  # fmt: skip
"""Some of its sleepers' rates are real."""


def named(name):
    return wt.tracks.Ballasted.named(name)


TRACKS = {name: named(name) for name in ("rolland_UIC60_example", "Zhai2004", "railFE_default")}
TRACKS |= {"slab": wt.tracks.Slab(**wt.tracks.Slab.example), "overdamped": OVERDAMPED}


@cache
def ring_of(track, bays, cutoff):
    return rings.ring_of(section_of(track), bays, cutoff)


def shapes(ring, x):
    """Return Φ, Ψ and r at a place."""
    _, element, zeta = readouts.place_of(ring, x)
    powers = zeta ** np.arange(ring.deflection.shape[1])
    residual = polynomial.polyval(zeta, ring.residual[element])
    return powers @ ring.deflection[element], powers @ ring.drive[element], residual


def modal_receptance(ring, omega, where, at):
    """Return the modes' harmonic response: each with its conjugate, and from bay to bay by the turns."""
    bays = np.floor(at / ring.spacing) - np.floor(where / ring.spacing)
    both = ring.turns**bays * shapes(ring, at)[0] * shapes(ring, where)[1]
    resonant = both / (1j * omega - ring.rates) + both.conj() / (1j * omega - ring.rates.conj())
    return np.sum(0.5 * ring.weights * resonant) + (shapes(ring, at)[2] if at == where else 0.0)


# -- the infinite track -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SETS)
def test_parameters_are_those_of_the_reference(name):
    given = SETS[name]["parameters"]
    expected = [given[key] for key in ("EI", "kGA", "mr", "rI", "beta", "a", "kp", "cp", "ms", "kb", "cb")]
    np.testing.assert_allclose(section_of(named(name)), expected, rtol=1e-14)


@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("place", PLACES)
def test_static_deflection(name, place):
    expected = SETS[name]["static_deflection_100kN_m"][place]
    found = wt.tracks.static_deflection(named(name), PLACES[place] * 0.6)
    assert 1e5 * float(found) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", SETS)
def test_winklers_foundation_is_2_to_15_percent_stiffer_than_the_discrete_track(name):
    section = section_of(named(name))
    per_metre = section.pad * section.ballast / (section.pad + section.ballast) / section.spacing
    winkler = (per_metre / (4.0 * section.bending)) ** 0.25 / (2.0 * per_metre)
    assert 1e5 * winkler == pytest.approx(SETS[name]["winkler_closed_form_100kN_m"], rel=1e-12)
    assert 0.02 < float(wt.tracks.static_deflection(named(name), 0.3)) / winkler - 1.0 < 0.15


@pytest.mark.parametrize("name", SETS)
def test_receptance(name):
    for row in SETS[name]["receptance_m_per_N"]:
        for place in ("over_sleeper", "mid_span"):
            found = wt.tracks.receptance(named(name), row["frequency_Hz"], PLACES[place] * 0.6)
            assert complex(found) == pytest.approx(complex(*row[place]), rel=1e-7)


@pytest.mark.parametrize("name", SETS)
def test_decay_rate_and_pinned_pinned_frequency(name):
    rows = SETS[name]["decay_rate_dB_per_m"]
    found = wt.tracks.decay_rate(named(name), [row["frequency_Hz"] for row in rows])
    np.testing.assert_allclose(found, [row["value"] for row in rows], rtol=1e-6)
    assert float(wt.tracks.pinned_pinned(named(name))) == pytest.approx(SETS[name]["pinned_pinned_Hz"], rel=1e-12)


def test_the_published_figures_of_the_track():
    track = named("rolland_UIC60_example")
    at = [50.0, 200.0, 500.0, 1000.0]
    found = 1e9 * abs(wt.tracks.receptance(track, at, [0.0, 0.3]))
    np.testing.assert_allclose(found[:, 0], [7.672, 2.453, 2.896, 0.5491], rtol=3e-4)
    np.testing.assert_allclose(found[:, 1], [8.083, 2.328, 3.460, 1.209], rtol=3e-4)
    decay = wt.tracks.decay_rate(track, [*at, 2000.0])
    np.testing.assert_allclose(decay, [11.97, 8.99, 2.52, 0.889, 1.625], rtol=1e-3)
    second = 1e9 * abs(wt.tracks.receptance(named("Zhai2004"), at, [0.0, 0.3]))
    np.testing.assert_allclose(second[:, 0], [9.643, 5.370, 1.790, 0.5252], rtol=3e-4)
    np.testing.assert_allclose(second[:, 1], [10.003, 5.310, 1.796, 1.305], rtol=5e-4)


@pytest.mark.parametrize("name", TRACKS)
def test_receptances_are_reciprocal_and_repeat_from_bay_to_bay(name):
    track, frequencies = TRACKS[name], [0.0, 3.0, 170.0, 960.0, 3300.0]
    a = track.spacing
    there, back, shifted, mirrored = (
        wt.tracks.receptance(track, frequencies, x, y)
        for x, y in ((0.13, 2.9), (2.9, 0.13), (0.13 - 4 * a, 2.9 - 4 * a), (-0.13, -2.9))
    )
    for other in (back, shifted, mirrored):
        np.testing.assert_allclose(there.values, other.values, rtol=1e-7, atol=1e-22)


def test_an_undamped_track_radiates():
    found = wt.tracks.receptance(UNDAMPED, [0.0, 500.0, 1500.0], 0.2)
    assert abs(found[0].imag) < 1e-12 * abs(found[0])
    assert np.all(found[1:].imag < -1e-12)
    assert float(wt.tracks.decay_rate(UNDAMPED, 500.0)) == pytest.approx(0.0, abs=1e-6)


def finite_rail(section, omega, where, at, bays, per_bay):
    """Return the response of a long rail of linear Timoshenko elements, its shear integrated at their middles."""
    h, count = section.spacing / per_bay, bays * per_bay + 1
    hard = 1.0 + 1j * omega * section.loss
    slope = np.array([-1.0, 0.0, 1.0, 0.0]) / h
    turn, middle = np.array([0.0, -1.0, 0.0, 1.0]) / h, np.array([0.0, 0.5, 0.0, 0.5])
    element = (
        hard * h * (section.shear * np.outer(slope - middle, slope - middle) + section.bending * np.outer(turn, turn))
    )
    mass = h / 6.0 * np.kron([[2.0, 1.0], [1.0, 2.0]], np.diag([section.mass, section.rotary]))
    element = element - omega**2 * mass
    first = 2 * np.arange(count - 1)[:, None, None]
    rows, columns = (first + np.arange(4)[:, None], first + np.arange(4)[None, :])
    shape = (count - 1, 4, 4)
    rows, columns = (np.broadcast_to(one, shape).ravel() for one in (rows, columns))
    seats = 2 * per_bay * np.arange(bays + 1)
    values = np.concatenate([np.broadcast_to(element, shape).ravel(), np.zeros(len(seats))])
    pad, ballast = (
        k + 1j * omega * c for k, c in ((section.pad, section.pad_damping), (section.ballast, section.ballast_damping))
    )
    below = ballast - section.sleeper * omega**2
    values[len(rows) :] = pad * below / (pad + below) if section.sleeper else pad
    matrix = sparse.csc_matrix(
        (values, (np.concatenate([rows, seats]), np.concatenate([columns, seats]))), shape=(2 * count, 2 * count)
    )
    node, reading = (2 * (bays // 2 * per_bay + round(x / h)) for x in (where, at))
    force = np.zeros(2 * count, dtype=complex)
    force[node] = 1.0
    return spsolve(matrix, force)[reading]


@pytest.mark.few(8)
@pytest.mark.parametrize("name", TRACKS)
@pytest.mark.parametrize("frequency", [1.0, 120.0, 480.0, 1030.0, 2400.0])
def test_receptance_by_finite_elements(name, frequency):
    track = TRACKS[name]
    section, x, y = section_of(track), 0.25 * track.spacing, 1.75 * track.spacing
    for at in (x, y):
        coarse, fine = (finite_rail(section, 2 * pi * frequency, x, at, 260, each) for each in (64, 128))
        found = complex(wt.tracks.receptance(track, frequency, x, at))
        assert abs(found - (4.0 * fine - coarse) / 3.0) < 1e-4 * abs(found)  # their error is quadratic in the length


# -- the ring ---------------------------------------------------------------------------------------------------------


def test_the_default_and_the_strict_ring():
    for name, modes in (("rolland_UIC60_example", (337, 732)), ("Zhai2004", (346, 730))):
        for accuracy, bays, cutoff, count in zip(("default", "strict"), (80, 100), (5e3, 8e3), modes, strict=True):
            found, chosen = reach.modes_of(named(name), accuracy)
            assert (chosen.bays, chosen.cutoff, chosen.notes) == (bays, cutoff, ())
            assert found.ring.rates.shape == (count,)
            assert np.all(found.ring.rates.imag >= 0.0)
            assert np.all(found.ring.rates.real < 0.0)


@pytest.mark.parametrize("name", TRACKS)
def test_modes_and_residual_are_the_infinite_track_at_rest(name):
    track = TRACKS[name]
    modes, _ = reach.modes_of(track)
    for x in np.linspace(0.0, track.spacing, 23)[:-1]:
        found = modal_receptance(modes.ring, 0.0, x, x)
        assert found.imag == pytest.approx(0.0, abs=1e-20)
        assert found.real == pytest.approx(float(wt.tracks.static_deflection(track, x)), rel=1e-9)


@pytest.mark.few(2)
@pytest.mark.parametrize("name", slow_but(TRACKS, "overdamped"))
def test_a_ring_answers_like_the_infinite_track(name):
    track = TRACKS[name]
    for bays, cutoff, most in ((80, 5e3, 0.035), (300, 5e3, 0.012), (300, 16e3, 4e-3)):
        ring = ring_of(track, bays, cutoff).ring
        for frequency in (20.0, 200.0, 500.0, 1000.0):
            for where, at in ((0.0, 0.0), (0.3 * track.spacing, 0.3 * track.spacing), (0.2, 1.5), (1.5, -0.2)):
                exact = complex(wt.tracks.receptance(track, frequency, where, at))
                scale = abs(complex(wt.tracks.receptance(track, frequency, where)))
                assert abs(modal_receptance(ring, 2 * pi * frequency, where, at) - exact) < most * scale


def test_receptance_of_the_default_ring_at_1_khz_is_1_6_percent_off_that_of_the_strict_one_half_a_percent():
    exact = complex(wt.tracks.receptance(named("rolland_UIC60_example"), 1000.0, 0.3))
    errors = [
        abs(
            modal_receptance(reach.modes_of(named("rolland_UIC60_example"), accuracy)[0].ring, 2e3 * pi, 0.3, 0.3)
            / exact
            - 1
        )
        for accuracy in ("default", "strict")
    ]
    np.testing.assert_allclose(errors, [0.015, 0.005], atol=1e-3)


@pytest.mark.parametrize("name", ["rolland_UIC60_example", "slab", "overdamped"])
@pytest.mark.parametrize("bays", [8, 9])
def test_all_modes_together_are_the_whole_ring(name, bays):
    """A dense matrix of all bays, without Bloch's theorem, has the same response where its elements have nodes."""
    section = section_of(TRACKS[name])
    modes = rings._modes(section, 2, bays, np.inf)
    nodes = 2 * bay.DEGREE + 1
    unknowns = bay.matrices(section, 2, np.zeros(1)).mass.shape[1]
    assert modes.weights.sum() == 2 * unknowns * bays
    for omega in (0.0, 900.0, 5e3, 3e4):
        exact = dense_ring(section, bays, omega)
        for force, place, away in ((0, 0, 0), (3, 8, 0), (8, 5, 2), (8, nodes - 1, 1)):
            both = modes.turns**away * modes.values[place] * modes.driven[force]
            found = np.sum(
                0.5
                * modes.weights
                * (both / (1j * omega - modes.rates) + both.conj() / (1j * omega - modes.rates.conj()))
            )
            expected = exact[away * (nodes - 1) + place, force]
            assert abs(found - expected) < 1e-8 * abs(expected)


def dense_ring(section, bays, omega):
    """Return the receptance between all nodes of a ring of bays."""
    mass, stiffness = bay.rail_matrices(section, 2)
    nodes = len(mass) // 2
    free = bays * (nodes - 1)
    system = np.zeros((2 * free, 2 * free), dtype=complex)
    one = (1.0 + 1j * omega * section.loss) * stiffness - omega**2 * mass
    for number in range(bays):
        own = (number * (nodes - 1) + np.arange(nodes)) % free
        system[np.ix_(np.append(own, free + own), np.append(own, free + own))] += one
        system[own[0], own[0]] += waves.seat_stiffness(section, omega)
    return np.linalg.inv(system)


@pytest.mark.slow
@pytest.mark.parametrize("name", TRACKS)
def test_the_residual_falls_with_the_cut_off_and_is_small_beside_the_compliance(name):
    track = TRACKS[name]
    largest = [np.abs(ring_of(track, 80, cutoff).ring.residual[:, 0]).max() for cutoff in (3e3, 5e3, 8e3, 16e3)]
    assert np.all(np.diff(largest) < 0.0)
    assert largest[1] < 0.03 * float(wt.tracks.static_deflection(track, 0.0))


def test_a_track_so_stiff_that_no_mode_is_kept_is_its_residual_alone():
    stiff = wt.tracks.Ballasted(
        rail=named("rolland_UIC60_example").rail.model_copy(
            update={"bending_stiffness": 6.378e12, "shear_stiffness": 2.43e14, "rotary_inertia": 0.24}
        ),
        spacing=0.6, pad_stiffness=180e12, pad_damping=18e3, sleeper_mass=150.0, ballast_stiffness=105e12,
        ballast_damping=48e3,
    )  # fmt: skip
    modes, chosen = reach.modes_of(stiff)
    assert (len(modes.ring.rates), chosen.bays) == (0, 80)
    soft = named("rolland_UIC60_example")
    for x in (0.0, 0.17, 0.3, 0.59):
        assert shapes(modes.ring, x)[2] == pytest.approx(1e-6 * float(wt.tracks.static_deflection(soft, x)), rel=1e-9)


# -- loads that move --------------------------------------------------------------------------------------------------


def moving_deflection(ring, speed, parts=60, nodes=24):
    """Return the deflection under a unit load that has always moved, at `parts` places of a bay, by the modes alone."""
    places, weights = np.polynomial.legendre.leggauss(nodes)
    step = ring.spacing / parts
    starts = step * np.arange(parts)
    grown, fed = np.exp(ring.rates * step / speed), []
    for start in starts:
        x = start + 0.5 * step * (places + 1.0)
        felt = np.exp(ring.rates * (start + step - x)[:, None] / speed) * np.stack([shapes(ring, one)[1] for one in x])
        fed.append(0.5 * step / speed * weights @ felt)
    whole = np.zeros(len(ring.rates), dtype=complex)
    for one in fed:
        whole = grown * whole + one
    amplitude = ring.turns * whole / (1.0 - ring.turns * grown**parts)
    found = []
    for start, one in zip(starts, fed, strict=True):
        shape, _, residual = shapes(ring, start)
        found.append(np.sum(ring.weights * np.real(shape * amplitude)) + residual)
        amplitude = grown * amplitude + one
    return np.array(found)


@pytest.mark.parametrize("accuracy", ["default", "strict"])
@pytest.mark.parametrize(
    "row", CASE["constant_100kN_moving_on_discrete_rolland"], ids=lambda row: f"{row['speed_m_s']:g}"
)
def test_a_load_that_moves_over_the_sleepers(row, accuracy):
    ring = reach.modes_of(named("rolland_UIC60_example"), accuracy)[0].ring
    found = 1e5 * moving_deflection(ring, row["speed_m_s"])
    expected = [row["mean_m"], row["min_m"], row["max_m"]]
    np.testing.assert_allclose([found.mean(), found.min(), found.max()], expected, rtol=1e-4)


def foundation(damping):
    """Return Euler's beam on seats so close that they are Winkler's foundation."""
    given, spacing = CASE["euler_on_winkler"], 0.12
    return Section(
        given["EI_N_m2"], 1e12, given["mass_kg_m"], 1e-6, 0.0, spacing, given["foundation_N_m2"] * spacing,
        damping * spacing,
    )  # fmt: skip


@pytest.mark.parametrize(
    "row", CASE["euler_on_winkler"]["cases"], ids=lambda row: f"{row['speed_m_s']:g}, {row['c_N_s_m2']:g}"
)
def test_a_load_that_moves_over_eulers_beam_on_winklers_foundation(row):
    ring = rings.ring_of(foundation(row["c_N_s_m2"]), 400, 5e3).ring
    found = moving_deflection(ring, row["speed_m_s"], parts=4)
    np.testing.assert_allclose(found, row["deflection_under_load_m_per_N"], rtol=5e-5)


def test_waves_go_along_with_a_load_at_the_critical_speed_of_eulers_beam():
    expected = CASE["euler_on_winkler"]["critical_speed_m_s"]
    assert reach.critical_speed(foundation(2e4)) == pytest.approx(expected, rel=1e-12)


# -- readouts ---------------------------------------------------------------------------------------------------------


def at_rest(modes, row, where, away):
    ring = modes.ring
    amplitudes = -ring.weights * shapes(ring, where)[1] / ring.rates
    return float(np.sum(np.real(ring.turns**away * row * amplitudes)))


@pytest.mark.parametrize("name", ["rolland_UIC60_example", "overdamped"])
def test_strain_and_shear_at_rest_are_those_of_the_deflection_line(name):
    track, at, h = TRACKS[name], 1.4, 1e-2
    section, foot = section_of(track), track.rail.foot_distance
    modes = ring_of(track, 80, 5e3)
    rows = readouts.rail_rows(section, foot, modes, at)
    for where in (0.2, 1.2, 1.5, 2.9):
        rest = readouts.static_rest(section, foot, modes, at, np.array([where]))[0]
        away = np.floor(at / track.spacing) - np.floor(where / track.spacing)
        still = 1.0 + section.loss * modes.ring.rates
        deflection, strain, shear = (
            at_rest(modes, row, where, away) + more
            for row, more in zip((rows.deflection, rows.strain, rows.shear / still), rest, strict=True)
        )
        line = [complex(wt.tracks.receptance(track, 0.0, where, at + n * h)).real for n in (-2, -1, 0, 1, 2)]
        assert deflection == pytest.approx(line[2], rel=1e-9)
        # Without a load on it a piece of the rail is a cubic, and Q' = 0: w'' is the bending alone.
        assert strain == pytest.approx(-foot * (line[1] - 2.0 * line[2] + line[3]) / h**2, rel=1e-5)
        third = (line[4] - 2.0 * line[3] + 2.0 * line[1] - line[0]) / (2.0 * h**3)
        assert shear == pytest.approx(-section.bending * third, rel=1e-4)


def test_pads_and_ballast_carry_the_load():
    track = named("Zhai2004")
    section, modes = section_of(track), ring_of(track, 80, 5e3)
    rows = readouts.seat_rows(section, modes, 0)
    rates = modes.ring.rates
    pad, ballast = (
        row * stiffness / (stiffness + damping * rates)
        for row, stiffness, damping in (
            (rows.pad, section.pad, section.pad_damping), (rows.ballast, section.ballast, section.ballast_damping)
        )
    )  # fmt: skip
    where, total = 0.22, np.zeros(2)
    for seat in range(-40, 40):
        rest = readouts.seat_rest(section, modes, seat, np.array([where]))[0]
        forces = [at_rest(modes, row, where, seat) + more for row, more in zip((pad, ballast), rest[1:], strict=True)]
        assert forces[0] == pytest.approx(forces[1], abs=1e-9)  # nothing else acts on a sleeper at rest
        total += forces
    np.testing.assert_allclose(total, 1.0, rtol=1e-6)


def test_the_shear_force_jumps_by_the_load():
    track = named("rolland_UIC60_example")
    section, modes, where = section_of(track), ring_of(track, 80, 5e3), 0.2
    sides = []
    for at in (where - 1e-9, where + 1e-9):
        row = readouts.rail_rows(section, 0.08, modes, at).shear / (1.0 + section.loss * modes.ring.rates)
        rest = readouts.static_rest(section, 0.08, modes, at, np.array([where]))[0, 2]
        sides.append(at_rest(modes, row, where, 0) + rest)
    assert sides[0] - sides[1] == pytest.approx(1.0, abs=1e-6)
    assert sides[0] > 0.0 > sides[1]


# -- energy -----------------------------------------------------------------------------------------------------------


def some_state(ring, seed=3):
    """Return amplitudes that a track can have: an answer to many forces, at many times."""
    numbers = np.random.default_rng(seed)
    state = np.zeros(len(ring.rates), dtype=complex)
    for x, force, ago in zip(
        numbers.uniform(0.0, ring.spacing, 5), numbers.normal(size=5), numbers.uniform(0, 0.01, 5), strict=True
    ):
        state += shapes(ring, x)[1] * force * np.exp(ring.rates * ago)
    return state[None]


def moving(ring, held, ago, places=(0.2,), speed=30.0, moves=1.0):
    """Return a ring on which wheels have gone on for `ago`; from `held` at time zero their forces change evenly."""
    wheels, rates = [], ring.rates * held
    for number, x in enumerate(places):
        force, change = 300.0 * (number + 1), 4e4 * moves
        at = readouts.places_of(ring, np.array([x + moves * speed * ago]))
        powers, slopes = works.by_zeta(ring, at, 9)
        now = force + change * ago
        wheels.append(works.Pressed(at, powers * now, moves * speed * slopes * now + powers * change))
        rates = rates + works.driven(ring, at, powers * now)
    return works.RingState(held, rates, wheels)


@pytest.mark.parametrize("name", [*TRACKS, "undamped"])
@pytest.mark.parametrize("bays", [9, 80])
@pytest.mark.parametrize("places", [(0.2,), (0.2, 0.7, -2.3)])
def test_what_forces_give_and_a_ring_does_not_store_is_lost_or_missed(name, bays, places):
    section = section_of(UNDAMPED if name == "undamped" else TRACKS[name])
    ring = rings.ring_of(section, bays, 5e3).ring
    whole = energy.energy_of(section, bays, 5e3)
    known, none, h = works.Products(whole), np.zeros((len(places), 1)), 1e-7
    held = some_state(ring)
    state = moving(ring, held, 0.0, places)
    around = (moving(ring, held + ago * state.rates, ago, places) for ago in (-h, h))
    stored = [works.stored_by(whole, known, one, none)[0] for one in around]
    lost, given, beside, missed = (one[0] for one in works.powers_of(whole, known, state))
    change = np.diff(stored)[0] / (2.0 * h)
    assert change == pytest.approx(given - lost - missed, rel=1e-6, abs=1e-6 * (abs(given) + abs(lost)))
    assert beside == 0.0
    assert lost >= -1e-12 * abs(given)
    assert stored[0] > 0.0
    if name == "undamped":
        assert lost < 1e-9 * abs(given)
        assert len(places) > 1 or abs(missed) < 1e-6 * abs(given)


@pytest.mark.parametrize("name", [*TRACKS, "undamped"])
@pytest.mark.parametrize("cutoff", [1500.0, 5e3])
def test_at_rest_a_ring_stores_half_of_force_times_deflection_and_loses_nothing(name, cutoff):
    section = section_of(UNDAMPED if name == "undamped" else TRACKS[name])
    ring = rings.ring_of(section, 80, cutoff).ring
    whole = energy.energy_of(section, 80, cutoff)
    for x in (0.0, 0.11, 0.3):
        _, drive, residual = shapes(ring, x)
        held = -300.0 * drive[None] / ring.rates
        state = moving(ring, held, 0.0, (x,), moves=0.0)
        np.testing.assert_allclose(state.rates, 0.0, atol=1e-12 * np.abs(drive).max())
        known = works.Products(whole)
        exact = waves.response(section, 0.0, np.array([x]), np.array([x]))[0, 0].real
        stored = works.stored_by(whole, known, state, np.array([[residual]]))[0]
        assert stored == pytest.approx(0.5 * 300.0**2 * exact, rel=1e-6)
        for one in works.powers_of(whole, known, state):
            assert abs(one[0]) < 1e-9 * stored


def test_the_energy_of_a_small_ring_is_that_of_all_its_bays():
    """Deflections and velocities at all nodes of all bays, in matrices of all of them."""
    section, bays = section_of(TRACKS["Zhai2004"]), 5
    whole = energy.energy_of(section, bays, 5e3)
    ring, known = whole.modes.ring, works.Products(whole)
    state = moving(ring, some_state(ring), 0.0, (0.2, 0.65))
    turns = np.exp(1j * whole.phases[:, None] * np.arange(bays))
    values = ring.weights * energy._node_values(whole.modes)
    away = ring.turns ** np.arange(bays)[:, None]
    deflection, speed = (np.real((away * one) @ values.T) for one in (state.held[0], state.rates[0]))
    for wheel in state.wheels:
        own = turns * np.exp(-1j * whole.phases * wheel.at.bay)[:, None]
        fields = whole.fields[:, :, wheel.at.element[0]]
        for out, powers in ((deflection, wheel.powers), (speed, wheel.changes)):
            out += np.einsum("k,kb,knp,p->bn", whole.shares / bays, own, fields, powers[0]).real
    mass, damping, stiffness = energy._bay_matrices(section, len(ring.edges) - 1)
    lost = np.einsum("bi,ij,bj->", speed, damping, speed)
    assert works.powers_of(whole, known, state).lost[0] == pytest.approx(lost, rel=1e-9)
    still = np.real((away * state.rates[0]) @ values.T)
    stored = 0.5 * np.einsum("bi,ij,bj->", deflection, stiffness, deflection)
    stored += 0.5 * np.einsum("bi,ij,bj->", still, mass, still)
    residuals = np.array([
        known.of("shown", one.at, one.at, one.powers, one.powers) / one.powers[:, 0] ** 2 for one in state.wheels
    ])  # fmt: skip
    assert works.stored_by(whole, known, state, residuals)[0] == pytest.approx(stored, rel=1e-9)


# -- the choice of a ring ---------------------------------------------------------------------------------------------


def test_slow_decay_makes_a_longer_ring_and_a_very_slow_one_a_note():
    lively = wt.tracks.Slab(rail="UIC60", spacing=0.6, pad_stiffness=300e6, pad_damping=5e3)
    longer = reach.reach_of(lively)
    assert 80 < longer.bays < reach.MOST_BAYS
    assert longer.image <= reach.ACCURACIES["default"].image
    assert longer.notes == ()
    ringing = wt.tracks.Slab(rail="UIC60", spacing=0.6, pad_stiffness=300e6, pad_damping=0.0)
    short = reach.reach_of(ringing)
    assert short.bays == reach.MOST_BAYS
    (note,) = short.notes
    needed = int(note.split("set track.bays = ")[1])
    assert reach.image_level(section_of(ringing), needed * 0.6) <= reach.ACCURACIES["default"].image
    assert reach.image_level(section_of(ringing), 0.8 * needed * 0.6) > reach.ACCURACIES["default"].image


def test_the_image_level_is_what_comes_around_the_ring():
    """Against the track's own cross receptance: a ring is the sum over its images."""
    track = wt.tracks.Slab(rail="UIC60", spacing=0.6, pad_stiffness=300e6, pad_damping=5e3)
    ring = ring_of(track, 24, 12e3).ring
    for frequency in (700.0, 1500.0):
        summed = sum(
            complex(wt.tracks.receptance(track, frequency, 0.25, 0.25 + 24 * 0.6 * image)) for image in range(-30, 31)
        )
        alone = complex(wt.tracks.receptance(track, frequency, 0.25))
        assert abs(summed - alone) > 0.05 * abs(alone)
        assert abs(modal_receptance(ring, 2 * pi * frequency, 0.25, 0.25) - summed) < 0.01 * abs(alone)


def test_a_train_makes_the_ring_longer():
    track = named("rolland_UIC60_example")
    assert reach.reach_of(track, extent=19.0).bays == 80 + 32
    assert reach.reach_of(track, extent=19.0).image == pytest.approx(reach.reach_of(track).image, rel=0.05)


def test_a_cut_off_below_the_excitation_is_noted_with_the_number_that_would_do():
    chosen = reach.reach_of(named("rolland_UIC60_example"))
    assert reach.cutoff_note(chosen, 2500.0) is None
    assert "set track.cutoff = 7200 Hz" in reach.cutoff_note(chosen, 3600.0)
    assert not reach.cutoff_note(chosen, 3600.0).doubtful
    assert reach.cutoff_note(chosen, 5600.0).doubtful


def test_a_track_may_name_cut_off_and_bays_itself():
    track = wt.tracks.Slab(**wt.tracks.Slab.example, cutoff="3 kHz", bays=40)
    modes, chosen = reach.modes_of(track, "strict")
    assert (chosen.cutoff, chosen.bays, modes.ring.bays) == (3000.0, 40, 40)
    assert np.abs(modes.ring.rates).max() < 2 * pi * 3000.0
    assert len(chosen.notes) == 1


# -- rings with seats that differ, without damping --------------------------------------------------------------------

BARE = {"damping": 0.0}, {"pad_damping": 0.0}, {"ballast_damping": 0.0}
"""What takes the damping of a rail, of pads and of ballast."""


def bared(rail=False, pads=False, ballast=False, **fields):
    """Return the example's track, with scatter and a missing pad, without some of its damping."""
    track = named("rolland_UIC60_example")
    held = {name: getattr(track, name) for name in type(track).model_fields if name != "rail"}
    held["rail"] = track.rail.model_copy(update=BARE[0] if rail else {})
    held["anomalies"] = wt.tracks.Scatter(pads=0.1, ballast=0.1, seed=4), wt.tracks.MissingPad(seat=1)
    held |= (BARE[1] if pads else {}) | (BARE[2] if ballast else {})
    return wt.tracks.Ballasted(**held | fields)


def own_ring(track, bays, omega):
    """Return the receptance between the nodes of a ring, whose seats and sleepers are written here."""
    section = section_of(track)
    pads, ballasts = np.ones(bays), np.ones(bays)
    scatter, missing = track.anomalies
    for one in (*scatter.changes(range(-(bays // 4), bays - bays // 4)), *missing.changes(range(1, 2))):
        pads[one.seat % bays] *= one.pad
        ballasts[one.seat % bays] *= one.ballast
    mass, stiffness = bay.rail_matrices(section, 2)
    nodes = len(mass) // 2
    free = bays * (nodes - 1)
    system = np.zeros((2 * free, 2 * free), dtype=complex)
    for number in range(bays):
        at = (number * (nodes - 1) + np.arange(nodes)) % free
        both = np.append(at, free + at)
        system[np.ix_(both, both)] += (1.0 + 1j * omega * track.rail.damping) * stiffness - omega**2 * mass
        pad = pads[number] * (track.pad_stiffness + 1j * omega * track.pad_damping)
        below = ballasts[number] * (track.ballast_stiffness + 1j * omega * track.ballast_damping)
        below -= track.sleeper_mass * omega**2
        system[at[0], at[0]] += pad * below / (pad + below)
    return np.linalg.inv(system)


@pytest.mark.slow
@pytest.mark.parametrize("bare", [("rail",), ("pads",), ("ballast",), ("rail", "pads", "ballast")])
def test_a_ring_with_scatter_is_a_dense_matrix_of_all_its_seats(bare):
    """At ends of elements, where these are exact; its frequencies are none of the resonances, which are not damped."""
    track = bared(**dict.fromkeys(bare, True), bays=24)
    modes, _ = reach.modes_of(track)
    for omega in (0.0, 2 * pi * 213.0, 2 * pi * 481.0):
        exact = own_ring(track, 24, omega)
        for end in (0, 1, 2, 9):
            found = modal_receptance(modes.ring, omega, 0.3 * end, 0.3 * end)
            assert abs(found - exact[8 * end, 8 * end]) < (1e-3 if omega else 1e-7) * abs(found)


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", reach.ACCURACIES)
def test_a_ring_with_anomalies_has_no_more_unknowns_than_its_eigenvectors_can_take(accuracy):
    """However slowly waves decay; what a shorter ring costs is in its note."""
    for bare in (
        {},
        {"rail": True},
        {"pads": True},
        {"ballast": True},
        dict.fromkeys(("rail", "pads", "ballast"), True),
    ):
        chosen = reach.reach_of(bared(**bare), accuracy)
        assert chosen.bays >= reach.ACCURACIES[accuracy].fewest
        assert 2 * len(ring_of(bared(**bare), chosen.bays, chosen.cutoff).ring.rates) < 1.02 * reach.MOST_UNKNOWNS
        assert (chosen.notes == ()) == (chosen.image <= reach.ACCURACIES[accuracy].image)


def test_a_ring_with_anomalies_that_would_take_very_long_is_refused_with_the_number_that_would_do():
    with pytest.raises(wt.InputError, match=r"a ring of 1000 bays with anomalies .* minutes of computing") as error:
        reach.reach_of(bared(bays=1000))
    fits = int(str(error.value).split("allowed: at most ")[1].split()[0])
    assert reach.reach_of(bared(bays=fits, rail=True)).bays == fits
    with pytest.raises(wt.InputError, match="minutes of computing"):
        reach.reach_of(bared(bays=fits + 1))
