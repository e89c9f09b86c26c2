"""Energy is never created over random rolls of suspensions with dry friction, bumpstops, corners and blow-off."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.ground.outcome import Outcome

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
BOGIE = wt.vehicles.Bogie.example
DECK = wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4)


def kinks_of(random, stiffness, damping):
    """Return some fields of one suspension at random."""
    corners = np.sort(random.uniform(-4e-4, 4e-4, random.integers(1, 4)))
    each = [
        {"friction": random.uniform(100, 1e4), "friction_stiffness": 10 ** random.uniform(6, 8)},
        {"bumpstop_gap": random.uniform(2e-5, 4e-4), "bumpstop_stiffness": 10 ** random.uniform(6, 8)},
        {"spring_corners": tuple((float(place), random.uniform(0.0, 4.0 * stiffness)) for place in corners)},
        {"blow_off_force": random.uniform(300, 6e3), "blow_off_damping": random.uniform(0.0, 0.95) * damping},
    ]
    taken = random.permutation(len(each))[: random.integers(1, len(each) + 1)]
    return {name: value for number in taken for name, value in each[number].items()}


def rolled(seed):
    """Return a random vehicle over a random rail."""
    random = np.random.default_rng(seed)
    if random.random() < 0.6:
        stiffness, damping = random.uniform(0.5e6, 5e6), random.uniform(2e3, 6e4)
        vehicle = wt.Wheelset(
            mass=random.uniform(800, 2000), load=random.uniform(4e4, 1.2e5), stiffness=stiffness, damping=damping,
            **kinks_of(random, stiffness, damping),
        )  # fmt: skip
    else:
        kinks = {
            f"{level}_{name}": value
            for level in ("primary", "secondary")
            for name, value in kinks_of(random, BOGIE[f"{level}_stiffness"], BOGIE[f"{level}_damping"]).items()
        }
        vehicle = wt.vehicles.Bogie(**BOGIE, **kinks)
    waves = [
        wt.Corrugation(amplitude=random.uniform(2e-5, 2e-4), wavelength=random.uniform(0.06, 0.6), start=0.0)
        for _ in range(2)
    ]
    return wt.Scenario(
        vehicle=vehicle, track=DECK if random.random() < 0.3 else wt.StiffTrack(), contact=wt.Hertz(constant=1.4e11),
        irregularity=[*waves, wt.CosineBump(height=random.uniform(1e-4, 6e-4), length=0.2, start=0.1)],
        rolling="point", speed=random.uniform(3.0, 30.0), duration=0.02,
    )  # fmt: skip


def check_energy(seeds):
    """Check the balances of some rolls; return how many events there were."""
    events = 0
    for seed in seeds:
        record = wt.simulate(rolled(seed), "strict")
        assert record.outcome is Outcome.COMPLETED, seed
        energy = record.energy
        assert abs(float(energy.relative_imbalance)) < 1e-10, seed
        heat = float(energy.dissipated_friction)
        assert heat >= -1e-10 * float(energy.dissipated), seed
        assert float(energy.dissipated) >= heat, seed
        events += record.suspension_events.sizes["suspension_event"]
    return events


@pytest.mark.slow
def test_energy_closes_and_friction_only_takes():
    assert check_energy(range(2)) > 20


@pytest.mark.whole
@pytest.mark.slow
def test_energy_closes_over_many_rolls():
    assert check_energy(range(2, 100)) > 580
