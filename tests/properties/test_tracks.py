"""Any track on seats: at rest its ring is the infinite track, its modes decay, its receptance is reciprocal."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import wheeltapper as wt
from tests.drawn import drawn
from wheeltapper.lower.track import reach, readouts
from wheeltapper.lower.track.ring import ring_of
from wheeltapper.lower.track.section import section_of


def between(low, high):
    """Return numbers between two, spread evenly over their logarithms."""
    return st.floats(np.log(low), np.log(high)).map(lambda number: float(np.exp(number)))


RAILS = st.builds(
    wt.tracks.Rail, bending_stiffness=between(2e5, 2e7), shear_stiffness=between(3e7, 1e9),
    mass_per_length=between(15.0, 100.0), damping=st.sampled_from([0.0, 2e-6, 1e-5]),
)  # fmt: skip
SEATS = {
    "rail": RAILS, "spacing": between(0.3, 1.2), "pad_stiffness": between(5e6, 5e9),
    "pad_damping": st.one_of(st.just(0.0), between(1e3, 1e6)),
}  # fmt: skip
TRACKS = st.one_of(
    st.builds(wt.tracks.Slab, **SEATS),
    st.builds(
        wt.tracks.Ballasted, **SEATS, sleeper_mass=between(20.0, 500.0), ballast_stiffness=between(5e6, 5e9),
        ballast_damping=between(1e3, 1e6),
    ),
)  # fmt: skip


def modal_deflection(modes, x):
    """Return the static deflection under a unit force by the modes and the residual."""
    ring = modes.ring
    _, element, zeta = readouts.place_of(ring, x)
    powers = zeta ** np.arange(ring.deflection.shape[1])
    kept = -ring.weights * (powers @ ring.deflection[element]) * (powers @ ring.drive[element]) / ring.rates
    return np.real(kept).sum() + zeta ** np.arange(ring.residual.shape[1]) @ ring.residual[element]


@pytest.mark.slow
@drawn(60)
@given(TRACKS)
def test_at_rest_the_ring_is_the_infinite_track_and_its_modes_do_not_grow(track):
    modes = ring_of(section_of(track), 40, 5e3)
    places = track.spacing * np.array([0.0, 0.03, 0.29, 0.5, 0.77])
    exact = wt.tracks.static_deflection(track, places).values
    found = [modal_deflection(modes, x) for x in places]
    np.testing.assert_allclose(found, exact, rtol=0.0, atol=1e-6 * exact.max())
    assert np.all(modes.ring.rates.real < 1e-6)


@drawn(60)
@given(TRACKS, st.floats(0.0, 800.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_receptances_are_reciprocal_and_take_energy_from_the_force(track, frequency, where, at):
    there, back = (complex(wt.tracks.receptance(track, frequency, *pair)) for pair in ((where, at), (at, where)))
    own = complex(wt.tracks.receptance(track, frequency, where))
    assert abs(there - back) <= 1e-6 * abs(own)
    assert own.imag <= 1e-9 * abs(own)
    assert float(wt.tracks.decay_rate(track, frequency)) >= -1e-6


@pytest.mark.slow
@drawn(40)
@given(TRACKS)
def test_the_ring_that_is_chosen_is_the_shortest_that_is_quiet_enough(track):
    section, asked = section_of(track), reach.ACCURACIES["default"]
    chosen = reach.reach_of(track)
    assert bool(chosen.notes) == (chosen.image > asked.image)
    assert chosen.bays == reach.MOST_BAYS if chosen.notes else chosen.bays <= reach.MOST_BAYS
    if asked.fewest < chosen.bays < reach.MOST_BAYS:
        assert reach.image_level(section, (chosen.bays - 1) * track.spacing) > asked.image
