"""Faults at other sites than the example's, from passages of a second program: speeds, decks, bumps, sample rates."""

import numpy as np
import pytest

import wheeltapper as wt
from tests import passages
from wheeltapper.diagnosis import Recording, Site

EXAMPLE = wt.load("examples/site.toml")
FAULTS = [
    "healthy", "wheel flat", "broken spring", "lost damper", "free play", "mass deviation", "out of round", "soft bush",
]  # fmt: skip
DECKS = [(15e3, 1.5e7, 5e4), (6e3, 1e7, 4e4), (40e3, 6e7, 2e5)]
"""Mass (kg), stiffness (N/m) and damping (N s/m)."""
BUMPS = [(2e-4, 0.05), (1e-4, 0.03), (4e-4, 0.1)]
"""Height and length, m."""
RATES, SPEEDS = [1e4, 2e4, 5e4], [3.0, 6.0, 12.0, 18.0]
START, ENTRY, LENGTH = 1.5, 0.3, 5.0
"""Of the bump and of the deck, and the deck's length, m."""


def drawn(fault, seed):
    """Return a site, the recording of a passage there with a fault, and the fault's size."""
    random = np.random.default_rng([91, FAULTS.index(fault), seed])
    mass, stiffness, damping = DECKS[random.integers(3)]
    height, length = BUMPS[random.integers(3)]
    rate, speed = RATES[random.integers(3)], SPEEDS[random.integers(4)]
    stated = passages.Passage(
        deck_mass=mass, deck_stiffness=stiffness, deck_damping=damping, deck_start=ENTRY, deck_length=LENGTH,
        bump_height=height, bump_length=length, bump_start=START,
    )  # fmt: skip
    truth, size, _ = passages.drawn(stated, fault, random, speeds=(0.9 * speed, 1.1 * speed))
    most = 80.0 * DECKS[0][0] / mass
    sensor = passages.Sensor(rate=rate, range=most)
    found = passages.recorded(truth, sensor, 5.3 / truth.speed + 0.05, random, passages.Wrongs(gauge=0.01))
    changes = {
        "irregularity.0.start": START, "irregularity.0.height": height, "irregularity.0.length": length,
        "track.start": ENTRY, "track.length": LENGTH, "track.mass": mass, "track.stiffness": stiffness,
        "track.damping": damping, "speed": speed,
    }  # fmt: skip
    told = EXAMPLE.model_dump()
    told["sensor"] |= {"rate": rate, "range": most}
    told |= {"passage": EXAMPLE.passage.replaced(changes), "uncertainty": EXAMPLE.uncertainty | {"speed": 0.01}}
    recording = Recording(found.samples, found.rate, clipped=found.clipped, speed=found.speed)
    return Site.model_validate(told), recording, size


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("fault", "seed"),
    [
        ("soft bush", 2),  # 17 m/s, a deck of 15 t: a plain fit takes 0.4 % of the damping for it, and is clear
        ("mass deviation", 1),  # 2.8 m/s, a deck of 40 t
        *(pytest.param("soft bush", seed, marks=pytest.mark.slow) for seed in (1, 4, 5, 6, 9)),
        *(pytest.param("out of round", seed, marks=pytest.mark.slow) for seed in (1, 7)),  # 18 and 3 m/s
        *(pytest.param("wheel flat", seed, marks=pytest.mark.slow) for seed in (0, 1)),
        pytest.param("broken spring", 1, marks=pytest.mark.slow),
    ],
)
@pytest.mark.slow
def test_faults_are_told_at_other_sites(fault, seed):
    site, recording, size = drawn(fault, seed)
    told = wt.diagnose(recording, site, progress=False)
    assert told.verdict == fault
    assert told.reduced < 1.15
    assert told.size == pytest.approx(size, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 10])
def test_play_whose_stops_are_never_reached_is_named_beside_a_lost_damper(seed):
    site, recording, _ = drawn("free play", seed)
    told = wt.diagnose(recording, site, progress=False)
    assert told.verdict == "lost damper"
    assert "free play" in told.alike
