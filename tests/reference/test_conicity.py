"""Equivalent conicity against a program of its own, closed forms, and figures of the standard's reference profiles.

The other program looks for the smallest gap at places a thousandth of a millimetre apart, lets the wheelset go from
rest, and follows its motion to the next rest.
"""

import json

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import wheeltapper as wt
from wheeltapper.describe.profile.en15302 import GAUGE, rail_en15302, wheel_en15302
from wheeltapper.faces.cli import main


def pair(letter, **changes):
    fields = {"wheel": f"EN 15302 {letter}", "rail": "EN 15302 A", "inclination": 0.0, "gauge": GAUGE} | changes
    return wt.profiles.WheelRail(**fields)


def radii_by_search(letter, shifts):
    """Return the height of a wheel at its contact, mm, over shifts outwards, mm, in the standard's frames."""
    y = np.arange(-32.6, 39.2, 1e-3)
    rail, out = rail_en15302("A", y), []
    for shift in shifts:
        wheel = wheel_en15302(letter, y - shift)
        out.append(wheel[np.nanargmax(wheel + rail)])
    return np.array(out)


def motion_from_rest(difference, shifts, begin, arm):
    """Return amplitude and wavelength, mm, of a motion that begins at rest."""

    def rates(x, state):
        return state[1], -np.interp(state[0], shifts, difference) / arm

    def rest(x, state):
        return state[1]

    rest.terminal, rest.direction = True, 1.0
    end = solve_ivp(rates, (0.0, 1e5), [begin, -1e-12], events=rest, rtol=1e-9, atol=1e-12, max_step=5.0)
    return 0.5 * (begin - end.y[0, -1]), 2.0 * end.t[-1]


SHIFTS = np.arange(-7.0, 7.001, 0.01)


@pytest.fixture(scope="module")
def heights():
    return {letter: radii_by_search(letter, SHIFTS) for letter in "ABCHI"}


@pytest.mark.parametrize(
    ("left", "right", "smaller", "begins"),
    [
        ("A", "A", 0.0, (1.5, 2.5, 4.0, 5.5)), ("B", "B", 0.0, (1.5, 2.5, 4.5, 6.0)),
        ("C", "C", 0.0, (0.8, 2.0, 3.0, 6.0)), ("B", "B", 1.0, (2.0, 4.5)), ("A", "B", 0.0, (2.0, 4.0)),
        ("H", "H", 0.0, (1.5, 2.2, 3.5, 6.0)), ("I", "I", 0.0, (2.0, 2.5, 3.0, 6.0)), ("A", "A", 1.0, (1.5, 3.5)),
        ("H", "H", 1.0, (2.0, 4.0)), ("I", "I", 1.0, (3.0, 4.5)),
    ],
)  # fmt: skip
def test_reference_profiles_have_the_conicity_of_a_motion_that_is_followed(heights, left, right, smaller, begins):
    difference = heights[left] - heights[right][::-1] + smaller
    arm = 1500.0 * (460.0 - 0.5 * smaller)
    for begin in begins:
        amplitude, wavelength = motion_from_rest(difference, SHIFTS, begin, arm)
        radius = [0.46, 0.46 - 1e-3 * smaller]
        found = wt.profiles.conicity(pair(left), 1e-3 * amplitude, right=pair(right), radius=radius)
        expected = 2.0 * arm * (np.pi / wavelength) ** 2
        assert float(found.equivalent_conicity[0]) == pytest.approx(expected, abs=0.003)
        assert float(found.wavelength[0]) == pytest.approx(1e-3 * wavelength, rel=0.01)


@pytest.mark.parametrize("letter", "ABCHI")
def test_differences_of_rolling_radii_are_those_of_a_search(heights, letter):
    found = wt.profiles.conicity(pair(letter), 3e-3)
    own = 1e3 * np.interp(1e-3 * SHIFTS, found.lateral_shift.values, found.radius_difference.values)
    apart = np.abs(own - (heights[letter] - heights[letter][::-1]))
    assert np.median(apart) < 3e-4
    near = np.abs(SHIFTS[:, None] - 1e3 * found.jump_shift.values).min(axis=1, initial=1.0) < 0.02
    assert apart[~near].max() < 0.03  # where profiles lie in one another, a thousandth of a shift moves contact far


def test_figures_of_the_reference_profiles():
    found = wt.profiles.conicity(pair("A"))
    assert found.attrs["at_3_mm"] == pytest.approx(0.188, abs=5e-4)
    assert float(1e3 * np.interp(3e-3, found.lateral_shift.values, found.radius_difference.values)) == pytest.approx(
        1.243, abs=1.5e-3
    )
    assert wt.profiles.conicity(pair("C")).attrs["at_3_mm"] == pytest.approx(0.271, abs=5e-4)
    at = found.equivalent_conicity.interp(amplitude=[2e-3, 4e-3]).values
    assert found.attrs["nonlinearity"] == pytest.approx((at[1] - at[0]) / 2.0, abs=1e-6)


def test_wheels_that_do_not_steer_have_no_conicity():
    found = wt.profiles.conicity(pair("I"), [1.2e-3, 1.7e-3])  # both wheels touch with cylinders up to 1.726 mm
    assert found.equivalent_conicity.values.tolist() == [0.0, 0.0]
    assert np.isinf(found.wavelength).all()


def test_the_elastic_figure_of_stiff_contacts_differs_by_the_roll_alone():
    found = wt.profiles.conicity(pair("A", smoothing=2e-7), contact="elastic")
    assert found.attrs["at_3_mm"] == pytest.approx(0.191, abs=1.5e-3)
    assert "equivalent_conicity" not in found
    assert "jump" not in found.dims


def test_cones_have_their_own_conicity_at_all_amplitudes():
    cones = wt.profiles.Cones(conicity=0.05)
    for radius in (0.46, [0.46, 0.4599]):
        found = wt.profiles.conicity(cones, [1e-3, 5e-3], radius=radius)
        np.testing.assert_allclose(found.equivalent_conicity, 0.05, rtol=2e-6)
        np.testing.assert_allclose(found.wavelength, 2.0 * np.pi * np.sqrt(0.75 * np.mean(radius) / 0.05), rtol=1e-6)
    flat = wt.profiles.conicity(wt.profiles.Cones())
    assert flat.attrs["at_3_mm"] == 0.0


def test_sides_that_change_places_run_as_before():
    one, other = (wt.profiles.conicity(pair(a), right=pair(b)) for a, b in ("AB", "BA"))
    np.testing.assert_allclose(one.equivalent_conicity, other.equivalent_conicity, rtol=1e-9)
    np.testing.assert_allclose(one.radius_difference, -other.radius_difference.values[::-1], atol=1e-15)
    np.testing.assert_allclose(one.jump_shift, -other.jump_shift.values[::-1], atol=1e-15)
    np.testing.assert_allclose(one.contact_angle[0], other.contact_angle.values[1][::-1], atol=1e-15)


def test_contact_jumps_where_both_places_carry():
    found = wt.profiles.conicity(pair("H"), 6e-3)
    assert len(found.jump_shift) == 4
    for shift in found.jump_shift.values:
        before, after = (
            float(np.interp(shift + by, found.lateral_shift.values, found.radius_difference.values))
            for by in (-1e-6, 1e-6)
        )
        assert abs(after - before) > 1e-4
    assert np.all(found.jump_of_radius > 1e-4)  # wheelsets are centred by jumps outwards


def test_a_motion_that_is_no_wave_has_no_figure():
    found = wt.profiles.conicity(wt.profiles.Cones(conicity=0.05), 3e-3, radius=[0.46, 0.45])  # rolls away
    assert np.isnan(found.equivalent_conicity).all()
    assert np.isnan(found.attrs["at_3_mm"])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"amplitudes": 0.02}, "amplitudes: found 0.02 m; allowed: at most 0.015 m"),
        ({"amplitudes": []}, r"amplitudes: found \[\]"),
        ({"radius": [0.46, 0.46, 0.46]}, "radius: found 3 radii"),
        ({"contact": "stiff"}, "contact: found 'stiff'"),
        ({"right": pair("B", gauge=1.43)}, "right.gauge: found 1.43 m, 1.43516 m on the left"),
        ({"right": wt.profiles.Cones()}, "right: found"),
        ({"right": pair("B"), "contact": "elastic"}, 'contact: found "elastic", with two sides that differ'),
        ({"profiles": "S1002"}, "profiles: found 'S1002'; allowed: WheelRail or Cones"),
        ({"profiles": wt.profiles.WheelRail(rail="61E1")}, "rail: found no such file; allowed: '60E1', 'EN 15302 A'"),
    ],
)
def test_wrong_arguments_are_refused(arguments, words):
    given = {"profiles": pair("A"), **arguments}
    with pytest.raises(wt.InputError, match=words):
        wt.profiles.conicity(**given)


def test_the_command_tells_it_and_draws_it(tmp_path, capsys):
    picture = tmp_path / "conicity.png"
    own = ["--inclination", "0", "--gauge", "1435.164 mm"]
    assert main(["conicity", "EN 15302 A", "EN 15302 A", *own, "--plot", str(picture)]) == 0
    said = capsys.readouterr().out
    assert "equivalent conicity at 3 mm: 0.188" in said
    assert picture.stat().st_size > 10_000
    assert main(["conicity", "EN 15302 A", "EN 15302 A", *own, "--right-wheel", "EN 15302 B", "--json"]) == 0
    held = json.loads(capsys.readouterr().out)
    assert held["profiles"] == "EN 15302 A on EN 15302 A, right EN 15302 B on EN 15302 A"
    assert held["at_3_mm"] == pytest.approx(wt.profiles.conicity(pair("A"), right=pair("B")).attrs["at_3_mm"])
    assert main(["conicity", "S1002", "60E1"]) == 0
    assert "contact jumps at +0.21 mm: rolling radii by 0.45 mm" in capsys.readouterr().out
    assert main(["conicity", "S1002", "worn.ban"]) == 2
    assert "no such file" in capsys.readouterr().err


def test_pictures_of_pairs_over_one_another():
    found = [wt.profiles.conicity(pair(letter)) for letter in "AC"]
    figures, radii = wt.plot(found).axes
    assert len(figures.lines) == 3
    assert len(radii.lines) == 2
