"""Realised spectra against what is stated: variances, third-octave levels, coherence, the patch's filter."""

import warnings
from math import pi

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import csd, welch
from scipy.special import j1

import wheeltapper as wt
from wheeltapper.describe.irregularity.density import filter_of_patch

Spectrum = wt.irregularities.Spectrum
ISO_2013 = {0.4: 17.1, 0.1: 4.9, 0.04: -3.2, 0.0315: -5.0, 0.01: -8.0, 0.00315: -11.0}
"""Levels of ISO 3095:2013, dB re 1 µm, by nominal wavelength."""
ISO_2005 = {0.63: 23.5, 0.1: 8.8, 0.01: -9.7, 0.0063: -9.7}


def heights(spectrum, count=None):
    """Return the heights of a period, and their spacing."""
    count = count or 4 * spectrum.pieces
    x = spectrum.length * np.arange(count) / count
    return spectrum.course(0.46).value(x), x[1]


def power_of(y, spacing):
    """Return wavenumbers and the mean square of each line, of one period."""
    k = np.fft.rfftfreq(len(y), spacing)
    return k, 2.0 * np.abs(np.fft.rfft(y) / len(y)) ** 2


@pytest.mark.parametrize(("curve", "levels"), [("ISO 3095:2013", ISO_2013), ("ISO 3095:2005", ISO_2005)])
def test_each_third_octave_of_a_period_has_the_level_of_the_standard(curve, levels):
    k, power = power_of(*heights(Spectrum(curve=curve, seed=4, period=60.0)))
    for nominal, level in levels.items():
        middle = 10.0 ** (round(10.0 * np.log10(1.0 / nominal)) / 10.0)
        band = (k >= middle * 10**-0.05) & (k < middle * 10**0.05)
        lines = band.sum()
        found = 10.0 * np.log10(power[band].sum() / 1e-12)
        assert found == pytest.approx(level, abs=0.02 + 4.4 / lines)  # a line at the band's edge belongs to both


def test_third_octave_levels_of_a_stretch_scatter_about_the_standard():
    y, spacing = heights(Spectrum(curve="ISO 3095:2013", wavelengths=(0.01, 0.4), seed=4))
    waves, levels = wt.irregularities.third_octave_levels(y[: len(y) // 2], spacing)
    for nominal in (0.1, 0.04, 0.0315):
        (found,) = levels[np.abs(waves / nominal - 1.0) < 0.02]
        assert found == pytest.approx(ISO_2013[nominal], abs=0.7)


def erri(omega, A=4.032e-7, c=0.8246, r=0.0206):
    return A * c**2 / ((r**2 + omega**2) * (c**2 + omega**2))


@pytest.mark.parametrize("band", [(3.0, 25.0), (25.0, 70.0)])
def test_the_variance_in_a_band_is_the_integral_of_the_one_sided_density_over_rad_per_metre(band):
    k, power = power_of(*heights(Spectrum(curve="ERRI B176 low", wavelengths=(1.0, 100.0), seed=2)))
    inside = (k > 1.0 / band[1]) & (k <= 1.0 / band[0])
    exact = quad(erri, 2.0 * pi / band[1], 2.0 * pi / band[0])[0]
    assert power[inside].sum() == pytest.approx(exact, rel=0.02)  # a hundredth of it is in one line


def test_an_estimated_density_over_cycles_per_metre_is_that_stated():
    """Welch's estimate, which knows nothing of the waves; cycles per metre have 2π times the density of rad/m."""
    y, spacing = heights(Spectrum(curve="FRA 4", wavelengths=(0.5, 50.0), seed=8), 2**17)
    k, density = (out[1:] for out in welch(y, 1.0 / spacing, nperseg=2**13, noverlap=2**12))
    omega, inside = 2.0 * pi * k, (k > 0.05) & (k < 1.5)
    A, c = 0.25 * 0.5376e-4, 0.8245
    exact = 2.0 * pi * A * c**2 / (omega**2 * (omega**2 + c**2))[inside]
    ratio = density[inside] / exact
    assert np.exp(np.mean(np.log(ratio))) == pytest.approx(1.0, abs=0.05)


def test_a_deviation_is_that_of_the_waves_of_its_band():
    k, power = power_of(*heights(Spectrum(curve="ERRI B176 high", wavelengths=(1, 100), deviation="1.2 mm", seed=5)))
    inside = (k >= 1.0 / 25.0) & (k <= 1.0 / 3.0)
    assert np.sqrt(power[inside].sum()) == pytest.approx(1.2e-3, rel=0.004)
    own = Spectrum(densities=((1.0, 1e-8), (2.0, 1e-7)), deviation="0.1 mm", deviation_band=(1.0, 2.0))
    assert heights(own)[0].std() == pytest.approx(1e-4, rel=1e-3)


def test_tables_of_densities_are_straight_over_logarithms():
    """G = 1e-8·λ³: its integral from 1/2 to 1 per metre is 1.5e-8 m²."""
    own = Spectrum(densities=((1.0, 1e-8), (1.3, 1e-8 * 1.3**3), (2.0, 8e-8)), seed=1)
    assert heights(own)[0].var() == pytest.approx(1e-8 * (1 / 0.5**2 - 1) / 2, rel=1e-3)


def test_level_is_added():
    plain, raised = (heights(Spectrum(levels=((0.1, 5.0), (0.2, 9.0)), added=dB))[0] for dB in (0.0, 6.0))
    np.testing.assert_allclose(raised, 10**0.3 * plain, rtol=1e-12, atol=1e-18)


def test_the_path_is_the_sum_of_its_waves():
    """At any place, not only where pieces meet; they are as short as 2.5 per wave."""
    spectrum = Spectrum(levels=((0.1, 0.0), (0.126, 0.0)), seed=3, period=20.0, position=0.3)
    k, variance = spectrum.variances()
    phase = spectrum.phases(round(k[-1] * spectrum.length))[np.rint(k * spectrum.length).astype(int) - 1]
    x = np.random.default_rng(0).uniform(-30.0, 60.0, 500)
    course = spectrum.course(0.46)
    for order, which in enumerate(("value", "slope", "curvature")):
        turned = 2.0 * pi * np.multiply.outer(x - 0.3, k) + phase + 0.5 * pi * order
        exact = np.cos(turned) @ (np.sqrt(2.0 * variance) * (2.0 * pi * k) ** order)
        np.testing.assert_allclose(getattr(course, which)(x), exact, atol=3e-4 * 30.0**order * np.abs(exact).std())


def test_a_seed_gives_the_same_rail_to_every_run_and_another_seed_another():
    spectrum = Spectrum(curve="ISO 3095:2013", wavelengths=(0.02, 0.4), seed=7)
    same, other = (Spectrum(curve="ISO 3095:2013", wavelengths=(0.02, 0.4), seed=seed) for seed in (7, 8))
    x = np.linspace(0.0, 50.0, 2000)
    y, again, another = (one.course(0.46).value(x) for one in (spectrum, same, other))
    np.testing.assert_array_equal(y, again)
    assert abs(np.corrcoef(y, another)[0, 1]) < 0.2
    np.testing.assert_allclose(spectrum.course(0.46).value(x + spectrum.length), y, atol=1e-15)


def test_waves_keep_their_phases_in_a_wider_band():
    narrow, wide = (
        Spectrum(curve="ISO 3095:2013", wavelengths=(shortest, 0.4), seed=7, period=50.0) for shortest in (0.1, 0.04)
    )
    long = np.fft.rfft(heights(wide, 8192)[0])[: int(narrow.length / 0.1) - 2] / 8192
    np.testing.assert_allclose(np.fft.rfft(heights(narrow, 8192)[0])[: len(long)] / 8192, long, atol=1e-10)


@pytest.mark.parametrize("coherence", [0.0, 0.3, 0.8, 1.0])
def test_two_rails_have_the_coherence_and_each_of_them_the_spectrum(coherence):
    both = Spectrum(curve="ISO 3095:2013", wavelengths=(0.05, 0.4), seed=11, coherence=coherence, period=600.0)
    left, right = (heights(both.on_rail(side)) for side in ("left", "right"))
    for own in (left, right):
        np.testing.assert_allclose(power_of(*own)[1], power_of(*heights(both))[1], atol=1e-18)
    length = 4096
    cross = csd(left[0], right[0], nperseg=length)[1]
    levels = [csd(one[0], one[0], nperseg=length)[1] for one in (left, right)]
    k = np.fft.rfftfreq(length, left[1])
    inside = (k > 3.0) & (k < 18.0)
    found = np.abs(cross[inside]) ** 2 / np.real(levels[0] * levels[1])[inside]
    assert found.mean() == pytest.approx(coherence, abs=0.06)


def test_a_coach_meets_two_rails_and_a_wheelset_in_the_plane_one():
    both = Spectrum(curve="ERRI B176 low", wavelengths=(3.0, 30.0), seed=2, coherence=0.2)
    coach = wt.load("examples/coach_step.toml").replaced({"irregularity": [both], "speed": 30.0, "duration": 0.3})
    left, right = (coach.irregularities_on(1, side)[0] for side in ("left", "right"))
    assert (left.rail, right.rail) == ("left", "right")
    force = wt.simulate(coach).history("1 kHz").normal_force.sel(wheelset=1)
    assert float(np.abs(force.sel(side="left") - force.sel(side="right")).max()) > 500.0
    same = wt.simulate(coach.replaced({"irregularity": [both.model_copy(update={"coherence": 1.0})]}))
    force = same.history("1 kHz").normal_force.sel(wheelset=1)
    assert float(np.abs(force.sel(side="left") - force.sel(side="right")).max()) < 1e-3


def test_the_filter_of_the_patch_is_the_mean_over_a_circle_without_its_zeros():
    """Against the mean of cos over a disc by quadrature; the mean of |H|² over a period of its zeros, far out."""
    radius, k = 5e-3, 1.0 / 0.05
    exact = quad(lambda u: 4.0 / pi * np.sqrt(1.0 - u**2) * np.cos(2.0 * pi * k * radius * u), 0.0, 1.0)[0]
    argument = 2.0 * pi * k * radius
    assert exact == pytest.approx(2.0 * j1(argument) / argument, rel=1e-9)
    far = np.linspace(40.0, 40.0 + 20.0 * pi, 20001)
    mean = np.mean((2.0 * j1(far) / far) ** 2 * (1.0 + pi / 4.0 * far**3))
    assert mean == pytest.approx(1.0, abs=0.01)
    np.testing.assert_allclose(filter_of_patch(far / (2.0 * pi * radius), radius), 1.0 / (1.0 + pi / 4.0 * far**3))
    plain, filtered = (
        Spectrum(levels=((0.02, 0.0), (0.01, 0.0)), patch=patch, seed=1, period=20.0) for patch in (None, "5 mm")
    )
    k, one = plain.variances()
    np.testing.assert_allclose(
        filtered.variances()[1], one / (1.0 + pi / 4.0 * (2.0 * pi * k * radius) ** 3), rtol=1e-12
    )


WHEELSET = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4)
ROUGH = Spectrum(curve="ISO 3095:2013", wavelengths=(0.02, 0.4), seed=1)
SCENE = wt.Scenario(
    vehicle=WHEELSET, contact=wt.Hertz(constant=1.405e11), irregularity=ROUGH, speed=10.0, duration=0.1, rolling="point"
)


def test_its_path_is_exact_and_without_kinks_also_in_sums():
    from wheeltapper.lower.build import table_of
    from wheeltapper.lower.numbers import METHODS

    items = [
        ROUGH, Spectrum(curve="ERRI B176 low", wavelengths=(1, 25), seed=2, position=0.1234),
        wt.irregularities.DippedJoint(depth=1e-3, length=1.0, position=2.0),
        wt.CosineBump(height=1e-4, length=0.3, start=3.0),
    ]  # fmt: skip
    table, _ = table_of(SCENE.replaced({"irregularity": items}), 5.0, METHODS["default"])
    x = np.random.default_rng(1).uniform(0.0, 5.0, 1000)
    np.testing.assert_allclose(table.height_at(x), sum(item.course(0.46).value(x) for item in items), atol=1e-15)
    np.testing.assert_allclose(table.kink_positions(), [2.0], atol=0.0)


def test_waves_beyond_the_modes_of_the_track_are_told_with_the_numbers():
    scene = SCENE.replaced({"track": wt.tracks.Ballasted.named("Zhai2004"), "speed": 40.0, "duration": 0.02})
    short = scene.replaced({"irregularity": [Spectrum(curve="ISO 3095:2013", wavelengths=(0.004, 0.4), added=-20)]})
    with pytest.warns(UserWarning, match=r"up to 1e\+04 Hz, but its modes are computed only up to 5000 Hz"):
        wt.simulate(short)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        wt.simulate(scene)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({}, "found no spectrum; allowed: one of curve, levels, densities"),
        ({"curve": "FRA 1", "levels": ((1, 2), (2, 3))}, "found curve and levels; allowed: one of"),
        ({"curve": "ERRI low"}, "curve: found 'ERRI low'; allowed: .*did you mean 'ERRI B176 low'"),
        ({"curve": "FRA 1"}, "wavelengths: found nothing; allowed: shortest and longest wavelength, as FRA 1 has no"),
        ({"curve": "FRA 1", "wavelengths": (5.0, 1.0)}, "wavelengths: found an empty band from 5 to 1 m; allowed: "),
        ({"curve": "FRA 1", "wavelengths": (1.0, 1.0)}, "wavelengths: found an empty band from 1 to 1 m"),
        ({"curve": "ISO 3095:2013", "wavelengths": (0.01, 1.0)}, "wavelengths: found 0.01 to 1 m; allowed: a band w"),
        ({"levels": ((1, 2), (2, 3), (1.5, 3))}, r"levels: found the wavelength 1.5 m after 2 m; allowed: wave"),
        ({"levels": ((1, 2), (1, 3))}, "levels: found the wavelength 1 m after 1 m"),
        ({"levels": ((1, 2),)}, "levels: found 1 rows; allowed: at least two"),
        ({"densities": ((1, 2.0), (2, -3.0))}, r"densities: found -3.0; allowed: finite densities above zero"),
        ({"levels": ((1, float("nan")), (2, 3.0))}, r"levels: found nan; allowed: finite levels"),
        ({"curve": "ISO 3095:2013", "coherence": 1.2}, r"coherence: found 1.2; allowed: 0 to 1"),
        ({"curve": "ISO 3095:2013", "coherence": -0.1}, r"coherence: found -0.1; allowed"),
        ({"curve": "ISO 3095:2013", "seed": -1}, r"seed: found -1; allowed"),
        ({"curve": "ISO 3095:2013", "deviation": 1e-3}, r"deviation_band: found 3 to 25 m; allowed: a band w"),
        ({"curve": "FRA 1", "wavelengths": (1, 30), "deviation": 1e-3, "added": 3}, "added: found 3 dB besides"),
        ({"curve": "FRA 1", "wavelengths": (1e-3, 100)}, "in 10000000 pieces; allowed: up to 4000000"),
    ],
)  # fmt: skip
def test_bad_fields_are_refused_in_one_line(fields, message):
    with pytest.raises(wt.InputError, match=message) as error:
        Spectrum(**fields)
    assert "\n" not in str(error.value)


def test_a_filter_besides_the_circle_is_refused():
    with pytest.raises(
        wt.InputError, match=r'patch of contact, besides rolling = "circle".*; allowed: rolling = "point"'
    ):
        SCENE.replaced({"rolling": "circle", "irregularity": [ROUGH.model_copy(update={"patch": 5e-3})]})


def test_heights_without_a_spectrum_are_refused():
    with pytest.raises(wt.InputError, match="heights: found an array of shape"):
        wt.irregularities.third_octave_levels([1.0, 2.0], 0.1)


@pytest.mark.parametrize("spacing", [0.0, -1e-3, "1 s", None])
def test_a_spacing_that_is_no_length_is_refused(spacing):
    with pytest.raises(wt.InputError, match=r"^spacing: found "):
        wt.irregularities.third_octave_levels(np.zeros(100), spacing)


def test_a_spacing_may_have_a_unit_and_text_is_no_height():
    y = np.random.default_rng(1).standard_normal(400)
    for one, other in zip(*(wt.irregularities.third_octave_levels(y, d) for d in (1e-3, "1 mm")), strict=True):
        np.testing.assert_array_equal(one, other)
    with pytest.raises(wt.InputError, match=r"^heights: found 'abc'"):
        wt.irregularities.third_octave_levels("abc", 1.0)
