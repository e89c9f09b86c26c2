"""A march that its kernel makes in several parts is the march that it makes in one."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.lower.build import lower
from wheeltapper.march.common import telling
from wheeltapper.march.run import march

WHEEL = wt.Wheelset(mass=1600, load=1e5, stiffness=1e6, damping=2e4)
HERTZ = wt.Hertz(constant=1.405e11)
THORNTON = wt.contact.Thornton(constant=1.405e11)
BUMPS = wt.Repeated(of=wt.CosineBump(height=1e-4, length=0.1, start=0.1), period=1.0)
PATH = {"irregularity": BUMPS, "rolling": "point", "speed": 20}
DECK = wt.FloatingDeck(mass=2000, stiffness=5e7, damping=1e5)
SCENES = {
    "looping path": wt.Scenario(vehicle=WHEEL, contact=HERTZ, duration=0.5, **PATH),
    "deck": wt.Scenario(vehicle=WHEEL, contact=HERTZ, track=DECK, duration=0.3, **PATH),
    "yielding": wt.Scenario(vehicle=WHEEL, contact=THORNTON, duration=0.2, **PATH),
    "one spot": wt.Scenario(
        vehicle=WHEEL, contact=THORNTON, speed=0, start={"displacement": 2e-3, "velocity": 0.0}, duration=0.1
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_a_march_in_parts_is_the_march_in_one(name, monkeypatch):
    program = lower(SCENES[name]).program
    whole = march(program)
    monkeypatch.setattr(telling, "CHUNK", len(whole.steps) // 9)
    parts = march(program)
    assert parts.status == whole.status
    for table, expected in zip(parts[1:-1], whole[1:-1], strict=True):  # the last is the program
        np.testing.assert_array_equal(table, expected)


def test_a_march_of_many_parts_meets_every_bump():
    duration = 8.0
    record = wt.simulate(SCENES["looping path"].replaced({"duration": duration}))
    impacts = record.impacts.time.values
    bumps = np.arange(0.0, duration, BUMPS.period / 20)
    assert [((impacts > bump) & (impacts < bump + 0.02)).sum() >= 1 for bump in bumps] == [True] * len(bumps)
    assert len(march(lower(SCENES["looping path"].replaced({"duration": duration})).program).steps) > telling.CHUNK
